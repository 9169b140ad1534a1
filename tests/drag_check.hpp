/// \file
/// What a solution of the drag model claims, looked at with nothing of the library's: the full equations in time, states
/// and costates, the law by its definition, integrated by Dormand & Prince.
#pragma once

#include "drag/drag_scene.hpp"
#include "runge_kutta.hpp"

#include <algorithm>
#include <fmt/format.h>
#include <string>
#include <vector>

namespace costate::test {

/// x, y, v, λx, λy, λv in SI units.
using DragState = std::array<double, 6>;

/// The state–costate equations of the bead with drag.
struct DragEquations {
  double mu, beta, gravity;

  explicit DragEquations(const drag::Scene& scene) : mu(scene.mu), beta(scene.beta), gravity(scene.gravity) {}
  [[nodiscard]] double K(double v) const { return -mu * v + beta * v * v * v; }
  /// cos θ and sin θ that maximise λx v cos θ + λy v sin θ − λv g sin θ.
  [[nodiscard]] std::array<double, 2> direction(const DragState& s) const {
    const double along = s[2] * s[3], across = s[2] * s[4] - gravity * s[5];
    const double size = std::hypot(along, across);
    return {along / size, across / size};
  }
  DragState operator()(double, const DragState& s) const {
    const auto [cosine, sine] = direction(s);
    const double v = s[2];
    return {v * cosine, v * sine, -gravity * sine + K(v),
            0.0,        0.0,      -(s[3] * cosine + s[4] * sine) - s[5] * (-mu + 3.0 * beta * v * v)};
  }
  /// How fast neighbours may part, 1/s.
  [[nodiscard]] double rate(const DragState& s) const { return gravity / s[2] + mu + 3.0 * std::abs(beta) * s[2] * s[2]; }
  [[nodiscard]] double hamiltonian(const DragState& s) const {
    const auto [cosine, sine] = direction(s);
    return -1.0 + s[3] * s[2] * cosine + s[4] * s[2] * sine + s[5] * (-gravity * sine + K(s[2]));
  }
};

/// A solution's state at t: columns x, y, v, theta, lambda_x, lambda_y, lambda_v.
inline DragState drag_state(const Solution& solution, double t) {
  const std::vector<double> at = solution.at(t);
  return {at[0], at[1], at[2], at[4], at[5], at[6]};
}

/// What is wrong with a solution of the scene; empty if nothing is.
///
/// Near a steady motion the equations in time are a saddle with rates of about g/v that loses every digit. So the path is
/// integrated in windows of some 1/rate, from the solution at the begin of each to its end, where it must be met: a path
/// that is pieced together wrongly fails in the window that holds the joint. Where by the equations the motion is steady
/// (rates of v and λv below 1e-9 of the window's) as long as the solution says so, the window may be as long as that; there
/// x and y must advance in proportion.
inline std::string drag_objection(const drag::Scene& scene, const Solution& solution, double tolerance) {
  const DragEquations equations(scene);
  const double T = solution.final_time();
  const DragState start = drag_state(solution, 0.0), end = drag_state(solution, T);
  const double length = std::hypot(scene.x, scene.y);
  if (std::hypot(start[0], start[1]) > tolerance * length) return "does not start at the origin";
  if (std::abs(start[2] / scene.speed - 1.0) > tolerance) return "does not start at the speed of the scene";
  if (std::hypot(end[0] - scene.x, end[1] - scene.y) > tolerance * length) return "does not end where it should";
  if (std::abs(end[5]) * scene.gravity > tolerance * end[2] * std::hypot(end[3], end[4]))
    return "lambda_v is not 0 at the end";
  DragState from = start;
  int windows = 0;
  for (double t = 0.0; t < T;) {
    if (++windows > 20000) return fmt::format("too many windows, at t = {:.6g} of {:.6g}", t, T);
    const double H = equations.hamiltonian(from);
    if (!(std::abs(H) <= tolerance * (1.0 + std::abs(from[5] * equations.K(from[2])))))
      return fmt::format("H = {:.1e} at t = {:.6g}", H, t);
    if (!(from[2] > 0.0)) return fmt::format("v = {:.3g} at t = {:.6g}", from[2], t);
    const DragState rates = equations(t, from);
    const double rate = equations.rate(from);
    double window = 3.0 / rate;
    while (t + window < T && equations.rate(drag_state(solution, t + window)) * window > 4.0) window *= 0.5;
    const auto steady = [&](const DragState& s) {
      return std::abs(s[2] - from[2]) <= 1e-8 * from[2] && std::abs(s[5] - from[5]) <= 1e-8 * std::abs(from[5]);
    };
    bool skipped = false;
    if (std::abs(rates[2]) <= 1e-9 * rate * from[2] && std::abs(rates[5]) <= 1e-9 * rate * std::abs(from[5])) {
      while (t + 2.0 * window < T && steady(drag_state(solution, t + 2.0 * window))) {
        window *= 2.0;
        skipped = true;
      }
    }
    const double next = !skipped && t + 1.2 * window >= T ? T : t + window;
    if (!(next > t)) return "the windows are too short";
    const DragState to = drag_state(solution, next);
    if (skipped) {
      for (std::size_t i = 0; i < 2; ++i) {
        if (std::abs(to[i] - from[i] - rates[i] * (next - t)) > tolerance * length)
          return fmt::format("no steady motion at t = {:.6g}", t);
      }
    } else {
      const DragState reached = runge_kutta(equations, t, next, from, 1e-12);
      const double place = std::hypot(reached[0] - to[0], reached[1] - to[1]) / length;
      const double speed = std::abs(reached[2] - to[2]) / std::max(from[2], to[2]);
      // Times are known to some units in the last place of T.
      const double blur = 1e-15 * T * std::max(rate, equations.rate(to));
      if (!(place <= tolerance && speed <= tolerance + blur)) {
        return fmt::format("integrated again from t = {:.6g} to {:.6g} it ends {:.1e} of the way off, {:.1e} in speed", t,
                           next, place, speed);
      }
    }
    t = next;
    from = to;
  }
  return {};
}

/// The height of a vertical throw, integrated in time until the bead stops: the independent value of greatest_height.
inline double drag_throw(const drag::Scene& scene) {
  const DragEquations equations(scene);
  // dy/dv = v/(−g + K): from v₀ to 0.
  const auto rate = [&](double v, const std::array<double, 1>&) {
    return std::array<double, 1>{v / (-scene.gravity + equations.K(v))};
  };
  return runge_kutta(rate, scene.speed, 0.0, std::array<double, 1>{0.0}, 1e-13)[0];
}

}  // namespace costate::test
