#include "curvature/reach.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

namespace costate::curvature {

namespace {

/// Is the point (a, y) shown to be out of reach by the tangent at η = c?
bool excluded(const ScaledScene& scene, double y, double c) {
  constexpr double steepest = std::numbers::pi / 2;
  const double mu = scene.mu - 3.0 * scene.beta * c * c;
  const double loss = -2.0 * scene.beta * c * c * c;
  const auto phi = [&](double theta) {
    return std::exp(2.0 * mu * theta) * (std::sin(theta) + mu * std::cos(theta) - loss);
  };
  const double chord = std::atan2(y, scene.x), sine = std::sin(chord), cosine = std::cos(chord);
  const double slope = 2.0 * mu * phi(chord) + std::exp(2.0 * mu * chord) * (cosine - mu * sine);
  const double p = phi(chord) * cosine - slope * sine, q = phi(chord) * sine + slope * cosine;
  const double start = std::exp(2.0 * mu * scene.slope.value_or(steepest));
  if (!(2.0 * (p * scene.x + q * y) > start)) return false;
  constexpr int points = 400;
  for (int i = 0; i <= points; ++i) {
    const double theta = steepest * (2.0 * i / points - 1.0);
    if (phi(theta) < p * std::cos(theta) + q * std::sin(theta) - 1e-12 * std::abs(p)) return false;
  }
  return true;
}

bool excluded(const ScaledScene& scene, double y) {
  const double on_chord = scene.x / std::hypot(scene.x, y);
  for (const double part : {1.0, 0.9, 0.75, 0.5, 0.25, 0.0}) {
    if (excluded(scene, y, part * on_chord)) return true;
  }
  return false;
}

}  // namespace

double reach_bound(const ScaledScene& scene) {
  double high = 0.5;  // all of the energy
  double low = high - scene.x;
  while (excluded(scene, low)) low = high - 2.0 * (high - low);
  if (!excluded(scene, high)) return high;
  while (high - low > 1e-12 * (1.0 + std::abs(low))) {
    const double middle = std::midpoint(low, high);
    if (middle == low || middle == high) break;
    (excluded(scene, middle) ? high : low) = middle;
  }
  return high;
}

std::optional<Braking> braking_infimum(const ScaledScene& scene) {
  if (!scene.slope || !(std::tan(*scene.slope) <= scene.mu)) return std::nullopt;
  const double cosine = std::cos(*scene.slope), drop = scene.x * std::tan(*scene.slope) - scene.y;
  if (!(drop > 0.0)) return std::nullopt;
  const Braking braking{std::sqrt(2.0 * drop), scene.x / (std::sqrt(2.0 * drop) * cosine)};
  // On the flight itself, up to rounding, the flight is the answer.
  constexpr double rounding = 1e-12;
  return braking.speed < 1.0 - rounding ? std::optional(braking) : std::nullopt;
}

}  // namespace costate::curvature
