/// \file
/// An independent opinion on a solution of the rolling disk: Pontryagin's equations in time, integrated forward by other means, with
/// nothing taken over but the constants, the start, the junction times and the kinds of the arcs.
#pragma once

#include "runge_kutta.hpp"

#include <costate/models/disk.hpp>
#include <costate/shooting/solution.hpp>

#include <fmt/format.h>
#include <string>
#include <vector>

namespace costate::test {

/// The arcs of a problem: F free, C saturated, B boundary.
inline std::string letters(const Problem& problem) {
  std::string text;
  for (const std::string& arc : problem.structure()) text += arc == "free" ? 'F' : arc == "saturated" ? 'C' : 'B';
  return text;
}

/// What is wrong with a solution, or nothing. Lengths in units of L, times of L/c₁, turned left; `tolerance` is that of the checks.
inline std::string disk_objection(const disk::Scene& scene, const Solution& solution, double tolerance) {
  const double L = scene.radius / std::sqrt(6.0), T = L / scene.speed;
  const double side = scene.heading < 0.0 ? -1.0 : 1.0;
  const double lx = solution["lambda_x"].value * scene.speed, ly = side * solution["lambda_y"].value * scene.speed;
  const double kappa = scene.friction ? *scene.friction * scene.gravity * L / (scene.speed * scene.speed) : 1e300;

  using State = std::array<double, 6>;  // x, y, φ, λφ, V, V'
  const std::vector<std::string>& arcs = solution.problem->structure();
  std::vector<double> times{0.0};
  for (std::size_t i = 1; i < arcs.size(); ++i) times.push_back(solution[fmt::format("t{}", i)].value / T);
  times.push_back(solution.final_time() / T);
  State z{0.0, 0.0, 0.0, side * solution["lambda_phi0"].value / T, solution["V0"].value / scene.speed, 0.0};
  double Omega = side * solution["Omega0"].value * T;

  const auto along = [&](const State& q) { return lx * std::cos(q[2]) + ly * std::sin(q[2]); };
  const auto across = [&](const State& q) { return ly * std::cos(q[2]) - lx * std::sin(q[2]); };
  for (std::size_t i = 0; i < arcs.size(); ++i) {
    const std::string at = fmt::format("arc {} ({})", i + 1, arcs[i]);
    if (!(times[i + 1] > times[i])) return at + ": no duration";
    const bool free = arcs[i] == "free", saturated = arcs[i] == "saturated";
    // V' of the arc as the solution has it just inside; only its sign is used.
    const double inside = std::lerp(times[i], times[i + 1], 1e-3) * T;
    const auto columns = solution.problem->columns();
    const auto place = static_cast<std::size_t>(
        std::find_if(columns.begin(), columns.end(), [](const Column& c) { return c.name == "V_dot"; }) - columns.begin());
    const double sign = solution.at(inside)[place] < 0.0 ? -1.0 : 1.0;
    if (saturated) {
      const double rest = kappa * kappa - z[4] * z[4] * (1.0 - z[4] * z[4]);
      if (rest < -tolerance) return fmt::format("{}: friction beyond its limit at the start by {:.3g}", at, -rest);
      z[5] = sign * std::sqrt(std::max(0.0, rest));
    } else if (!free) {
      const double excess = std::abs(z[4]) * std::sqrt(1.0 - z[4] * z[4]) - kappa;
      if (std::abs(excess) > tolerance) return fmt::format("{}: friction is off its limit by {:.3g}", at, excess);
    }
    const double turn = free ? 1.0 : Omega < 0.0 ? -1.0 : 1.0;
    const auto rates = [&](double, const State& q) -> State {
      const double A = along(q), B = across(q);
      if (free) {
        const double norm = std::hypot(A, q[3]), V = A / norm;
        return {V * std::cos(q[2]), V * std::sin(q[2]), q[3] / norm, -V * B, 0.0, 0.0};
      }
      const double V = q[4], W = turn * std::sqrt(std::max(0.0, 1.0 - V * V));
      const double V_rate = saturated ? q[5] : 0.0;
      return {V * std::cos(q[2]), V * std::sin(q[2]), W, -V * B, V_rate, saturated ? V * (2.0 * V * V - 1.0) : 0.0};
    };
    if (free) {
      const double A = along(z);
      if (std::abs(A * A + z[3] * z[3] - 1.0) > tolerance)
        return fmt::format("{}: H is {:.3g}", at, A * A + z[3] * z[3] - 1.0);
      if (std::abs(A - z[4]) > tolerance) return fmt::format("{}: V jumps by {:.3g}", at, A - z[4]);
    }
    constexpr int looks = 200;
    for (int j = 0; j < looks; ++j) {
      z = runge_kutta(rates, std::lerp(times[i], times[i + 1], static_cast<double>(j) / looks),
                      std::lerp(times[i], times[i + 1], (j + 1.0) / looks), z, 1e-10);
      if (free) {
        z[4] = along(z);
        Omega = z[3];
        const double used = std::hypot(lx, ly) * std::abs(z[3]);
        if (used > kappa + tolerance) return fmt::format("{}: friction beyond its limit by {:.3g}", at, used - kappa);
        continue;
      }
      Omega = turn * std::sqrt(std::max(0.0, 1.0 - z[4] * z[4]));
      const double S = 1.0 - along(z) * z[4] - z[3] * Omega;
      if (S < -tolerance) return fmt::format("{}: S is {:.3g}", at, S);
      if (saturated) {
        const double used = std::hypot(z[5], z[4] * Omega);
        if (std::abs(used - kappa) > tolerance)
          return fmt::format("{}: friction is off its limit by {:.3g}", at, used - kappa);
        if (z[5] * sign < -tolerance) return at + ": V' changes its sign";
      } else {
        // λ_V vanishes on the arc, and λ_V' = −H_V must not drive V across the limit.
        const double G = along(z) - z[3] * z[4] / Omega;
        const double outward = (z[4] * z[4] > 0.5 ? -1.0 : 1.0) * (z[4] < 0.0 ? -1.0 : 1.0) * G;
        if (outward < -tolerance || std::abs(S) > tolerance)
          return fmt::format("{}: multiplier {:.3g}, S {:.3g}", at, outward, S);
      }
    }
    if (saturated) {
      const double S = 1.0 - along(z) * z[4] - z[3] * Omega;
      if (std::abs(S) > tolerance) return fmt::format("{}: S is {:.3g} at its end", at, S);
    }
  }
  const double miss = std::max(
      {std::abs(z[0] - scene.x / L), std::abs(z[1] - side * scene.y / L), std::abs(z[2] - side * scene.heading)});
  return miss > tolerance ? fmt::format("misses the end by {:.3g}", miss) : "";
}

}  // namespace costate::test
