/// \file
/// From a scene of the bead with normal-force friction to its solution, with no guess asked.
#pragma once

#include <costate/models/normal_friction.hpp>
#include <costate/shooting/solve.hpp>

#include "common/outcome.hpp"

namespace costate::normal_friction {

/// Solves a scene.
///
/// Friction linear in N (β = 0) is gravity tilted: a cycloid, in closed form, or a straight line down or up the tilted
/// field. Otherwise the cycloid of the friction's tangent at the chord's inclination is followed to the scene, along the
/// parameter `nonlinearity`. A search over all extremals (find_extremals) finds those with corners, to which no such path
/// leads, and tells whether the one followed is the fastest; slower ones are `other_extremals`.
///
/// A motion with N ≥ 0 loses at least (μ − max(β, 0) g²) g a of its energy to friction, so it does not rise to y_max =
/// v₀²/(2g) − (μ − max(β, 0) g²) a: at or above that the scene is infeasible. `limits` has y_max and, of a solved scene,
/// N_min, the least normal force along the path; where it is negative the path overhangs and friction is a thrust there.
[[nodiscard]] tools::Outcome solve_scene(const Scene& scene, const SolveOptions& options);

/// Where a branch starts from a scene with β = 0, which is in closed form: the shooting problem serves there, too. Nothing
/// if the motion is straight, or if β ≠ 0.
[[nodiscard]] std::optional<tools::BranchStart> branch_start(const Scene& scene);

}  // namespace costate::normal_friction
