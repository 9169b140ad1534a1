#include "curvature/curvature_scene.hpp"

#include "curvature/plan.hpp"
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

}  // namespace

Outcome solve_scene(const Scene& scene, const SolveOptions& options) {
  const double began = thread_seconds();
  Outcome outcome;
  const auto finish = [&](Outcome::Status status, std::string message) {
    outcome.status = status;
    outcome.message = std::move(message);
    outcome.cost.seconds = thread_seconds() - began;
    return outcome;
  };
  const ScaledScene s = scaled(scene);
  std::string why = "no motion found";
  int tries = 0;
  for (const ControlGuess& guess : simple_controls(s)) {
    if (++tries > 6) break;
    const Transcribed coarse = transcribe(s, guess, {});
    if (!coarse.converged) continue;
    const Transcribed middle = transcribe(s, regrid(coarse, 60), {.cells = 60});
    if (!middle.converged) continue;
    const Transcribed fine = transcribe(s, regrid(middle, 80), {.cells = 80});
    if (!fine.converged) continue;
    const Plan plan = make_plan(s, fine, std::getenv("GROWTH") ? atof(std::getenv("GROWTH")) : 4.0);
    if (std::getenv("TRACE")) {
      for (auto& a : plan.arcs) fmt::print("{} {} nodes {}\n", a.kind == ArcKind::contact ? "C" : "B", a.length, a.nodes.size());
    }
    SolveOptions capped = options;
    capped.max_steps = 600;
    capped.max_iterations = 12;
    outcome.solution = solve(make_problem(scene, plan), unknowns(scene, plan), capped);
    outcome.cost.add(Statistics{});
    if (outcome.solution.solved()) return finish(Outcome::Status::solved, "");
    why = outcome.solution.message;
    if (std::getenv("TRACE")) fmt::print("{}\n", why);
  }
  return finish(Outcome::Status::failed, why);
}

}  // namespace costate::curvature
