#include "drag_scene.hpp"

#include "bead/cycloid_outcome.hpp"
#include "extremal_search.hpp"

#include <costate/error.hpp>
#include <costate/models/cycloid.hpp>
#include <costate/shooting/branch.hpp>

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
    cost_.add(found.cost);
    if (!found.solved()) {
      failure_ = found.message;
      return;
    }
    for (const Extremal& other : all) {
      if (same(other.solution, found)) return;
    }
    try {
      std::vector<double> focal = focal_times(found);
      all.push_back({std::move(found), std::move(focal)});
    } catch (const LeftDomain& failure) {
      failure_ = fmt::format("an extremal was found but not its focal points: {}", failure.what());
    }
    std::sort(all.begin(), all.end(),
              [](const Extremal& a, const Extremal& b) { return a.solution.final_time() < b.solution.final_time(); });
  }

 private:
  /// Two families may describe one orbit. Their results agree then to what both claim, with a margin for the size of the
  /// numbers.
  static bool same(const Solution& a, const Solution& b) {
    for (const char* name : {"final_time", "theta1", "theta2"}) {
      const Quantity &left = a[name], &right = b[name];
      const double close = 1e-9 * std::max(1.0, std::abs(left.value)) + 10.0 * (left.error_bound + right.error_bound);
      if (std::abs(left.value - right.value) > close) return false;
    }
    return true;
  }

  Scene scene_;
  SolveOptions options_;
  Cost& cost_;
  std::string failure_;
};

/// Why an extremal with focal points is no minimum.
std::string objection(double final_time, const std::vector<double>& focal) {
  return fmt::format("focal point at t = {:.9g} s, {:.9g} s before the end: not a minimum", final_time - focal.front(),
                     focal.front());
}

/// Takes the fastest extremal without a focal point as the answer and lists the rest.
void deliver(std::vector<Extremal>& extremals, Outcome& outcome) {
  for (Extremal& extremal : extremals) {
    if (!outcome.solved() && extremal.focal.empty()) {
      outcome.solution = std::move(extremal.solution);
      outcome.status = Outcome::Status::solved;
    } else {
      extremal.solution.message = extremal.focal.empty() ? "slower"
                                                         : objection(extremal.solution.final_time(), extremal.focal);
      outcome.other_extremals.push_back(std::move(extremal.solution));
    }
  }
}

/// Looks for the β at which the local minimum of a scene with soft friction ends.
class Fold {
 public:
  Fold(const Scene& scene, Method method, Cost& cost) : scene_(scene), method_(method), cost_(cost) {}

  /// The local minimum at the scene's own β, if it turns out to exist after all.
  [[nodiscard]] const std::optional<Guess>& survivor() const { return survivor_; }

  /// The β where it ends, by following it from a smaller β at which the search finds it; nothing if that is not to be had
  /// or the path does not end by meeting another extremal.
  std::optional<double> find() {
    double beta = scene_.beta;
    for (int i = 0; i < 10; ++i) {
      beta *= 0.4;
      if (const auto start = minimum_at(beta)) return follow_from(beta, *start);
    }
    return std::nullopt;
  }

 private:
  [[nodiscard]] Scene at(double beta) const {
    Scene scene = scene_;
    scene.beta = beta;
    return scene;
  }

  /// The fastest extremal, which is the minimum as long as there is one.
  std::optional<Guess> minimum_at(double beta) {
    const std::vector<Guess> found = find_extremals(at(beta));
    for (const Guess& guess : found) {
      std::vector<Extremal> solved;
      SceneSolver(at(beta), {.accuracy = 1e-6, .method = method_}, cost_).add(solved, guess);
      if (!solved.empty() && solved.front().focal.empty()) return guess;
    }
    return std::nullopt;
  }

