#include "hunt.hpp"

#include "damped.hpp"

#include <costate/error.hpp>

#include <Eigen/LU>
#include <algorithm>

namespace costate {

Hunt::Hunt(Shooting& shooting, const HuntOptions& options)
    : shooting_(shooting), options_(options), before_(shooting.statistics()) {
  shooting_.set_mesh({});
  scales_ = shooting_.unknown_scales();
}

Hunt::Outcome Hunt::follow(const Eigen::VectorXd& start) {
  shooting_.set_mesh({});
  shooting_.set_flow_options({.tolerance = {.relative = options_.tolerance, .absolute = options_.tolerance},
                              .method = options_.solve.method,
                              .max_steps = std::min(options_.max_steps, options_.solve.max_steps)});
  Eigen::VectorXd y = start;
  const DampedResult result = damped_newton(shooting_, y, {.max_iterations = options_.solve.max_iterations});
  iterations_ += result.iterations;
  if (!result.converged) return {.reason = result.blocked ? "an arc cannot be integrated" : result.message};
  const int side = orientation(y);
  for (std::size_t i = 0; i < roots_.size(); ++i) {
    if (near(y, side, roots_[i])) return met(i);
  }
  Solution solution = solve(shooting_, y, options_.solve);
  iterations_ += solution.cost.newton_iterations;
  if (solution.status == Solution::Status::failed) {
    solution.y = y;  // where the loose integration sees a root: the next start that arrives there is not followed further
  } else {
    for (std::size_t i = 0; i < roots_.size(); ++i) {
      if (same(solution, roots_[i].solution)) return met(i);
    }
  }
  roots_.push_back({std::move(solution), side});
  return {.root = std::ssize(roots_) - 1, .fresh = true};
}

Hunt::Outcome Hunt::met(std::size_t place) {
  ++roots_[place].hits;
  return {.root = static_cast<std::ptrdiff_t>(place)};
}

/// Sign of det J, 0 where it is not defined. Two roots that merge in a fold have opposite ones.
int Hunt::orientation(const Eigen::VectorXd& y) {
  try {
    const Eigen::MatrixXd jacobian = shooting_.jacobian(shooting_.evaluate(y));
    const Eigen::PartialPivLU<Eigen::MatrixXd> factors(shooting_.row_scales().cwiseInverse().asDiagonal() * jacobian *
                                                       scales_.asDiagonal());
    // The sign alone: a product of pivots could overflow.
    int sign = static_cast<int>(factors.permutationP().determinant());
    for (const double pivot : factors.matrixLU().diagonal()) sign *= pivot > 0.0 ? 1 : pivot < 0.0 ? -1 : 0;
    return sign;
  } catch (const LeftDomain&) {
    return 0;
  }
}

bool Hunt::near(const Eigen::VectorXd& y, int orientation, const Root& root) const {
  if (orientation != root.orientation) return false;
  const Eigen::VectorXd& other = root.solution.y;
  for (Eigen::Index i = 0; i < y.size(); ++i) {
    if (!(std::abs(y[i] - other[i]) <= options_.same * std::max(scales_[i], std::abs(other[i])))) return false;
  }
  return true;
}

bool Hunt::same(const Solution& a, const Solution& b) {
  if (b.status == Solution::Status::failed) return false;
  for (std::size_t i = 0; i < a.unknowns.size(); ++i) {
    const double bound = a.unknowns[i].error_bound + b.unknowns[i].error_bound;
    if (!(std::abs(a.unknowns[i].value - b.unknowns[i].value) <= bound)) return false;
  }
  return true;
}

Cost Hunt::cost() const {
  const Statistics now = shooting_.statistics();
  return {.seconds = thread_seconds() - began_,
          .steps = now.steps - before_.steps,
          .rhs_evaluations = now.rhs_evaluations - before_.rhs_evaluations,
          .sensitivity_evaluations = now.sensitivity_evaluations - before_.sensitivity_evaluations,
          .newton_iterations = iterations_};
}

}  // namespace costate
