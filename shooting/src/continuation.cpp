#include <costate/error.hpp>
#include <costate/shooting/continuation.hpp>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace costate {

namespace {

/// Integration noise, amplified along an unstable arc, can keep the residual above its tolerance when the unknowns are known
/// well enough: then the Newton correction is what counts.
bool solved(Shooting& shooting, const NewtonResult& result, const Eigen::VectorXd& y) {
  constexpr double small_correction = 1e-6;
  if (result.converged()) return true;
  if (result.termination != Termination::stalled && result.termination != Termination::small_step) return false;
  return shooting.correction(y) <= small_correction;
}

}  // namespace

Followed follow(Shooting& shooting, const Eigen::VectorXd& y, const std::vector<double>& target,
                const FollowOptions& options, const Monitor& monitor) {
  const std::vector<double> origin = shooting.parameters();
  if (target.size() != origin.size()) {
    throw BadInput(fmt::format("the target has {} parameter values, the problem {}", target.size(), origin.size()));
  }
  if (y.size() != shooting.size()) {
    throw BadInput(fmt::format("the start has {} values, the problem {} unknowns", y.size(), shooting.size()));
  }
  if (!y.allFinite() || !std::all_of(target.begin(), target.end(), [](double p) { return std::isfinite(p); })) {
    throw BadInput("the start or the target of a path has a value that is not a finite number");
  }
  const auto at = [&](double s) {
    std::vector<double> p(origin.size());
    for (std::size_t i = 0; i < p.size(); ++i) p[i] = s == 1.0 ? target[i] : std::lerp(origin[i], target[i], s);
    return p;
  };
  std::vector<double> path(origin.size());
  for (std::size_t i = 0; i < path.size(); ++i) path[i] = target[i] - origin[i];

  shooting.set_flow_options({.tolerance = {.relative = options.tolerance, .absolute = options.tolerance},
                             .method = options.method,
                             .max_steps = options.max_steps});
  Kinsol newton(shooting.size());
  const long steps_before = shooting.statistics().steps;
  const NewtonOptions newton_options{.residual_tolerance = 10.0 * options.tolerance,
                                     .max_step = std::sqrt(static_cast<double>(shooting.size())),
                                     .max_iterations = options.max_iterations};
  Followed result{.y = y, .parameters = origin};
  const NewtonResult begin =
      newton.solve(shooting, result.y, shooting.unknown_scales(), shooting.row_scales(), newton_options);
  result.newton_iterations += begin.iterations;
  if (!solved(shooting, begin, result.y)) {
    result.message = fmt::format("no solution at the start of the path: {}{}{}", describe(begin.termination),
                                 begin.message.empty() ? "" : ": ", begin.message);
    return result;
  }
  double step = options.first_step;
  while (result.fraction < 1.0) {
    const long steps = shooting.statistics().steps - steps_before;
    if (result.points >= options.max_points || steps >= options.max_integration_steps) {
      result.message = fmt::format("the path was given up {:.4g} of the way, after {} points and {} integration steps",
                                   result.fraction, result.points, steps);
      return result;
    }
    const double s = std::min(1.0, result.fraction + step);
    Eigen::VectorXd next = result.y;
    NewtonResult corrected;
    try {
      const Shot& shot = shooting.evaluate(result.y, path);
      next -= (s - result.fraction) * shooting.jacobian(shot).partialPivLu().solve(shooting.path_derivative(shot));
      shooting.set_parameters(at(s));
      if (next.allFinite()) {
        corrected = newton.solve(shooting, next, shooting.unknown_scales(), shooting.row_scales(), newton_options);
        result.newton_iterations += corrected.iterations;
        if (solved(shooting, corrected, next)) corrected.termination = Termination::converged;
      } else {
        corrected.termination = Termination::singular_jacobian;
      }
    } catch (const LeftDomain& failure) {
      corrected.termination = Termination::left_domain;
      corrected.message = failure.what();
    }
    if (!corrected.converged()) {
      shooting.set_parameters(at(result.fraction));
      step *= 0.5;
      if (step < options.smallest_step) {
        result.message = fmt::format("the path ends {:.6g} of the way: {}{}{}", result.fraction,
                                     describe(corrected.termination), corrected.message.empty() ? "" : ": ",
                                     corrected.message);
        return result;
      }
      continue;
    }
    result.fraction = s;
    result.y = next;
    result.parameters = at(s);
    ++result.points;
    if (monitor && monitor(result.y, result.parameters)) {
      result.stopped = true;
      return result;
    }
    if (corrected.iterations <= 3) step = std::min(2.0 * step, 1.0);
  }
  result.reached = true;
  return result;
}

}  // namespace costate
