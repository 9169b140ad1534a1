/// \file
/// The bead with curvature-coupled friction, from its scene alone to the answer.
#pragma once

#include "common/outcome.hpp"

#include <costate/models/curvature.hpp>
#include <costate/shooting/solve.hpp>

namespace costate::curvature {

/// Solves a scene.
///
/// Several simple controls are improved by a direct method (see transcribe) to local minima of the time; the fastest gives the arc
/// structure, the nodes of multiple shooting and an estimate of every unknown, from which Newton's method solves the equations of the
/// extremal (see make_problem). Nothing of the direct method remains in the answer.
///
/// Infeasible are β ≥ 0, where there is no minimum; end points above `y_max`, a bound on the reach that holds for all motions (see
/// reach_bound); and end points below the free flight with the given slope, where braking at once gives an infimum that no motion
/// attains (see braking_infimum). Below y_max an end point is also called infeasible where the search for the highest motion ends,
/// from three starts or more, at one height `y_highest` more than 2 % of the distance below it, unless the bead is fast (distance below 0.1 v₀²/g):
/// evidence, not proof. Without friction
/// and with a free slope the cycloid is delivered in closed form. What is refused as failed are end points that no start led to.
[[nodiscard]] tools::Outcome solve_scene(const Scene& scene, const SolveOptions& options);

}  // namespace costate::curvature
