/// \file
/// All extremals of a scene, roughly: where to start the shooting from.
#pragma once

#include <costate/models/normal_friction.hpp>

#include <Eigen/Core>
#include <vector>

namespace costate::normal_friction {

/// The slope jumps between these turned angles |θ₂ − θ|, before > after > 0.
struct CornerAngles {
  double before, after;
};

/// An extremal found by interpolation.
struct RoughExtremal {
  Side side = Side::left;
  double theta2 = 0.0;                ///< slope at the end, rad
  double turned = 0.0;                ///< |θ₂ − θ₁|, jumps included, rad
  std::vector<CornerAngles> corners;  ///< from the last to the first
  double time = 0.0;                  ///< s

  /// As unknowns of make_problem(scene, side, corners.size()).
  [[nodiscard]] Eigen::VectorXd unknowns() const;
};

/// The extremals that lead from (0, 0) at the given speed to (x, y), the fastest first.
///
/// The end slope θ₂ and the turn u fix an extremal but for its scale, and with it V(u) = v/v_f, t/v_f, x/v_f² and y/v_f² from the end
/// backward. Each θ₂ of a grid over the circle is walked along u, over its corners, to where v = v₀ at the wanted distance; between
/// neighbouring θ₂ the direction of that point must pass the wanted one.
[[nodiscard]] std::vector<RoughExtremal> find_extremals(const Scene& scene);

}  // namespace costate::normal_friction
