/// \file
/// From a scene of the bead with Coulomb friction to its optimum, and to what becomes of the bead on other wires.
#pragma once

#include <costate/models/coulomb_curves.hpp>
#include <costate/shooting/solve.hpp>

#include "common/outcome.hpp"

namespace costate::coulomb {

/// The fastest descent of a scene. Infeasible if μ ≥ H/L, the limit "mu_max". Without friction it is a cycloid, in closed
/// form; else the shooting problem is solved by Newton's method from one and the same start for every scene. Quantities:
/// final_time, lambda_x, lambda_y, lambda_v0, alpha0, alphaF, end_speed.
[[nodiscard]] tools::Outcome solve_scene(const Scene& scene, const SolveOptions& options);

/// Where a scene's branch starts: the shooting problem serves without friction, too, where the scene itself is in closed form.
/// Nothing if Newton's method fails.
[[nodiscard]] std::optional<tools::BranchStart> branch_start(const Scene& scene);

/// The descent along a given curve. Infeasible, with the limit "mu_finish", if the bead stops before the end (the message
/// says where) or the family has no curve through both points. Quantities: final_time, alpha0, alphaF, end_speed and, for
/// kurilin, C. The rows of the trajectory cost a hundred times the rest, and are left out unless asked for. \throws BadInput
/// as solve_scene.
[[nodiscard]] tools::Outcome solve_curve(Curve curve, const Scene& scene, double epsilon, bool with_trajectory = false);

/// What became of the bead on one of several wires.
struct Compared {
  std::string name;  ///< "optimal" or that of the curve
  tools::Outcome outcome;
};

/// The optimum first, then every curve.
[[nodiscard]] std::vector<Compared> compare(const Scene& scene, double epsilon, const SolveOptions& options);

}  // namespace costate::coulomb
