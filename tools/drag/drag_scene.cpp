#include "drag_scene.hpp"

#include "bead/cycloid_outcome.hpp"
#include "extremal_search.hpp"

#include <costate/error.hpp>
#include <costate/shooting/continuation.hpp>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace costate::drag {

namespace {

using tools::Outcome;

/// An extremal of a scene, solved, with its focal points.
struct Extremal {
  Solution solution;
  std::vector<double> focal;  ///< see focal_times
};

/// Solves scenes with friction.
class SceneSolver {
 public:
  SceneSolver(const Scene& scene, const SolveOptions& options, Cost& cost) : scene_(scene), options_(options), cost_(cost) {}

  /// All extremals that are found, solved and verified, fastest first.
  std::vector<Extremal> extremals() {
    std::vector<Extremal> all;
    for (const Guess& guess : find_extremals(scene_)) add(all, guess);
    return all;
  }

  /// Why the last extremal that was found could not be solved; empty if none failed.
  [[nodiscard]] const std::string& failure() const { return failure_; }

  void add(std::vector<Extremal>& all, const Guess& guess) {
    Solution found = solve(make_problem(scene_, guess), unknowns(guess), options_);
    cost_.steps += found.cost.steps;
    cost_.rhs_evaluations += found.cost.rhs_evaluations;
    cost_.sensitivity_evaluations += found.cost.sensitivity_evaluations;
    cost_.newton_iterations += found.cost.newton_iterations;
    if (!found.solved()) {
      failure_ = found.message;
      return;
    }
    for (const Extremal& other : all) {
      if (same(other.solution, found)) return;
    }
    std::vector<double> focal = focal_times(found);
    all.push_back({std::move(found), std::move(focal)});
    std::sort(all.begin(), all.end(), [](const Extremal& a, const Extremal& b) {
      return a.solution.final_time() < b.solution.final_time();
    });
  }

 private:
  /// Two families may describe one orbit. Their results agree then to what both claim, with a margin for the size of the numbers.
  static bool same(const Solution& a, const Solution& b) {
    for (const char* name : {"final_time", "theta1", "theta2"}) {
      const Quantity &left = a[name], &right = b[name];
      const double close = 1e-9 * std::max(1.0, std::abs(left.value)) + 10.0 * (left.error_bound + right.error_bound);
      if (std::abs(left.value - right.value) > close) return false;
    }
    return true;
  }

  const Scene& scene_;
  SolveOptions options_;
  Cost& cost_;
  std::string failure_;
};

/// Why an extremal is not the answer.
std::string objection(const Extremal& extremal) {
  if (extremal.focal.empty()) return "slower";
  const double T = extremal.solution.final_time();
  return fmt::format("focal point at t = {:.9g} s, {:.9g} s before the end: not a minimum", T - extremal.focal.front(),
                     extremal.focal.front());
}

/// Takes the fastest extremal without a focal point as the answer and lists the rest.
void deliver(std::vector<Extremal>& extremals, Outcome& outcome) {
  for (Extremal& extremal : extremals) {
    if (!outcome.solved() && extremal.focal.empty()) {
      outcome.solution = std::move(extremal.solution);
      outcome.status = Outcome::Status::solved;
    } else {
      extremal.solution.message = objection(extremal);
      outcome.other_extremals.push_back(std::move(extremal.solution));
    }
  }
}

/// Does friction resist at every speed up to v₀? Then y_max holds, for a bead that stays below v_c at least.
bool resists(const Scene& scene) { return scene.beta * scene.speed * scene.speed <= scene.mu; }

Outcome without_friction(const Scene& scene) {
  Outcome outcome = bead::cycloid_outcome(scene.x, scene.y, scene.speed, scene.gravity);
  if (!outcome.closed_form) return outcome;
  // λv = 0 at the end, where H = 0 is v_f |λ| = 1.
  const Quantity &x = outcome["lambda_x"], &y = outcome["lambda_y"];
  const double v = 1.0 / std::hypot(x.value, y.value);
  outcome.closed_form->quantities.push_back({"v_f", "m/s", v, v * v * (x.error_bound + y.error_bound)});
  return outcome;
}

}  // namespace

Outcome solve_scene(const Scene& scene, const SolveOptions& options) {
  if (scene.mu == 0.0 && scene.beta == 0.0) return without_friction(scene);
  const double began = thread_seconds();
  Outcome outcome;
  const auto finish = [&](Outcome::Status status, std::string message) {
    outcome.status = status;
    outcome.message = std::move(message);
    outcome.cost.seconds = thread_seconds() - began;
    return outcome;
  };

  if (resists(scene)) {
    const double height = greatest_height(scene);
    outcome.limits.push_back({"y_max", "m", height});
    if (scene.y >= height) {
      return finish(Outcome::Status::infeasible,
                    fmt::format("y = {:g} m is out of reach: with speed = {:g} m/s the bead cannot rise to y_max = {:.12g} m{}", scene.y,
                                scene.speed, height,
                                scene.beta > 0.0 ? " without diving to speeds at which friction is a thrust" : ""));
    }
  }
  SceneSolver solver(scene, options, outcome.cost);
  std::vector<Extremal> extremals = solver.extremals();
  deliver(extremals, outcome);
  if (outcome.solved()) return finish(Outcome::Status::solved, "");
  return finish(Outcome::Status::failed, solver.failure());
}

}  // namespace costate::drag
