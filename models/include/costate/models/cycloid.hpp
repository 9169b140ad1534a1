/// \file
/// The brachistochrone without friction, in closed form: a cycloid, from a point left at a given speed to a point below or above.
///
/// y up. With the slope θ as control, x' = v cos θ, y' = v sin θ, v' = −g sin θ; H = −1 + λx v cos θ + λy v sin θ − λv g sin θ is
/// maximised and vanishes. Along the extremal cos θ / v = λx is constant and θ' = g λx, so the path is an arc of a cycloid made
/// by a circle of radius R = 1/(4 g λx²). (Johann Bernoulli 1697; in this form Bryson & Ho, Applied Optimal Control, 1975, §2.7.)
#pragma once

#include <numbers>
#include <optional>

namespace costate {

/// An arc of a cycloid, from (0, 0) to (a, b). SI units.
struct Cycloid {
  double gravity;
  double psi1, psi2;  ///< ψ = θ + π/2, the slope from straight down, at the start and at the end: 0 ≤ ψ₁ < ψ₂ < π
  double final_time;
  double lambda_x, lambda_y;

  struct Point {
    double x, y, v, theta, lambda_v;
  };
  [[nodiscard]] double theta1() const { return psi1 - std::numbers::pi / 2; }
  [[nodiscard]] double theta2() const { return psi2 - std::numbers::pi / 2; }
  /// The motion at time t ∈ [0, final_time]. With its start at rest v and λv have their limits there, 0 and 1/g.
  [[nodiscard]] Point at(double t) const;
};

/// The fastest motion without friction from (0, 0), left at the speed v₀ ≥ 0, to (a, b), a > 0; nothing if the bead does not
/// have the energy to arrive at a positive speed, b ≥ v₀²/(2g). Final time and λ are good to some ten units in the last place of their size, angles to as many of π.
///
/// With v₀ and v_f = √(v₀² − 2 g b) the mean m of ψ at both ends follows from the turn Δ = θ₂ − θ₁,
///     tan(m) = (v_f + v₀)² tan(Δ/2) / (−2 g b),  ψ = m ± Δ/2,  √(gR) = (v_f + v₀) / (4 sin m cos(Δ/2)),
/// and a = R (2 (Δ − sin Δ) + 4 sin²m sin Δ) grows with Δ ∈ (0, π) from 0 to ∞: one equation, without cancellation.
[[nodiscard]] std::optional<Cycloid> cycloid(double a, double b, double speed, double gravity);

}  // namespace costate
