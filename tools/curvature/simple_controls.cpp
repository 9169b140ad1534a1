/// Where the direct method starts from.
#include "curvature/tau_step.hpp"
#include "curvature/transcription.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace costate::curvature {

namespace {

/// Free flights that hit the end point: where θ(0) is free they are motions of the scene, b = a tan θ₁ − ½ a²(1 + tan² θ₁).
void add_flights(const ScaledScene& scene, std::vector<ControlGuess>& found) {
  const double a = scene.x, square = 1.0 - a * a - 2.0 * scene.y;
  if (square < 0.0) return;
  const double high = (1.0 + std::sqrt(square)) / a, low = (a * a + 2.0 * scene.y) / (a * a) / high;
  for (const double tangent : {low, high}) {
    const double slope = std::atan(tangent);
    // Along a flight x = cos² θ₁ (tan θ₁ − tan θ) in these units, and θ' = −cos θ.
    const double end = std::atan(tangent - a * (1.0 + tangent * tangent));
    const auto inverse_gudermannian = [](double theta) { return std::asinh(std::tan(theta)); };
    const double length = inverse_gudermannian(slope) - inverse_gudermannian(end);
    constexpr int points = 40;
    constexpr double aside = 0.05;
    ControlGuess flight{{}, {}, slope, 0.0};
    for (int i = 0; i <= points; ++i) {
      const double tau = length * i / points;
      flight.tau.push_back(tau);
      flight.eta.push_back(aside / std::cosh(inverse_gudermannian(slope) - tau));  // a little of cos θ
    }
    found.push_back(std::move(flight));
  }
}

/// η(τ) of a simple control.
double level(double begin, double end, double tau) { return end + (begin - end) * std::exp(-tau); }

/// Follows η falling or rising from `begin` to `end` within about one unit of τ, calls `at` with (τ, x, y) after every step, and stops
/// where that says so or the bead has gone or stopped.
template <class At>
void try_control(const ScaledScene& scene, double slope, double begin, double end, const At& at) {
  constexpr double length = 0.05, longest = 40.0, stopped = -12.0;
  const double distance = std::hypot(scene.x, scene.y);
  double theta = slope, log_v = 0.0, x = 0.0, y = 0.0;
  for (double tau = 0.0; tau < longest && log_v > stopped && x * x + y * y < 100.0 * distance * distance; tau += length) {
    const auto s = step(theta, level(begin, end, tau), level(begin, end, tau + length), length, scene.mu, scene.beta);
    const double v2 = std::exp(2.0 * log_v);
    x += v2 * s.x;
    y += v2 * s.y;
    log_v += s.log_v;
    theta = s.theta;
    if (at(tau + length, x, y)) return;
  }
}

/// All simple controls, each up to where `measure(x, y)` is least while `go_on(x, y)`; the least first.
template <class Measure, class GoOn>
std::vector<ControlGuess> simple_controls_by(const ScaledScene& scene, const Measure& measure, const GoOn& go_on) {
  // cos of a slope is the η that holds the bead on it.
  const double chord = scene.x / std::hypot(scene.x, scene.y);
  const double levels[] = {0.02, 0.3, 0.6, 0.8, 0.9, chord, 0.97, 1.0, 1.05, 1.2, 1.7, 2.5, 4.0};
  constexpr double slopes[] = {-1.5, -1.2, -0.9, -0.6, -0.3, 0.0, 0.4};
  constexpr int points = 200;
  std::vector<ControlGuess> found;
  for (const double begin : levels) {
    for (const double end : levels) {
      for (const double slope : slopes) {
        ControlGuess best{{}, {}, scene.slope.value_or(slope), std::numeric_limits<double>::infinity()};
        double length = 0.0;
        try_control(scene, best.slope, begin, end, [&](double tau, double x, double y) {
          if (measure(x, y) < best.miss) {
            best.miss = measure(x, y);
            length = tau;
          }
          return !go_on(x, y);
        });
        for (int i = 0; length > 0.0 && i <= points; ++i) {
          best.tau.push_back(length * i / points);
          best.eta.push_back(level(begin, end, best.tau.back()));
        }
        if (length > 0.0) found.push_back(std::move(best));
        if (scene.slope) break;
      }
    }
  }
  std::sort(found.begin(), found.end(), [](const ControlGuess& a, const ControlGuess& b) { return a.miss < b.miss; });
  return found;
}

}  // namespace

std::vector<ControlGuess> simple_controls(const ScaledScene& scene) {
  const double distance = std::hypot(scene.x, scene.y);
  std::vector<ControlGuess> found;
  if (!scene.slope) add_flights(scene, found);
  const auto aimed = simple_controls_by(
      scene, [&](double x, double y) { return std::hypot(x - scene.x, y - scene.y) / distance; },
      [&](double x, double y) { return std::hypot(x, y) < 2.0 * distance; });
  found.insert(found.end(), aimed.begin(), aimed.end());
  return found;
}

std::vector<ControlGuess> high_controls(const ScaledScene& scene) {
  // Up to where the end point's vertical is crossed, the highest first.
  return simple_controls_by(
      scene, [&](double x, double y) { return x >= scene.x ? -y : std::numeric_limits<double>::infinity(); },
      [&](double x, double) { return x < scene.x; });
}

}  // namespace costate::curvature
