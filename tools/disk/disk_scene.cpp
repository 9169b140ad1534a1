#include "disk_scene.hpp"

#include "arc_changes.hpp"

#include <costate/error.hpp>
#include <costate/shooting/branch.hpp>
#include <costate/shooting/continuation.hpp>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace costate::disk {

namespace {

struct FrictionRange {
  double least, most;
};

/// Extremes of the friction a free arc uses, |λ| |Ω| with Ω² = 1 − A²: at its ends, where A = 0 (most) and where A is extreme
/// (least), as far as the arc gets there. In units of c₁²/(g L).
FrictionRange friction_range(const Solution& free) {
  const ArcTrace& arc = free.arcs.front();
  const double lambda_x = arc.record.constants[0];
  const double lambda_y = arc.record.constants[1];
  const double lambda = std::hypot(lambda_x, lambda_y);
  const double direction = std::atan2(lambda_y, lambda_x);
  double lowest = arc.record.state[0], highest = lowest;
  bool turns_back = false;
  for (const auto& piece : arc.trajectory.pieces()) {
    lowest = std::min(lowest, piece.taylor(0, 0));
    highest = std::max(highest, piece.taylor(0, 0));
    turns_back = turns_back || piece.taylor(1, 0) <= 0.0;
  }
  const auto friction = [&](double phi) {
    const double A = lambda * std::cos(phi - direction);
    return lambda * std::sqrt(std::max(0.0, 1.0 - A * A));
  };
  FrictionRange range{std::min(friction(lowest), friction(highest)), std::max(friction(lowest), friction(highest))};
  if (turns_back) range.least = 0.0;
  const double quarter = std::numbers::pi / 2;
  const double first = std::ceil((lowest - direction) / quarter);
  for (double i = first; direction + i * quarter < highest; ++i) {
    range.least = std::min(range.least, friction(direction + i * quarter));
    range.most = std::max(range.most, friction(direction + i * quarter));
  }
  return range;
}

/// Ways from the disk that turns on the spot to the scene, as lists of scenes to pass through. A small end heading makes the
/// start degenerate and the straight way ambiguous (it may follow an extremal past the point where another becomes faster), so
/// then the scene is approached from a quarter turn, one coordinate after the other, and from a half turn as well.
std::vector<std::vector<Scene>> ways_to(const Scene& scene) {
  constexpr double least_turn = 1.0;
  if (std::abs(scene.heading) >= least_turn) return {{scene}};
  Scene turned = scene, along = scene, aside = scene, half_turn = scene;
  turned.heading = along.heading = aside.heading = std::copysign(std::numbers::pi / 2, scene.heading);
  half_turn.heading = 2.0 * turned.heading;
  along.y = 0.0;
  aside.x = 0.0;
  return {{turned, scene}, {along, turned, scene}, {aside, turned, scene}, {half_turn, scene}, {scene}};
}

/// Follows one way and solves at its end.
Solution solve_along(const std::vector<Scene>& way, const SolveOptions& options, long integration_steps, Cost& cost) {
  Scene spot = way.front();
  spot.x = spot.y = 0.0;
  Shooting shooting(make_problem(spot, {{ArcKind::free}}));
  Eigen::VectorXd y = Eigen::Vector3d{std::numbers::pi / 2, 0.0, std::abs(spot.heading)};
  Solution solution;
  bool reached = true;
  for (const Scene& stage : way) {
    const Followed path = follow(shooting, y, parameters(stage), {.max_integration_steps = integration_steps, .method = options.method});
    y = path.y;
    cost.newton_iterations += path.newton_iterations;
    reached = path.reached;
    if (reached) continue;
    solution.message = fmt::format(
        "the solution with unlimited friction was not found: {}; try a nearer end point or a larger "
        "radius (distances beyond some 5 r are out of reach of single shooting)",
        path.message);
    break;
  }
  if (reached) {
    solution = solve(shooting, y, options);
    cost.newton_iterations += solution.cost.newton_iterations;
  }
  cost.add(shooting.statistics());
  return solution;
}

/// The unlimited solution: the fastest extremal that any of the ways leads to.
Solution solve_free(const Scene& scene, const SolveOptions& options, Cost& cost) {
  Scene unlimited = scene;
  unlimited.friction.reset();
  const auto ways = ways_to(unlimited);
  constexpr long long_way = 70000;  // several ways together stay within a few times one
  const long share = ways.size() == 1 ? FollowOptions{}.max_integration_steps : long_way;
  Solution best;
  for (const auto& way : ways) {
    Solution found = solve_along(way, options, share, cost);
    const bool better = found.solved() && (!best.solved() || found.final_time() < best.final_time());
    if (better || best.problem == nullptr) best = std::move(found);
  }
  return best;
}

/// The structures beyond guards that all but vanish at the end of a branch.
std::vector<Successor> neighbours(const Scene& scene, const Branch& branch) {
  constexpr double vanishing = 1e-8;
  Shooting shooting(branch.stretches.back().problem);
  shooting.set_parameters(parameters(scene));
  const Shot& shot = shooting.evaluate(branch.points.back().y);
  std::vector<std::size_t> zeros;
  for (std::size_t i = 0; i < shot.guards().size(); ++i) {
    if (std::abs(shot.guards()[i].value.value) < vanishing) zeros.push_back(i);
  }
  if (zeros.empty()) return {};
  return arc_changes(scene, {shooting.problem(), shooting.parameters(), branch.points.back().y, shot, zeros});
}

/// The motion with limited friction: from a coefficient that does not bind the branch is followed down to the scene's.
Solution solve_limited(const Scene& scene, const Solution& free, double F_max, const SolveOptions& options, Cost& cost) {
  constexpr double above = 1.02;  // F_max, for a start at which nothing binds
  Scene start = scene;
  start.friction = above * F_max;
  const Restructure restructure = [&](const Junction& at) { return arc_changes(scene, at); };
  const Branch branch = trace(make_problem(start, {{ArcKind::free}}), parameters(start), free.y, "friction", *scene.friction,
                              {.tolerance = 1e-10, .max_points = 300, .max_integration_steps = 400000, .method = options.method}, restructure);
  cost.add(branch.cost);
  Solution solution;
  if (!branch.reached) {
    solution.message = fmt::format(
        "the arcs of this scene were not found: from a larger friction coefficient {}; try a larger one", branch.message);
    return solution;
  }
  const auto solve_at = [&](const std::shared_ptr<const Problem>& problem, const Eigen::VectorXd& y) {
    Shooting shooting(problem);
    shooting.set_parameters(parameters(scene));
    SolveOptions from_branch = options;
    from_branch.max_steps = std::min(options.max_steps, 4000L);  // an arc takes some hundred
    solution = solve(shooting, y, from_branch);
    cost.newton_iterations += solution.cost.newton_iterations;
    cost.add(shooting.statistics());
    return solution.solved();
  };
  if (solve_at(branch.stretches.back().problem, branch.points.back().y)) return solution;
  // Where the structure changes at the scene's very coefficient, rounding decides on which side it lies.
  const Solution refused = solution;
  for (const Successor& other : neighbours(scene, branch)) {
    if (solve_at(other.problem, other.y)) return solution;
  }
  return refused;
}

}  // namespace

