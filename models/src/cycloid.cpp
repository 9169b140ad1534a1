#include <costate/models/cycloid.hpp>

#include <cmath>
#include <numbers>

namespace costate {

namespace {

/// Δ − sin Δ without cancellation.
double minus_sine(double angle) {
  if (angle > 0.5) return angle - std::sin(angle);
  double sum = 0.0, term = angle * angle * angle / 6.0;
  for (int k = 4; std::abs(term) > 1e-18 * sum; k += 2) {
    sum += term;
    term *= -angle * angle / (k * (k + 1.0));
  }
  return sum;
}

/// What the turn Δ makes of the arc; `rest` = π − Δ is kept beside it, for a turn close to π.
struct Turn {
  double turn, rest;
  double sine, cosine;  ///< of Δ/2

  /// Δ = π/(1 + e^{−w}): even resolution at both ends.
  explicit Turn(double w)
      : turn(std::numbers::pi / (1.0 + std::exp(-w))),
        rest(std::numbers::pi / (1.0 + std::exp(w))),
        sine(std::sin(0.5 * turn)),
        cosine(std::sin(0.5 * rest)) {}

  /// Mean of ψ at both ends, within (0, π). `square` is (v_f + v₀)², `fallen` is −2 g b.
  [[nodiscard]] double mean(double square, double fallen) const { return std::atan2(square * sine, fallen * cosine); }
};

}  // namespace

std::optional<Cycloid> cycloid(double a, double b, double speed, double gravity) {
  const double fallen = -2.0 * gravity * b;  // v_f² − v₀²
  const double end_square = speed * speed + fallen;
  if (!(end_square > 0.0)) return std::nullopt;
  const double sum = std::sqrt(end_square) + speed;  // v_f + v₀
  const auto root_gR = [&](const Turn& turn, double m) { return sum / (4.0 * std::sin(m) * turn.cosine); };
  const auto reach = [&](double w) {
    const Turn turn(w);
    const double m = turn.mean(sum * sum, fallen), root = root_gR(turn, m), sine = std::sin(m);
    return root * root / gravity * (2.0 * minus_sine(turn.turn) + 8.0 * sine * sine * turn.sine * turn.cosine);
  };
  double low = -300.0, high = 300.0;
  while (true) {
    const double middle = 0.5 * (low + high);
    if (middle == low || middle == high) break;
    (reach(middle) < a ? low : high) = middle;
  }
  const Turn turn(low);
  const double m = turn.mean(sum * sum, fallen), root = root_gR(turn, m);
  Cycloid c{};
  c.gravity = gravity;
  c.psi1 = speed == 0.0 ? 0.0 : m - 0.5 * turn.turn;
  c.psi2 = m + 0.5 * turn.turn;
  c.lambda_x = 0.5 / root;
  // λ is along the final direction, for λv vanishes there, and H = 0 makes it 1/v_f long.
  c.lambda_y = -std::cos(c.psi2) / std::sqrt(end_square);
  c.final_time = 2.0 * turn.turn * root / gravity;
  return c;
}

Cycloid::Point Cycloid::at(double t) const {
  // From the start the slope turns by δ = gλx t: x = R(2δ − sin 2ψ + sin 2ψ₁), written as a sum of positive terms.
  const double turned = gravity * lambda_x * t;
  const double psi = psi1 + turned;
  const double R = 0.25 / (gravity * lambda_x * lambda_x);
  const double mean = std::sin(0.5 * (psi + psi1));
  const double x = R * (2.0 * minus_sine(turned) + 4.0 * mean * mean * std::sin(turned));
  const double y = -2.0 * R * std::sin(psi + psi1) * std::sin(turned);
  const double sine = std::sin(psi), cosine = std::cos(psi);
  return {x, y, sine / lambda_x, psi - std::numbers::pi / 2, (lambda_y * sine + lambda_x * cosine) / (gravity * lambda_x)};
}

}  // namespace costate
