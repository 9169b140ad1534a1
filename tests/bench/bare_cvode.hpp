/// \file
/// CVODE driven by hand: what an integration costs without the library's flows around it.
///
/// The yardstick for Flow::advance with Method::adams: the same method, options, error control and vector operations, and no more
/// calls than they need. It fails by throwing and explains nothing.
#pragma once

#include <memory>
#include <span>

namespace costate::bench {

/// The right-hand side of a variational system as a plain function: y' = f(t, y) for numbers that are each followed by their
/// derivatives (see Field::variation). Returns false where it is not finite.
using VariationalRates = bool (*)(double t, const double* y, double* dy, const void* data);

/// Adams–Moulton by CVODE for `rows` numbers, each followed by `directions` derivatives.
class BareCvode {
 public:
  BareCvode(VariationalRates rates, const void* data, int rows, int directions);
  ~BareCvode();
  BareCvode(const BareCvode&) = delete;
  BareCvode& operator=(const BareCvode&) = delete;

  /// y from t0 to t1 in place. The absolute tolerance of a direction is that of the state: initial directions are taken to be of
  /// size 1 at most. \throws std::runtime_error
  void integrate(double t0, double t1, std::span<double> y, double relative, double absolute);

  /// Of the last integration.
  [[nodiscard]] long steps() const;
  [[nodiscard]] long evaluations() const;

 private:
  struct Memory;
  std::unique_ptr<Memory> memory_;
};

}  // namespace costate::bench
