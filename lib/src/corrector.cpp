#include "corrector.hpp"

#include <algorithm>
#include <new>

namespace costate::sundials {

namespace {

// As in CVODES: at most three iterations; the rate of convergence is forgotten by a factor of 0.3 an iteration; a correction twice
// the last one means divergence.
constexpr int most_iterations = 3;
constexpr double rate_memory = 0.3, divergence = 2.0;

struct FixedPoint {
  CVRhsFn rates;
  SUNNonlinSolSysFn of_cvodes = nullptr;
  long iterations = 0;
};
FixedPoint& content(SUNNonlinearSolver solver) { return *static_cast<FixedPoint*>(solver->content); }

/// c becomes γf − r z₁; f becomes what c has changed by.
void correct(double gamma, double* f, double r, const double* z1, double* c, sunindextype size) {
#pragma GCC ivdep
  for (sunindextype i = 0; i < size; ++i) {
    const double corrected = gamma * f[i] - r * z1[i];
    f[i] = corrected - c[i];
    c[i] = corrected;
  }
}

/// c = γ f(t, z₀ + c) − r z₁, from c = 0, until what c changes by is below the tolerance in the weighted norm.
int iterate(SUNNonlinearSolver solver, N_Vector, N_Vector correction, N_Vector weights, realtype tolerance, booleantype,
            void* cvodes) {
  FixedPoint& own = content(solver);
  double t = 0.0, gamma = 0.0, r = 0.0;
  N_Vector predicted = nullptr, y = nullptr, f = nullptr, z1 = nullptr;
  void* data = nullptr;
  if (CVodeGetNonlinearSystemData(cvodes, &t, &predicted, &y, &f, &gamma, &r, &z1, &data) != CV_SUCCESS) return -1;
  double last = 0.0, rate = 1.0;
  for (own.iterations = 1; own.iterations <= most_iterations; ++own.iterations) {
    const bool first = own.iterations == 1;
    if (!first) N_VLinearSum(1.0, predicted, 1.0, correction, y);
    // The flag by which CVODES knows a failed right-hand side is private. Its own function finds the failure again and returns it.
    if (own.rates(t, first ? predicted : y, f, data) != 0) {
      const int flag = own.of_cvodes(correction, f, cvodes);
      return flag != 0 ? flag : SUN_NLS_CONV_RECVR;
    }
    correct(gamma, N_VGetArrayPointer(f), r, N_VGetArrayPointer(z1), N_VGetArrayPointer(correction), N_VGetLength(f));
    const double change = N_VWrmsNorm(f, weights);
    if (!first) rate = std::max(rate_memory * rate, change / last);
    if (change * std::min(1.0, rate) <= tolerance) return SUN_NLS_SUCCESS;
    if (!first && change > divergence * last) break;
    last = change;
  }
  return SUN_NLS_CONV_RECVR;
}

}  // namespace

NonlinearSolver make_fixed_point(CVRhsFn rates, SUNContext context) {
  NonlinearSolver solver = owned(SUNNonlinSolNewEmpty(context), "SUNNonlinSolNewEmpty");
  auto& ops = *solver->ops;
  ops.free = [](SUNNonlinearSolver s) {
    delete static_cast<FixedPoint*>(s->content);
    s->content = nullptr;
    SUNNonlinSolFreeEmpty(s);
    return 0;
  };
  solver->content = new FixedPoint{rates};
  ops.gettype = [](SUNNonlinearSolver) { return SUNNONLINEARSOLVER_FIXEDPOINT; };
  ops.setsysfn = [](SUNNonlinearSolver s, SUNNonlinSolSysFn function) {
    content(s).of_cvodes = function;
    return 0;
  };
  ops.getnumiters = [](SUNNonlinearSolver s, long* iterations) {
    *iterations = content(s).iterations;
    return 0;
  };
  ops.solve = iterate;
  return solver;
}

NewtonMatrix::NewtonMatrix(int states, int rows, SUNContext context)
    : rows_(rows),
      jacobian_(states, states),
      newton_(states, states),
      factors_(states),
      matrix_(owned(SUNMatNewEmpty(context), "SUNMatNewEmpty")),
      solver_(owned(SUNLinSolNewEmpty(context), "SUNLinSolNewEmpty")) {
  matrix_->ops->getid = [](SUNMatrix) { return SUNMATRIX_CUSTOM; };
  solver_->content = this;
  auto& ops = *solver_->ops;
  ops.gettype = [](SUNLinearSolver) { return SUNLINEARSOLVER_DIRECT; };
  ops.setup = [](SUNLinearSolver, SUNMatrix) { return 0; };
  ops.solve = solve;
  ops.free = [](SUNLinearSolver s) {
    SUNLinSolFreeEmpty(s);
    return 0;
  };
}

bool NewtonMatrix::factorise(double gamma) {
  newton_.setIdentity();
  newton_ -= gamma * jacobian_;
  factors_.compute(newton_);
  return (factors_.matrixLU().diagonal().array() != 0.0).all();
}

int NewtonMatrix::solve(SUNLinearSolver solver, SUNMatrix, N_Vector x, N_Vector b, realtype) {
  const NewtonMatrix& own = *static_cast<NewtonMatrix*>(solver->content);
  const Eigen::Index states = own.jacobian_.rows(), columns = N_VGetLength(x) / own.rows_;
  N_VScale(1.0, b, x);
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const Eigen::Map<const Rows> right(N_VGetArrayPointer(b), states, columns);
  Eigen::Map<Rows>(N_VGetArrayPointer(x), states, columns).noalias() = own.factors_.solve(right);
  return 0;
}

}  // namespace costate::sundials