std::optional<double> least_friction(const Scene& scene) {
  const double half = 0.5 * std::abs(scene.heading);
  const double y = scene.heading < 0.0 ? -scene.y : scene.y;
  const double chord = std::hypot(scene.x, scene.y);
  const double off_axis = scene.x * std::sin(half) - y * std::cos(half);
  const double along = scene.x * std::cos(half) + y * std::sin(half);
  if (!(half <= std::numbers::pi / 2 && chord > 0.0 && along > 0.0 && std::abs(off_axis) <= 1e-9 * chord))
    return std::nullopt;
  const double R = chord / (2.0 * std::sin(half));
  const double L = scene.radius / std::sqrt(6.0);
  return scene.speed * scene.speed * R / (scene.gravity * (R * R + L * L));
}

std::optional<tools::BranchStart> branch_start(const Scene& scene, const tools::Outcome& outcome) {
  if (!scene.friction || outcome.solution.problem->structure().size() > 1) return std::nullopt;
  return tools::BranchStart{make_problem(scene, {{ArcKind::free}}), parameters(scene), outcome.solution.y};
}

Outcome solve_scene(const Scene& scene, const SolveOptions& options) {
  const double began = thread_seconds();
  Outcome outcome;
  const auto finish = [&](Outcome::Status status, std::string message) {
    outcome.status = status;
    outcome.message = std::move(message);
    outcome.limits = {{"F_max", "1", outcome.F_max}, {"F_min", "1", outcome.F_min}, {"k_min", "1", outcome.k_min}};
    outcome.cost.seconds = thread_seconds() - began;
    return outcome;
  };

  outcome.k_min = least_friction(scene);
  if (scene.friction && outcome.k_min && *scene.friction < *outcome.k_min) {
    return finish(
        Outcome::Status::infeasible,
        fmt::format("friction = {:g} is too little: below k_min = {:.12g} no motion of this scene turns monotonically "
                    "to its end heading",
                    *scene.friction, *outcome.k_min));
  }
  Solution free = solve_free(scene, options, outcome.cost);
  if (!free.solved()) return finish(Outcome::Status::failed, free.message);

  const double length = scene.radius / std::sqrt(6.0);
  const double unit = scene.speed * scene.speed / (scene.gravity * length);
  const FrictionRange range = friction_range(free);
  outcome.F_max = unit * range.most;
  outcome.F_min = unit * range.least;
  if (!scene.friction || *scene.friction >= *outcome.F_max) {
    outcome.solution = std::move(free);
    return finish(Outcome::Status::solved, "");
  }
  outcome.solution = solve_limited(scene, free, *outcome.F_max, options, outcome.cost);
  return finish(outcome.solution.solved() ? Outcome::Status::solved : Outcome::Status::failed, outcome.solution.message);
}

}  // namespace costate::disk
