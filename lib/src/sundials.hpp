/// \file
/// SUNDIALS behind RAII. Private to lib: nothing outside it sees a SUNDIALS header.
#pragma once

#include <costate/error.hpp>

#include <cvodes/cvodes.h>
#include <kinsol/kinsol.h>
#include <nvector/nvector_serial.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>
#include <sunnonlinsol/sunnonlinsol_fixedpoint.h>
#include <sunnonlinsol/sunnonlinsol_newton.h>

#include <Eigen/Core>
#include <exception>
#include <fmt/format.h>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>

namespace costate::sundials {

struct Deleter {
  void operator()(SUNContext context) const { SUNContext_Free(&context); }
  void operator()(N_Vector v) const { N_VDestroy(v); }
  void operator()(SUNMatrix m) const { SUNMatDestroy(m); }
  void operator()(SUNLinearSolver s) const { SUNLinSolFree(s); }
  void operator()(SUNNonlinearSolver s) const { SUNNonlinSolFree(s); }
};
template <class Handle>
using Owned = std::unique_ptr<std::remove_pointer_t<Handle>, Deleter>;

using Context = Owned<SUNContext>;
using Vector = Owned<N_Vector>;
using Matrix = Owned<SUNMatrix>;
using LinearSolver = Owned<SUNLinearSolver>;
using NonlinearSolver = Owned<SUNNonlinearSolver>;

inline Context make_context() {
  SUNContext context = nullptr;
  if (SUNContext_Create(nullptr, &context) != 0) throw InternalError("SUNContext_Create failed");
  return Context(context);
}

/// A handle that creation must not have left empty.
template <class Handle>
Owned<Handle> owned(Handle handle, const char* call) {
  if (handle == nullptr) throw InternalError(fmt::format("{} returned no object", call));
  return Owned<Handle>(handle);
}

/// Set-up calls can only fail through a mistake of ours.
inline void check(int flag, const char* call) {
  if (flag < 0) throw InternalError(fmt::format("{} failed with flag {}", call, flag));
}

inline Eigen::Map<Eigen::VectorXd> view(N_Vector v) { return {N_VGetArrayPointer(v), NV_LENGTH_S(v)}; }

/// Keeps what a callback threw while C code unwinds by return codes, and throws it again on the other side.
class ExceptionGate {
 public:
  /// Runs `body` (bool: did it succeed?) inside a callback: 0 success, 1 recoverable failure, −1 an exception that is kept.
  /// Once one is kept every call fails: some solvers take −1 for a reason to retry.
  template <class Body>
  int guarded(Body&& body) noexcept {
    if (exception_) return -1;
    try {
      return body() ? 0 : 1;
    } catch (const LeftDomain& failure) {
      reason_ = failure.what();
      return 1;
    } catch (...) {
      exception_ = std::current_exception();
      return -1;
    }
  }
  void rethrow() {
    if (exception_) std::rethrow_exception(std::exchange(exception_, nullptr));
  }
  /// Message of the last recoverable failure.
  [[nodiscard]] const std::string& reason() const { return reason_; }
  void clear() {
    exception_ = nullptr;
    reason_.clear();
  }

 private:
  std::exception_ptr exception_;
  std::string reason_;
};

/// Error handler that keeps the library's last message in a std::string instead of printing it.
inline void keep_message(int, const char*, const char*, char* message, void* text) noexcept {
  try {
    *static_cast<std::string*>(text) = message;
  } catch (...) {
    // Out of memory for an explanation: the flag still tells what failed.
  }
}

}  // namespace costate::sundials
