/// \file
/// Solvers of the implicit equation of a step of CVODES, y − γ f(t, y) = …, on vectors of our own. Private to lib.
#pragma once

#include "vector.hpp"

#include <Eigen/LU>

namespace costate::sundials {

/// Fixed-point iteration as SUNNonlinSol_FixedPoint does it without acceleration, with CVODES' test of convergence, but with one pass
/// over the vectors in an iteration instead of six calls of vector operations.
///
/// It calls `rates` itself, with the user data of CVODES, so CVodeGetNumRhsEvals does not count those calls.
[[nodiscard]] NonlinearSolver make_fixed_point(CVRhsFn rates, SUNContext context);

/// M = I − γ f_z with its factors, for Newton's method. To CVODES it is an opaque matrix with a direct solver.
///
/// A vector holds rows of z and of w, each number followed by derivatives (see make_vector). M is applied to every column of z, so
/// an augmented system is solved with one factorisation of size n, as CVODES does it for forward sensitivities: what f_z changes by
/// within a step is left to the iteration. So are the rows of w': on them M is the identity, which only makes w explicit and costs no
/// stability, because nothing depends on w.
class NewtonMatrix {
 public:
  NewtonMatrix(int states, int rows, SUNContext context);
  NewtonMatrix(const NewtonMatrix&) = delete;
  NewtonMatrix& operator=(const NewtonMatrix&) = delete;

  [[nodiscard]] SUNMatrix matrix() const { return matrix_.get(); }
  [[nodiscard]] SUNLinearSolver solver() const { return solver_.get(); }
  /// f_z, to be filled in before `factorise`.
  [[nodiscard]] Eigen::MatrixXd& jacobian() { return jacobian_; }
  /// Returns false where M is singular.
  bool factorise(double gamma);

 private:
  static int solve(SUNLinearSolver solver, SUNMatrix, N_Vector x, N_Vector b, realtype);

  int rows_;
  Eigen::MatrixXd jacobian_, newton_;
  Eigen::PartialPivLU<Eigen::MatrixXd> factors_;
  Matrix matrix_;
  LinearSolver solver_;
};

}  // namespace costate::sundials
