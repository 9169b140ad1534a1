#include "bare_cvode.hpp"

#include "corrector.hpp"

#include <algorithm>
#include <stdexcept>
#include <vector>

namespace costate::bench {

struct BareCvode::Memory {
  VariationalRates function;
  const void* data;
  double relative = 0.0;
  std::vector<double> absolute;
  long evaluations = 0;
  sundials::Context context = sundials::make_context();
  sundials::Vector y;
  sundials::NonlinearSolver solver;
  void* cvode = nullptr;

  static int rates(double t, N_Vector y, N_Vector dy, void* memory) {
    auto& m = *static_cast<Memory*>(memory);
    ++m.evaluations;
    return m.function(t, N_VGetArrayPointer(y), N_VGetArrayPointer(dy), m.data) ? 0 : 1;
  }
  static int weights(N_Vector y, N_Vector w, void* memory) {
    const auto& m = *static_cast<Memory*>(memory);
    return sundials::set_weights(y, m.relative, m.absolute.data(), w) ? 0 : -1;
  }

  Memory(VariationalRates rates_function, const void* rates_data, int rows, int directions)
      : function(rates_function),
        data(rates_data),
        absolute(static_cast<std::size_t>(1 + directions)),
        y(sundials::make_vector(rows, 1 + directions, context.get())) {
    using sundials::check;
    cvode = CVodeCreate(CV_ADAMS, context.get());
    check(CVodeInit(cvode, rates, 0.0, y.get()), "CVodeInit");
    check(CVodeSetUserData(cvode, this), "CVodeSetUserData");
    check(CVodeWFtolerances(cvode, weights), "CVodeWFtolerances");
    solver = sundials::make_fixed_point(rates, context.get());
    check(CVodeSetNonlinearSolver(cvode, solver.get()), "CVodeSetNonlinearSolver");
    check(CVodeSetMaxNumSteps(cvode, 20000), "CVodeSetMaxNumSteps");
  }
  Memory(const Memory&) = delete;
  Memory& operator=(const Memory&) = delete;
  ~Memory() { CVodeFree(&cvode); }
};

BareCvode::BareCvode(VariationalRates rates, const void* data, int rows, int directions)
    : memory_(std::make_unique<Memory>(rates, data, rows, directions)) {}
BareCvode::~BareCvode() = default;

void BareCvode::integrate(double t0, double t1, std::span<double> y, double relative, double absolute) {
  Memory& m = *memory_;
  m.relative = relative;
  std::fill(m.absolute.begin(), m.absolute.end(), absolute);
  m.evaluations = 0;
  double* numbers = N_VGetArrayPointer(m.y.get());
  std::copy(y.begin(), y.end(), numbers);
  double t = t0;
  if (CVodeReInit(m.cvode, t0, m.y.get()) < 0 || CVodeSetStopTime(m.cvode, t1) < 0 ||
      CVode(m.cvode, t1, m.y.get(), &t, CV_NORMAL) < 0) {
    throw std::runtime_error("CVODE failed");
  }
  std::copy_n(numbers, y.size(), y.begin());
}

long BareCvode::steps() const {
  long steps = 0;
  sundials::check(CVodeGetNumSteps(memory_->cvode, &steps), "CVodeGetNumSteps");
  return steps;
}

long BareCvode::evaluations() const { return memory_->evaluations; }

}  // namespace costate::bench
