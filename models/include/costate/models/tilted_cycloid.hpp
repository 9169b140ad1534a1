/// \file
/// The fastest motion in any uniform field of force, in closed form: a cycloid in a frame turned to the field.
///
/// With the slope θ as control, x' = v cos θ, y' = v sin θ, v' = p·(cos θ, sin θ), p a constant acceleration. Friction in
/// proportion to the normal force without curvature, −μ g cos θ, is such a field: it does the work −μ g dx, so it tilts and
/// strengthens gravity, p = (−μ g, −g).
#pragma once

#include <costate/models/cycloid.hpp>

namespace costate {

/// A cycloid turned by `tilt` (rad), mirrored before that if it curves to the right. SI units, angles in the outer frame.
struct TiltedCycloid {
  Cycloid cycloid;
  double tilt;
  bool mirrored;

  [[nodiscard]] double theta1() const { return slope(cycloid.theta1()); }
  [[nodiscard]] double theta2() const { return slope(cycloid.theta2()); }
  /// θ₂ − θ₁; negative if mirrored.
  [[nodiscard]] double turn() const { return (cycloid.psi2 - cycloid.psi1) * (mirrored ? -1.0 : 1.0); }
  [[nodiscard]] double lambda_x() const;
  [[nodiscard]] double lambda_y() const;
  /// The motion at time t ∈ [0, final_time], in the outer frame.
  [[nodiscard]] Cycloid::Point at(double t) const;

 private:
  [[nodiscard]] double slope(double theta) const;
};

/// The fastest motion from (0, 0), left at the speed v₀ ≥ 0, to (x, y) ≠ (0, 0) under the constant acceleration (pull_x, pull_y)
/// ≠ 0; nothing if the bead has not the energy to arrive at a positive speed, v₀² + 2 (pull_x x + pull_y y) ≤ 0, or if the
/// end lies along the field exactly, where the motion is straight.
[[nodiscard]] std::optional<TiltedCycloid> tilted_cycloid(double x, double y, double speed, double pull_x, double pull_y);

}  // namespace costate
