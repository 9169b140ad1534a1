/// \file
/// All extremals of a scene, roughly: where to start the shooting from.
#pragma once

#include <costate/models/normal_friction.hpp>

#include <Eigen/Core>
#include <vector>

namespace costate::normal_friction {

/// An extremal found by interpolation.
struct RoughExtremal {
  Structure structure;
  Eigen::VectorXd unknowns;  ///< of make_problem(scene, structure)
  double time = 0.0;         ///< s
};

/// The extremals that lead from (0, 0) at the given speed to (x, y), the fastest first.
///
/// The end slope θ₂ and a place on the way back from the end fix an extremal but for its scale, and with it v/v_f, t/v_f, x/v_f² and
/// y/v_f². Each θ₂ of a grid over the circle is followed back, from corner to corner, to where v = v₀ at the wanted distance;
/// between neighbouring θ₂ the direction of that point must pass the wanted one.
[[nodiscard]] std::vector<RoughExtremal> find_extremals(const Scene& scene);

}  // namespace costate::normal_friction
