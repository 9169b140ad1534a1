#include "coulomb_scene.hpp"

#include <costate/error.hpp>
#include <costate/models/cycloid.hpp>

#include <cmath>
#include <fmt/format.h>
#include <limits>

namespace costate::coulomb {

namespace {

using tools::Outcome;

/// A drop this small against the span is lost in the rounding of what it is computed from.
void check_flatness(const Scene& scene) {
  const double least = 1e-15 * scene.span;
  if (!(scene.drop > 0.0 && scene.drop < least)) return;
  throw BadInput(
      fmt::format("drop = {:g} m is not admissible: above 0 it must be at least 1e-15 span = {:g} m", scene.drop, least));
}

/// Along every wire the bead arrives with v²/2 ≤ g (H − μL).
Outcome out_of_reach(const Scene& scene) {
  Outcome outcome;
  outcome.status = Outcome::Status::infeasible;
  outcome.limits = {{"mu_max", "1", largest_friction(scene)}};
  outcome.message =
      scene.drop > 0.0
          ? fmt::format(
                "mu = {:.12g} is too much friction: a bead from rest reaches drop = {:g} m, span = {:g} m only for "
                "mu below mu_max = H/L = {:.12g}",
                scene.friction, scene.drop, scene.span, largest_friction(scene))
          : fmt::format(
                "drop = {:g} m is out of reach: from rest the bead arrives only where mu is below mu_max = H/L = "
                "{:.12g}, so the drop must be above mu L = {:.12g} m",
                scene.drop, largest_friction(scene), scene.friction * scene.span);
  return outcome;
}

Outcome frictionless(const Scene& scene) {
  const Cycloid found = cycloid(scene.span, -scene.drop, 0.0, scene.gravity).value();
  Outcome outcome;
  outcome.limits = {{"mu_max", "1", largest_friction(scene)}};
  // Tens of units in the last place, of the size of the terms each number is a sum of.
  const auto quantity = [](const char* name, const char* unit, double value, double size) {
    return Quantity{name, unit, value, 32.0 * std::numeric_limits<double>::epsilon() * size};
  };
  const double lambda = std::hypot(found.lambda_x, found.lambda_y);
  const double end_speed = std::sqrt(2.0 * scene.gravity * scene.drop);
  tools::ClosedForm form{"cycloid",
                         {quantity("final_time", "s", found.final_time, found.final_time),
                          quantity("lambda_x", "s/m", found.lambda_x, lambda),
                          quantity("lambda_y", "s/m", -found.lambda_y, lambda),
                          quantity("lambda_v0", "s^2/m", 1.0 / scene.gravity, 1.0 / scene.gravity),
                          quantity("alpha0", "rad", -found.theta1(), 1.0), quantity("alphaF", "rad", -found.theta2(), 1.0),
                          quantity("end_speed", "m/s", end_speed, end_speed)},
                         {{{"t", "s"},
                           {"x", "m"},
                           {"y", "m"},
                           {"v", "m/s"},
                           {"alpha", "rad"},
                           {"lambda_x", "s/m"},
                           {"lambda_y", "s/m"},
                           {"lambda_v", "s^2/m"},
                           {"normal", "m/s^2"}},
                          {}}};
  constexpr int cells = 200;
  for (int i = 0; i <= cells; ++i) {
    const double t = found.final_time * i / cells;
    const Cycloid::Point p = found.at(t);
    // N/m = g cos α + v g λx, and cos α = λx v.
    form.trajectory.rows.push_back({t, p.x, -p.y, p.v, -p.theta, found.lambda_x, -found.lambda_y, p.lambda_v,
                                    2.0 * scene.gravity * found.lambda_x * p.v});
  }
  outcome.closed_form = std::move(form);
  outcome.status = Outcome::Status::solved;
  return outcome;
}

std::string why_not(Curve curve, const Scene& scene, const Descent& descent) {
  if (descent.end == Descent::End::stops) {
    return fmt::format(
        "along the {} the bead stops at x = {:.9g} m, y = {:.9g} m: with mu = {:.12g} it does not arrive, only with mu "
        "below mu_finish = {:.12g}",
        name_of(curve), descent.stop_x, descent.stop_y, scene.friction, descent.limit);
  }
  return fmt::format(
      "there is no curve of the family {} through both points for mu = {:.12g}: mu must be below mu_finish = {:.12g}",
      name_of(curve), scene.friction, descent.limit);
}

/// The rows are nearly linear in the unknowns wherever the root is, so whole Newton steps are right, and may be long.
Solution solve_shooting(const Scene& scene, SolveOptions options) {
  options.max_step = 100.0;
  return solve(make_problem(scene), Eigen::Vector2d::Zero(), options);
}

}  // namespace

std::optional<tools::BranchStart> branch_start(const Scene& scene) {
  const Solution solution = solve_shooting(scene, {});
  if (!solution.solved()) return std::nullopt;
  return tools::BranchStart{solution.problem, solution.parameters, solution.y};
}

Outcome solve_scene(const Scene& scene, const SolveOptions& options) {
  const double began = thread_seconds();
  check_flatness(scene);
  Outcome outcome;
  if (!(scene.friction < largest_friction(scene))) {
    outcome = out_of_reach(scene);
  } else if (scene.friction == 0.0) {
    outcome = frictionless(scene);
  } else {
    outcome.limits = {{"mu_max", "1", largest_friction(scene)}};
    outcome.solution = solve_shooting(scene, options);
    outcome.cost = outcome.solution.cost;
    outcome.message = outcome.solution.message;
    outcome.status = outcome.solution.solved() ? Outcome::Status::solved : Outcome::Status::failed;
  }
  outcome.cost.seconds = thread_seconds() - began;
  return outcome;
}

Outcome solve_curve(Curve curve, const Scene& scene, double epsilon, bool with_trajectory) {
  const double began = thread_seconds();
  check_flatness(scene);
  if (!(scene.drop > 0.0)) return out_of_reach(scene);
  Outcome outcome;
  const Descent descent = descend(curve, scene, epsilon);
  outcome.limits = {{"mu_max", "1", largest_friction(scene)}, {"mu_finish", "1", descent.limit}};
  if (descent.end != Descent::End::arrives) {
    outcome.status = Outcome::Status::infeasible;
    outcome.message = why_not(curve, scene, descent);
  } else {
    tools::ClosedForm form{name_of(curve),
                           {{"final_time", "s", descent.final_time, descent.time_bound},
                            {"alpha0", "rad", descent.alpha0, descent.angle_bound},
                            {"alphaF", "rad", descent.alphaF, descent.angle_bound},
                            {"end_speed", "m/s", descent.end_speed, descent.speed_bound}},
                           {{{"t", "s"}, {"x", "m"}, {"y", "m"}, {"v", "m/s"}, {"alpha", "rad"}}, {}},
                           "by quadrature along a given curve"};
    if (curve == Curve::kurilin) {
      const Kurilin best = kurilin(scene).value();
      form.quantities.push_back({"C", "m", best.C, best.relative_bound * best.C});
    }
    if (with_trajectory) {
      for (const DescentPoint& p : descent_points(curve, scene, epsilon)) {
        form.trajectory.rows.push_back({p.t, p.x, p.y, p.v, p.alpha});
      }
    }
    outcome.closed_form = std::move(form);
    outcome.status = Outcome::Status::solved;
  }
  outcome.cost.seconds = thread_seconds() - began;
  return outcome;
}

std::vector<Compared> compare(const Scene& scene, double epsilon, const SolveOptions& options) {
  std::vector<Compared> all{{"optimal", solve_scene(scene, options)}};
  for (const Curve curve : curves) all.push_back({name_of(curve), solve_curve(curve, scene, epsilon)});
  return all;
}

}  // namespace costate::coulomb
