#include "normal_scene.hpp"

#include "extremal_search.hpp"

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

/// Work on one scene: what it has cost, and what could not be done.
class Search {
 public:
  Search(const Scene& scene, const SolveOptions& options, Cost& cost) : scene_(scene), options_(options), cost_(&cost) {}

  /// The fastest extremal, or a solution that says why there is none; `others` are those that are slower.
  Solution run(std::vector<Solution>& others) {
    for (const Way& way : ways_to(scene_)) {
      Solution solution = travel(way);
      if (solution.solved()) {
        found_.push_back(std::move(solution));
        break;
      }
      failures_ += fmt::format("{}: {}; ", way.name, solution.message);
    }
    std::vector<RoughExtremal> refused;
    for (const RoughExtremal& rough : find_extremals(scene_)) {
      if (known(rough) || std::any_of(refused.begin(), refused.end(), [&](const auto& r) { return alike(r, rough); })) continue;
      Shooting shooting(make_problem(scene_, rough.structure));
      Solution solution = finish(shooting, rough.unknowns, {});
      if (solution.solved()) {
        found_.push_back(std::move(solution));
      } else {
        failures_ += fmt::format("about {:.4g} s with {} corners: {}; ", rough.time, rough.structure.size() - 1, solution.message);
        refused.push_back(rough);
      }
    }
    if (found_.empty()) return failed(failures_);
    std::sort(found_.begin(), found_.end(), [](const Solution& a, const Solution& b) { return a.final_time() < b.final_time(); });
    Solution best = std::move(found_.front());
    found_.erase(found_.begin());
    others = std::move(found_);
    return best;
  }

 private:
  static Solution failed(std::string message) {
    Solution solution;
    solution.message = std::move(message);
    return solution;
  }

  Solution travel(const Way& way) {
    const std::optional<TiltedCycloid> start = start_of(way);
    if (!start) return failed("no energy for the start of the way");
    Shooting shooting(make_problem(way.from, {{.turn = start->mirrored ? Side::right : Side::left}}));
    shooting.set_parameters(parameters(way.from, way.nonlinearity));
    const Eigen::VectorXd y = Eigen::Vector2d(start->theta2(), std::log(std::abs(start->turn())));
    return finish(shooting, y, way.stops);
  }

  /// Follows to the last stop and solves there. A solution without y: the path ended before.
  Solution finish(Shooting& shooting, Eigen::VectorXd y, const std::vector<std::vector<double>>& stops) {
    for (const std::vector<double>& stop : stops) {
      const Followed path = follow(shooting, y, stop, {.max_points = 200, .max_integration_steps = 50000});
      cost_->newton_iterations += path.newton_iterations;
      if (!path.reached) {
        cost_->add(shooting.statistics());
        return failed(path.message);
      }
      y = path.y;
    }
    Solution solution = solve(shooting, y, options_);
    cost_->newton_iterations += solution.cost.newton_iterations;
    cost_->add(shooting.statistics());
    return solution;
  }

  [[nodiscard]] bool known(const RoughExtremal& rough) const {
    return std::any_of(found_.begin(), found_.end(), [&](const Solution& s) {
      return s.y.size() == rough.unknowns.size() && std::abs(s.y[0] - rough.unknowns[0]) < 0.02 &&
             std::abs(s.final_time() / rough.time - 1.0) < 0.01;
    });
  }
  static bool alike(const RoughExtremal& a, const RoughExtremal& b) {
    return a.structure == b.structure && (a.unknowns - b.unknowns).cwiseAbs().maxCoeff() < 0.05;
  }

  Scene scene_;
  SolveOptions options_;
  Cost* cost_;
  std::vector<Solution> found_;
  std::string failures_;
};

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
    outcome.solution = Search(scene, options, outcome.cost).run(outcome.other_extremals);
    outcome.status = outcome.solution.solved() ? Outcome::Status::solved : Outcome::Status::failed;
    outcome.message = outcome.solution.message;
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
