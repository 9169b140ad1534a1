#include "linear_quadratic.hpp"

#include <Eigen/Cholesky>

namespace costate {

bool solve(const LinearQuadratic& problem, LinearQuadraticSolution& solution) {
  const std::size_t n = problem.stages.size();
  std::vector<Eigen::MatrixXd> p(n + 1), gain(n);
  std::vector<Eigen::VectorXd> slope(n + 1), push(n);
  p[n] = problem.end_hessian;
  slope[n] = problem.end_gradient;
  for (std::size_t i = n; i-- > 0;) {
    const LinearQuadratic::Stage& at = problem.stages[i];
    const Eigen::MatrixXd pa = p[i + 1] * at.a;
    const Eigen::VectorXd beyond = p[i + 1] * at.offset + slope[i + 1];
    const Eigen::MatrixXd mixed = at.s + at.b.transpose() * pa;
    const Eigen::VectorXd gradient = at.gradient_u + at.b.transpose() * beyond;
    const Eigen::LLT<Eigen::MatrixXd> factor(at.r + at.b.transpose() * p[i + 1] * at.b);
    if (factor.info() != Eigen::Success) return false;
    gain[i] = -factor.solve(mixed);
    push[i] = -factor.solve(gradient);
    const Eigen::MatrixXd next = at.q + at.a.transpose() * pa + mixed.transpose() * gain[i];
    p[i] = 0.5 * (next + next.transpose());
    slope[i] = at.gradient_x + at.a.transpose() * beyond + mixed.transpose() * push[i];
  }
  solution.x.resize(n + 1);
  solution.u.resize(n);
  solution.slope.resize(n + 1);
  solution.x[0].setZero(p[0].rows());
  if (problem.freedom.cols() > 0) {
    const Eigen::LLT<Eigen::MatrixXd> factor(problem.freedom.transpose() * p[0] * problem.freedom);
    if (factor.info() != Eigen::Success) return false;
    solution.x[0] = -problem.freedom * factor.solve(problem.freedom.transpose() * slope[0]);
  }
  for (std::size_t i = 0; i < n; ++i) {
    const LinearQuadratic::Stage& at = problem.stages[i];
    solution.slope[i] = p[i] * solution.x[i] + slope[i];
    solution.u[i] = gain[i] * solution.x[i] + push[i];
    solution.x[i + 1] = at.a * solution.x[i] + at.b * solution.u[i] + at.offset;
    if (!solution.x[i + 1].allFinite()) return false;
  }
  solution.slope[n] = p[n] * solution.x[n] + slope[n];
  return true;
}

}  // namespace costate
