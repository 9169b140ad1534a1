/// \file
/// From a scene of the bead with drag to its solution, with no guess asked.
#pragma once

#include <costate/models/drag.hpp>
#include <costate/shooting/solve.hpp>

#include "common/outcome.hpp"

namespace costate::drag {

/// Solves a scene.
///
/// Without friction the answer is a cycloid, in closed form. Else all extremals are searched (extremal_search.hpp), solved
/// to the accuracy and verified, the fastest first; the answer is the first without a focal point, a local minimum. The
/// others are listed with the reason why they are not the answer. Limits: y_max, the height the bead can reach
/// (greatest_height), where friction resists at every speed up to v₀. With soft friction there may be no local minimum at
/// all: as β grows the one that continues the cycloid meets the extremal that dives into the region of thrust, and both
/// vanish; then the scene is infeasible, and the limit is beta_max, the β (all else kept) at which they met.
[[nodiscard]] tools::Outcome solve_scene(const Scene& scene, const SolveOptions& options);

/// Where a branch starts from a scene without friction, which is in closed form: a turning orbit serves there, too. Nothing
/// if there is friction, or if the end is out of reach.
[[nodiscard]] std::optional<tools::BranchStart> branch_start(const Scene& scene);

/// The times, from the end backward, in s, at which the extremals that leave the end point meet their neighbours: the zeros
/// of det ∂(x, y, v)/∂(λx, λy, t) within (0, final time]. \throws LeftDomain if the solution cannot be integrated again.
[[nodiscard]] std::vector<double> focal_times(const Solution& solution);

/// The problem of a root with the arcs that suit it: along a branch the place nearest to a steady motion may leave the path.
[[nodiscard]] tools::BranchStart restated(const Solution& root);

/// Why an extremal is no minimum: where its first focal point is; empty if it has none. \throws LeftDomain as focal_times.
[[nodiscard]] std::string focal_objection(const Solution& solution);

}  // namespace costate::drag
