#include "normal_scene.hpp"

#include "bead/cycloid_outcome.hpp"

#include <costate/models/tilted_cycloid.hpp>
#include <costate/shooting/continuation.hpp>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace costate::normal_friction {

namespace {

using tools::Outcome;

/// A problem in closed form and the straight path from it to the scene: where the last parameters are those of the scene.
struct Way {
  std::string name;
  Scene from;
  double nonlinearity;
  std::vector<std::vector<double>> stops;
};

std::optional<TiltedCycloid> start_of(const Way& way) {
  const Push<double> push = push_of(way.from, way.nonlinearity);
  return tilted_cycloid(way.from.x, way.from.y, way.from.speed, push.x, push.y);
}

std::vector<Way> ways_to(const Scene& scene) {
  std::vector<Way> ways{{"tangent friction", scene, 0.0, {parameters(scene)}}};
  Scene linear = scene;
  linear.beta = 0.0;
  ways.push_back({"linear friction", linear, 1.0, {parameters(scene)}});
  // Fast enough for the straight chord, whatever the friction there.
  Scene fast = scene;
  const double chord = std::hypot(scene.x, scene.y), cosine = scene.x / chord;
  const double N = scene.gravity * cosine;
  const double along = N * (scene.beta * N * N - scene.mu) - scene.gravity * scene.y / chord;
  fast.speed = std::sqrt(scene.speed * scene.speed + 4.0 * std::max(0.0, -along) * chord);
  ways.push_back({"faster start", fast, 0.0, {parameters(fast), parameters(scene)}});
  return ways;
}

Solution travel(const Way& way, const SolveOptions& options, Cost& cost) {
  Solution failed;
  const std::optional<TiltedCycloid> start = start_of(way);
  if (!start) {
    failed.message = "no energy for the start of the way";
    return failed;
  }
  Shooting shooting(make_problem(way.from, start->mirrored ? Side::right : Side::left));
  shooting.set_parameters(parameters(way.from, way.nonlinearity));
  Eigen::VectorXd y = Eigen::Vector2d(start->theta2(), std::log(std::abs(start->turn())));
  for (const std::vector<double>& stop : way.stops) {
    const Followed path = follow(shooting, y, stop, {.max_points = 200, .max_integration_steps = 50000});
    cost.newton_iterations += path.newton_iterations;
    if (!path.reached) {
      cost.add(shooting.statistics());
      failed.message = path.message;
      return failed;
    }
    y = path.y;
  }
  Solution solution = solve(shooting, y, options);
  cost.newton_iterations += solution.cost.newton_iterations;
  cost.add(shooting.statistics());
  return solution;
}

double least_normal_force(const Scene& scene, double theta1, double theta2) {
  return scene.gravity * std::min(std::cos(theta1), std::cos(theta2));
}

Outcome closed_form(const Scene& scene) {
  if (scene.mu == 0.0) return bead::cycloid_outcome(scene.x, scene.y, scene.speed, scene.gravity);
  Outcome outcome;
  const std::optional<TiltedCycloid> found =
      tilted_cycloid(scene.x, scene.y, scene.speed, -scene.mu * scene.gravity, -scene.gravity);
  if (!found) {
    outcome.message = "the end lies along the tilted field of gravity and friction exactly; try another y";
    return outcome;
  }
  const auto quantity = [](const char* name, const char* unit, double value, double size) {
    return Quantity{name, unit, value, 64.0 * std::numeric_limits<double>::epsilon() * size};
  };
  const Cycloid& cycloid = found->cycloid;
  const double lambda = std::hypot(cycloid.lambda_x, cycloid.lambda_y), lambda_v = cycloid.at(0.0).lambda_v;
  tools::ClosedForm form{"cycloid",
                         {quantity("final_time", "s", cycloid.final_time, cycloid.final_time),
                          quantity("lambda_x", "s/m", found->lambda_x(), lambda),
                          quantity("lambda_y", "s/m", found->lambda_y(), lambda),
                          quantity("lambda_v0", "s^2/m", lambda_v, lambda_v),
                          quantity("theta1", "rad", found->theta1(), 1.0),
                          quantity("theta2", "rad", found->theta2(), 1.0),
                          quantity("v_f", "m/s", 1.0 / lambda, 1.0 / lambda)},
                         {{{"t", "s"}, {"x", "m"}, {"y", "m"}, {"v", "m/s"}, {"theta", "rad"}, {"lambda_x", "s/m"},
                           {"lambda_y", "s/m"}, {"lambda_v", "s^2/m"}, {"N", "m/s^2"}},
                          {}}};
  constexpr int cells = 200;
  for (int i = 0; i <= cells; ++i) {
    const double t = cycloid.final_time * i / cells;
    const Cycloid::Point p = found->at(t);
    form.trajectory.rows.push_back({t, p.x, p.y, p.v, p.theta, found->lambda_x(), found->lambda_y(), p.lambda_v,
                                    scene.gravity * std::cos(p.theta)});
  }
  outcome.closed_form = std::move(form);
  outcome.status = Outcome::Status::solved;
  return outcome;
}

}  // namespace

Outcome solve_scene(const Scene& scene, const SolveOptions& options) {
  const double began = thread_seconds();
  Outcome outcome;
  const double loss = scene.mu - std::max(scene.beta, 0.0) * scene.gravity * scene.gravity;
  const double y_max = scene.speed * scene.speed / (2.0 * scene.gravity) - loss * scene.x;
  if (scene.y >= y_max) {
    outcome.status = Outcome::Status::infeasible;
    outcome.message = fmt::format("y = {:g} m is out of reach: with speed = {:g} m/s, friction mu = {:g}, beta = {:g} s^4/m^2 and N "
                                  ">= 0 the bead cannot rise to y_max = {:.12g} m at x = {:g} m",
                                  scene.y, scene.speed, scene.mu, scene.beta, y_max, scene.x);
  } else if (scene.beta == 0.0) {
    outcome = closed_form(scene);
  } else {
    for (const Way& way : ways_to(scene)) {
      Solution found = travel(way, options, outcome.cost);
      if (found.solved()) {
        outcome.solution = std::move(found);
        outcome.status = Outcome::Status::solved;
        outcome.message.clear();
        break;
      }
      outcome.message += fmt::format("{}{}: {}", outcome.message.empty() ? "" : "; ", way.name, found.message);
    }
  }
  outcome.limits = {{"y_max", "m", y_max}};
  if (outcome.solved()) {
    outcome.limits.push_back(
        {"N_min", "m/s^2", least_normal_force(scene, outcome["theta1"].value, outcome["theta2"].value)});
  } else {
    outcome.limits.push_back({"N_min", "m/s^2", std::nullopt});
  }
  outcome.cost.seconds = thread_seconds() - began;
  return outcome;
}

}  // namespace costate::normal_friction
