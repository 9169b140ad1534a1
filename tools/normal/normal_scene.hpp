/// \file
/// From a scene of the bead with normal-force friction to its solution, with no guess asked.
#pragma once

#include <costate/models/normal_friction.hpp>
#include <costate/shooting/solve.hpp>

#include "common/outcome.hpp"

namespace costate::normal_friction {

/// Solves a scene.
///
/// Friction linear in N (β = 0) is gravity tilted: a cycloid, in closed form. Otherwise the start is such a cycloid and the scene is
/// reached along a straight path of parameters; several ways are tried in turn. The first keeps the end point and lets the
/// friction grow from its tangent at the chord's inclination.
///
/// A motion with N ≥ 0 loses at least (μ − max(β, 0) g²) g a of its energy to friction, so it does not rise to
/// y_max = v₀²/(2g) − (μ − max(β, 0) g²) a: at or above that the scene is infeasible.
[[nodiscard]] tools::Outcome solve_scene(const Scene& scene, const SolveOptions& options);

}  // namespace costate::normal_friction
