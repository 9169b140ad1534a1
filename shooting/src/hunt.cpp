#include "hunt.hpp"

#include "attempt.hpp"

#include <algorithm>

namespace costate {

namespace {

/// The shooting with its arcs whole, whatever was solved with it before: starts are of the problem's own unknowns alone.
Shooting& whole(Shooting& shooting) {
  shooting.set_mesh({});
  return shooting;
}

}  // namespace

Hunt::Hunt(Shooting& shooting, const HuntOptions& options)
    : shooting_(whole(shooting)),
      options_(options),
      system_(shooting),
      bounds_(Bounds::of(shooting)),
      scales_(shooting.unknown_scales()),
      before_(shooting.statistics()) {}

Hunt::Outcome Hunt::follow(const Eigen::VectorXd& start) {
  whole(shooting_).set_flow_options({.tolerance = {.relative = options_.tolerance, .absolute = options_.tolerance},
                                     .method = options_.solve.method,
                                     .max_steps = std::min(options_.max_steps, options_.solve.max_steps)});
  Eigen::VectorXd y = start;
  const NewtonResult result = natural_newton(system_, y, scales_, bounds_,
                                             {.residual_tolerance = 10.0 * options_.tolerance,
                                              .max_iterations = options_.solve.max_iterations});
  iterations_ += result.iterations;
  if (!result.converged() && result.termination != Termination::small_step) return {.termination = result.termination};
  const int orientation = system_.orientation(y);
  for (std::size_t i = 0; i < roots_.size(); ++i) {
    if (near(y, orientation, roots_[i])) return met(i);
  }
  Solution solution = attempt(shooting_, {y, {}}, options_.solve);
  iterations_ += solution.cost.newton_iterations;
  if (solution.status == Solution::Status::failed) {
    solution.y = y;  // where the loose integration sees a root: the next start that arrives there is not followed further
  } else {
    for (std::size_t i = 0; i < roots_.size(); ++i) {
      if (same(solution, roots_[i].solution)) return met(i);
    }
  }
  roots_.push_back({std::move(solution), orientation});
  return {.root = std::ssize(roots_) - 1, .fresh = true};
}

Hunt::Outcome Hunt::met(std::size_t place) {
  ++roots_[place].hits;
  return {.root = static_cast<std::ptrdiff_t>(place)};
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
