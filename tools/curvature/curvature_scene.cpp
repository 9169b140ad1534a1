#include "curvature/curvature_scene.hpp"

#include "bead/cycloid_outcome.hpp"
#include "curvature/plan.hpp"
#include "curvature/reach.hpp"
#include "curvature/transcription.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <numbers>

namespace costate::curvature {

using tools::Outcome;

namespace {

ScaledScene scaled(const Scene& scene) {
  const double length = scene.speed * scene.speed / scene.gravity;
  return {scene.x / length, scene.y / length, scene.slope, scene.mu, scene.beta * scene.gravity * scene.gravity};
}

/// Refines a transcribed motion on finer grids, each fitted to the one before. Nothing if that does not converge.
std::optional<Transcribed> refined(const ScaledScene& scene, const Transcribed& coarse) {
  // On one grid in twenty Newton's method loses its way; another then serves.
  for (const std::array<int, 2> cells : {std::array{60, 80}, std::array{80, 100}, std::array{50, 70}}) {
    Transcribed motion = transcribe(scene, regrid(coarse, cells[0]), {.cells = cells[0]});
    if (motion.converged) motion = transcribe(scene, regrid(motion, cells[1]), {.cells = cells[1]});
    if (motion.converged) return motion;
  }
  return std::nullopt;
}

/// What the direct method makes of a scene.
struct Survey {
  std::vector<Transcribed> minima;  ///< different local minima of the time, the fastest first
  /// Height of the highest motion to the end point's vertical, if none to the end point was found and several starts agree on it.
  std::optional<double> highest;
};

Survey survey(const ScaledScene& scene) {
  constexpr std::size_t tries = 24, high_tries = 8;
  constexpr int enough = 4;
  constexpr double same = 1e-4;
  Survey result;
  int converged = 0;
  const auto add = [&](const ControlGuess& guess) {
    Transcribed motion = transcribe(scene, guess, {});
    if (!motion.converged) return;
    ++converged;
    const bool known = std::any_of(result.minima.begin(), result.minima.end(),
                                   [&](const Transcribed& f) { return std::abs(f.time - motion.time) < same * f.time; });
    if (!known) result.minima.push_back(std::move(motion));
  };
  const std::vector<ControlGuess> aimed = simple_controls(scene);
  for (std::size_t i = 0; converged < enough && i < std::min(tries, aimed.size()); ++i) add(aimed[i]);
  if (result.minima.empty()) {
    // Where the reach is barely enough, the highest motion leaves the most to spare.
    const double size = std::hypot(scene.x, scene.y);
    double best = -std::numeric_limits<double>::infinity();
    int agreeing = 0;
    const std::vector<ControlGuess> high = high_controls(scene);
    for (std::size_t i = 0; result.minima.empty() && i < std::min(high_tries, high.size()); ++i) {
      const Transcribed motion = transcribe(scene, high[i], {.goal = Goal::highest});
      if (!motion.converged) continue;
      if (motion.y > scene.y) add(regrid(motion, TranscriptionOptions{}.cells));
      if (motion.y > best + same * size) agreeing = 0;
      if (motion.y > best - same * size) ++agreeing;
      best = std::max(best, motion.y);
    }
    if (agreeing >= 3) result.highest = best;
  }
  std::sort(result.minima.begin(), result.minima.end(),
            [](const Transcribed& a, const Transcribed& b) { return a.time < b.time; });
  return result;
}

/// Height of the free flight that starts with the scene's slope, on the end point's vertical.
std::optional<double> flight_height(const Scene& scene) {
  if (!scene.slope || !(std::abs(*scene.slope) < std::numbers::pi / 2)) return std::nullopt;
  const double across = scene.x / (scene.speed * std::cos(*scene.slope));
  return scene.x * std::tan(*scene.slope) - 0.5 * scene.gravity * across * across;
}

void search(const Scene& scene, SolveOptions options, Outcome& outcome) {
  // A plan is close to its solution: an iterate that needs more than this has lost it.
  options.max_steps = 1000;
  options.max_iterations = 12;
  constexpr double growth = 4.0;
  constexpr int attempts = 2;
  constexpr long patience = 250000;  // integration steps: more would take seconds
  const ScaledScene units = scaled(scene);
  std::string why;
  int tried = 0;
  const Survey found = survey(units);
  const auto solved_from = [&](const Transcribed& motion) {
    const Plan plan = make_plan(units, motion, growth);
    Shooting shooting(make_problem(scene, plan));
    Solution solution = solve(shooting, unknowns(scene, plan), options);
    outcome.cost.add(shooting.statistics());
    outcome.cost.newton_iterations += solution.cost.newton_iterations;
    if (why.empty()) why = solution.message;
    if (!solution.solved()) return false;
    outcome.solution = std::move(solution);
    outcome.status = Outcome::Status::solved;
    return true;
  };
  for (const Transcribed& coarse : found.minima) {
    std::optional<Transcribed> motion = refined(units, coarse);
    if (!motion) continue;
    if (solved_from(*motion)) return;
    if (outcome.cost.steps > patience) break;
    // A nearly vertical contact arc has a tiny η that hangs on the last digits of θ.
    constexpr int many = 200;
    *motion = transcribe(units, regrid(*motion, many), {.cells = many});
    if (motion->converged && solved_from(*motion)) return;
    if (++tried == attempts || outcome.cost.steps > patience) break;
  }
  outcome.status = Outcome::Status::failed;
  outcome.message = why;
  if (!why.empty()) return;
  // The height is that of a grid, and weighs a little time against it. It is evidence only where energy is scarce: a fast bead can
  // brake first, which the search does not try.
  constexpr double margin = 0.02, scarce = 0.1;
  if (found.highest && std::hypot(units.x, units.y) > scarce && *found.highest + margin * std::hypot(units.x, units.y) < units.y) {
    const double highest = *found.highest * scene.speed * scene.speed / scene.gravity;
    outcome.status = Outcome::Status::infeasible;
    outcome.limits.push_back({"y_highest", "m", highest});
    outcome.message = fmt::format(
        "y = {:g} m is out of reach: the highest motion to x = {:g} m, on which several starts of the search "
        "agree, ends at y_highest = {:.5g} m",
        scene.y, scene.x, highest);
    return;
  }
  const std::optional<double> flight = flight_height(scene);
  outcome.message =
      flight && scene.y < *flight
          ? fmt::format(
                "no motion to the end point was found: y = {:g} m lies below the free flight with the given slope, "
                "{:.6g} m, so the bead would have to brake at once, and then the fastest motion is not known to exist; try a "
                "steeper slope or --slope free",
                scene.y, *flight)
          : fmt::format(
                "no motion to the end point was found, though y = {:g} m is not shown to be out of reach; "
                "try a lower end point or less friction",
                scene.y);
}

/// The cycloid with what this model knows of it besides: λθ ≡ 0, and h = g cos θ + v θ' = 2 g cos θ with v θ' = v g λx = g cos θ.
Outcome without_friction(const Scene& scene) {
  Outcome outcome = bead::cycloid_outcome(scene.x, scene.y, scene.speed, scene.gravity);
  if (!outcome.closed_form) return outcome;
  std::vector<Quantity>& quantities = outcome.closed_form->quantities;
  const Quantity theta = outcome["theta1"], x = outcome["lambda_x"], y = outcome["lambda_y"];
  const double end_speed = 1.0 / std::hypot(x.value, y.value), weight = 2.0 * scene.gravity;
  quantities.push_back({"lambda_theta0", "s/rad", 0.0, 0.0});
  quantities.push_back({"h0", "m/s^2", weight * std::cos(theta.value), weight * theta.error_bound});
  quantities.push_back({"v_f", "m/s", end_speed, end_speed * end_speed * (x.error_bound + y.error_bound)});
  return outcome;
}

}  // namespace

Outcome solve_scene(const Scene& scene, const SolveOptions& options) {
  const double began = thread_seconds();
  Outcome outcome;
  const double unit = scene.speed * scene.speed / scene.gravity;
  if (scene.beta >= 0.0) {
    if (scene.beta == 0.0 && scene.mu == 0.0 && !scene.slope) {
      return without_friction(scene);
    }
    outcome.status = Outcome::Status::infeasible;
    outcome.limits = {{"beta_max", "s^4/m^2", 0.0}};
    outcome.message = fmt::format(
        "beta = {:g} s^4/m^2 has no minimum: Legendre-Clebsch, 6 beta h lambda_v v^2 <= 0 with h, lambda_v, v > 0, needs "
        "beta < 0; {}",
        scene.beta,
        scene.beta > 0.0 ? "with beta > 0 ever sharper turns are ever faster" : "with beta = 0 the wire may turn at once");
  } else if (const double highest = reach_bound(scaled(scene)) * unit; !(scene.y < highest)) {
    outcome.status = Outcome::Status::infeasible;
    outcome.limits = {{"y_max", "m", highest}};
    outcome.message = fmt::format(
        "y = {:g} m is out of reach: with this speed and friction no bead rises to y_max = {:.12g} m at x = {:g} m", scene.y,
        highest, scene.x);
  } else if (const std::optional<Braking> braking = braking_infimum(scaled(scene))) {
    const double flight = *flight_height(scene), infimum = braking->time * scene.speed / scene.gravity;
    outcome.status = Outcome::Status::infeasible;
    outcome.limits = {{"y_max", "m", highest}, {"y_flight", "m", flight}, {"time_infimum", "s", infimum}};
    outcome.message = fmt::format(
        "y = {:g} m has no minimum: it lies below y_flight = {:.12g} m, the free flight with the given slope; the harder the bead "
        "brakes at the start, to {:.6g} m/s, and then flies, the closer it comes to time_infimum = {:.12g} s, which no motion attains",
        scene.y, flight, braking->speed * scene.speed, infimum);
  } else {
    outcome.limits = {{"y_max", "m", highest}};
    search(scene, options, outcome);
  }
  outcome.cost.seconds = thread_seconds() - began;
  return outcome;
}

}  // namespace costate::curvature