  std::optional<double> follow_from(double beta, Guess guess) {
    constexpr int most_legs = 10;
    for (int leg = 0; leg < most_legs; ++leg) {
      const Branch branch = trace(make_problem(at(beta), guess), parameters(at(beta)), unknowns(guess), "beta", scene_.beta,
                                  {.tolerance = 1e-10, .through_folds = false, .max_points = 200, .max_steps = 600, .method = method_});
      cost_.add(branch.cost);
      if (branch.points.empty()) return std::nullopt;
      if (!branch.events.empty() && branch.events.back().kind == EventKind::fold)
        return branch.events.back().point.parameter;
      const BranchPoint& last = branch.points.back();
      if (branch.reached) {
        survivor_ = {guess.family, last.y[0], last.y[1], last.y[2]};
        return std::nullopt;
      }
      // A branch may also end at the border of its family; then the search finds the minimum beyond.
      beta = std::min(last.parameter + 0.01 * (scene_.beta - last.parameter), 1.001 * last.parameter);
      const auto next = minimum_at(beta);
      if (!next) return std::nullopt;
      guess = *next;
    }
    return std::nullopt;
  }

  const Scene& scene_;
  Method method_;
  Cost& cost_;
  std::optional<Guess> survivor_;
};

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

std::optional<tools::BranchStart> branch_start(const Scene& scene) {
  if (scene.mu != 0.0 || scene.beta != 0.0) return std::nullopt;
  const std::optional<Cycloid> motion = cycloid(scene.x, scene.y, scene.speed, scene.gravity);
  if (!motion) return std::nullopt;
  const std::vector<double> values = parameters(scene);
  const Scaled<double> units([&](std::size_t i) { return values[i]; });
  // Without friction the constants of a turning orbit are the slopes at its ends.
  const Guess guess{Family::turning, std::tan(motion->theta1()), std::asinh(std::tan(motion->theta2())),
                    motion->final_time / units.time};
  return tools::BranchStart{make_problem(scene, guess), values, unknowns(guess)};
}

tools::BranchStart restated(const Solution& root) {
  const std::vector<double>& p = root.parameters;
  const Scene scene{p[x_place], p[y_place], p[speed_place], p[mu_place], p[beta_place], p[gravity_place]};
  return {make_problem(scene, {family_of(*root.problem), root.y[0], root.y[1], root.y[2]}), p, root.y};
}

std::string focal_objection(const Solution& solution) {
  const std::vector<double> focal = focal_times(solution);
  return focal.empty() ? "" : objection(solution.final_time(), focal);
}

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
      return finish(
          Outcome::Status::infeasible,
          fmt::format("y = {:g} m is out of reach: with speed = {:g} m/s the bead cannot rise to y_max = {:.12g} m{}",
                      scene.y, scene.speed, height,
                      scene.beta > 0.0 ? " without diving to speeds at which friction is a thrust" : ""));
    }
  }
  SceneSolver solver(scene, options, outcome.cost);
  std::vector<Extremal> extremals = solver.extremals();
  deliver(extremals, outcome);
  if (outcome.solved()) return finish(Outcome::Status::solved, "");
  if (!solver.failure().empty()) return finish(Outcome::Status::failed, solver.failure());
  if (scene.beta > 0.0) {
    Fold fold(scene, options.method, outcome.cost);
    const std::optional<double> beta_max = fold.find();
    if (beta_max) {
      outcome.limits.push_back({"beta_max", "s/m^2", beta_max});
      return finish(
          Outcome::Status::infeasible,
          fmt::format(
              "beta = {:g} s/m^2 leaves no local minimum: as beta grows, the fastest motion meets one that dives into the "
              "thrust at beta_max = {:.9g} s/m^2, and beyond there is neither",
              scene.beta, *beta_max));
    }
    if (fold.survivor()) {
      extremals.clear();
      solver.add(extremals, *fold.survivor());
      deliver(extremals, outcome);
      if (outcome.solved()) return finish(Outcome::Status::solved, "");
    }
  }
  return finish(
      Outcome::Status::failed,
      fmt::format("no extremal without a focal point was found ({} with one); try a nearer end point or less friction",
                  outcome.other_extremals.size()));
}

}  // namespace costate::drag
