/// \file
/// The free arc of the rolling disk in closed form: the oracle that shares nothing with the integrator.
#pragma once

#include <cmath>
#include <numbers>

namespace costate::test {

/// End of the free arc that starts at x = y = φ = 0 with costate √m (cos α, sin α), 0 < m < 1, and turns to φ_f; scaled units.
///
/// With ψ = φ − α the speed is V = √m cos ψ and Ω = √(1 − m cos²ψ), hence with θ = ψ + π/2
///     t = F(θ | m),   ∫V cos ψ dt = (F − E)/√m   along the costate,   ∫V sin ψ dt = Ω/√m   across it,
/// each between the ends.
struct EllipticArc {
  double x, y, time, lambda_x, lambda_y;

  EllipticArc(double m, double alpha, double heading) {
    const double k = std::sqrt(m);
    const double from = -alpha + std::numbers::pi / 2;
    const double to = from + heading;
    const auto turning = [&](double theta) { return std::sqrt(1.0 - m * std::sin(theta) * std::sin(theta)); };
    time = std::ellint_1(k, to) - std::ellint_1(k, from);
    const double along = (time - (std::ellint_2(k, to) - std::ellint_2(k, from))) / k;
    const double across = (turning(to) - turning(from)) / k;
    x = along * std::cos(alpha) - across * std::sin(alpha);
    y = along * std::sin(alpha) + across * std::cos(alpha);
    lambda_x = k * std::cos(alpha);
    lambda_y = k * std::sin(alpha);
  }
};

}  // namespace costate::test
