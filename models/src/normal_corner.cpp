#include "normal_corner.hpp"

#include <costate/models/gauss.hpp>

#include <cmath>

namespace costate::normal_friction {

namespace {

/// sin u/u, for |u| far below 1: what is left out is u⁸/9!.
Jet sine_ratio(const Jet& u) {
  const Jet square = u * u;
  return 1.0 - square / 6.0 * (1.0 - square / 20.0 * (1.0 - square / 42.0));
}

/// The rows of a small jump. What is left out of the integrals by a rule of eight points is below rounding unless the speed has a pole
/// nearer than the jump is wide.
std::array<Jet, 2> rows_of_small_jump(const Push<Jet>& push, const Jet& theta2, const Jet& middle, const Jet& jump) {
  // The difference of the integrand on both sides, over their distance, is that at no less than this: it differs by the square.
  constexpr double least = 1e-4;
  const Jet apart = std::abs(jump.value) > least ? jump : Jet(least);
  const SlopePoint<Jet> mean(push, theta2, middle);
  const Jet mean_cosine = cos(middle), sine2 = sin(theta2);
  const Jet norm = mean.f * mean.f + mean_cosine * mean_cosine;
  const Jet linear = push.x * sine2 - push.y * cos(theta2);
  const auto along = [&](const SlopePoint<Jet>& p, const Jet& left) {
    return (p.f * mean.f + cos(left) * mean_cosine) * p.slowness();
  };
  const auto across = [&](const SlopePoint<Jet>& p, const Jet& left) {
    const Jet D = linear + push.cubic * (p.cosine * p.cosine * sine2 + mean.cosine * cos(left) * sin(p.theta + mean.theta));
    return D * p.slowness();
  };
  Jet first, second;
  for (const auto& [node, weight] : gauss) {
    const Jet u = 0.5 * node * jump, w = 0.5 * node * apart;
    for (const double side : {1.0, -1.0}) {
      const Jet left = middle - side * u, wide = middle - side * w;
      first += 0.5 * weight * along(SlopePoint<Jet>(push, theta2, left), left);
      second -= 0.25 * weight * side * node * sine_ratio(u) * across(SlopePoint<Jet>(push, theta2, wide), wide);
    }
  }
  return {first * mean.q / norm, second / apart};
}

}  // namespace

std::array<Jet, 2> corner_rows(const Push<Jet>& push, const Jet& theta2, const Jet& before, const Jet& after) {
  constexpr double small = 0.05;
  const Jet jump = before - after;
  if (std::abs(jump.value) < small) return rows_of_small_jump(push, theta2, 0.5 * (before + after), jump);
  const SlopePoint<Jet> left(push, theta2, before), right(push, theta2, after);
  return {(right.speed_ratio() / left.speed_ratio() - 1.0) / jump, (right.lambda_v() / left.lambda_v() - 1.0) / jump};
}

}  // namespace costate::normal_friction
