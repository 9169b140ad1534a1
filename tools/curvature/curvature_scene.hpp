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
/// Infeasible are β ≥ 0, where there is no minimum, and end points above `y_max`, a bound on the reach that holds for all motions
/// (see reach_bound). Below that bound an end point is also called infeasible where the search for the highest motion ends, from
/// three starts or more, at one height `y_highest` more than 2 % of the distance below it: evidence, not proof. Without friction
/// and with a free slope the cycloid is delivered in closed form. What is refused as failed: end points that no start led to, such
/// as many below the free flight with the given slope, where the bead would first have to brake.
[[nodiscard]] tools::Outcome solve_scene(const Scene& scene, const SolveOptions& options);

}  // namespace costate::curvature
