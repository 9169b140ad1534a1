#include "curvature/curvature_scene.hpp"

#include "curvature/plan.hpp"
#include "curvature/reach.hpp"
#include "curvature/transcription.hpp"

#include <costate/error.hpp>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace costate::curvature {

using tools::Outcome;

namespace {

ScaledScene scaled(const Scene& scene) {
  const double length = scene.speed * scene.speed / scene.gravity;
  return {scene.x / length, scene.y / length, scene.slope, scene.mu, scene.beta * scene.gravity * scene.gravity};
}

/// Refines a transcribed motion on two finer grids, each fitted to the one before. Nothing if it does not converge.
std::optional<Transcribed> refined(const ScaledScene& scene, Transcribed motion) {
  for (const int cells : {60, 80}) {
    if (!motion.converged) return std::nullopt;
    motion = transcribe(scene, regrid(motion, cells), {.cells = cells});
  }
  return motion.converged ? std::optional(std::move(motion)) : std::nullopt;
}

/// The highest motion to the end point's vertical that the transcription finds.
std::optional<Transcribed> highest_motion(const ScaledScene& scene) {
  constexpr std::size_t tries = 4;
  const std::vector<ControlGuess> guesses = high_controls(scene);
  std::optional<Transcribed> best;
  for (std::size_t i = 0; i < std::min(tries, guesses.size()); ++i) {
    Transcribed motion = transcribe(scene, guesses[i], {.goal = Goal::highest});
    if (motion.converged && (!best || motion.y > best->y)) best = std::move(motion);
  }
  return best;
}

class SceneSolver {
 public:
  SceneSolver(const Scene& scene, const SolveOptions& options) : scene_(scene), scaled_(scaled(scene)), options_(options) {
    options_.max_steps = 600;
    options_.max_iterations = 12;
  }

  Outcome run() {
    const double began = thread_seconds();
    search();
    outcome_.cost.seconds = thread_seconds() - began;
    return std::move(outcome_);
  }

 private:
  void search() {
    constexpr std::size_t tries = 6;
    const double unit = scene_.speed * scene_.speed / scene_.gravity;
    const double bound = reach_bound(scaled_);
    if (!(scaled_.y < bound)) {
      outcome_.status = Outcome::Status::infeasible;
      outcome_.message = fmt::format("bound {} {}", scene_.y, bound * unit);
      return;
    }
    const std::vector<ControlGuess> guesses = simple_controls(scaled_);
    for (std::size_t i = 0; i < std::min(tries, guesses.size()); ++i) {
      if (solve_from(transcribe(scaled_, guesses[i], {}))) return;
    }
    const std::optional<Transcribed> highest = highest_motion(scaled_);
    if (highest) {
      const double length = scene_.speed * scene_.speed / scene_.gravity;
      constexpr double margin = 2e-3;
      outcome_.limits = {{"y_max", "m", highest->y * length}};
      if (highest->y < scaled_.y - margin * std::hypot(scaled_.x, scaled_.y)) {
        outcome_.status = Outcome::Status::infeasible;
        outcome_.message = fmt::format("out of reach {} bound {} {}", scene_.y, bound*length, highest->y * length);
        return;
      }
      if (solve_from(transcribe(scaled_, regrid(*highest, 40), {}))) return;
    }
    outcome_.status = Outcome::Status::failed;
    outcome_.message = why_ + (highest? fmt::format(" bound {} highest {}", bound * unit, highest->y* scene_.speed * scene_.speed / scene_.gravity):fmt::format(" bound {} none highest",bound*unit));
  }

  /// Solves the scene from an estimate. False if that does not lead to a solution.
  bool solve_from(const Transcribed& estimate) {
    const std::optional<Transcribed> motion = refined(scaled_, estimate);
    if (!motion) return false;
    const Plan plan = make_plan(scaled_, *motion, 4.0);
    outcome_.solution = solve(make_problem(scene_, plan), unknowns(scene_, plan), options_);
    why_ = outcome_.solution.message;
    if (!outcome_.solution.solved()) return false;
    outcome_.status = Outcome::Status::solved;
    return true;
  }

  Scene scene_;
  ScaledScene scaled_;
  SolveOptions options_;
  Outcome outcome_;
  std::string why_ = "no motion found";
};

}  // namespace

Outcome solve_scene(const Scene& scene, const SolveOptions& options) { return SceneSolver(scene, options).run(); }

}  // namespace costate::curvature
