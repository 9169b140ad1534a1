/// Scenes of the bead with Coulomb friction drawn at random, each solved from the scene alone and integrated again in time
/// by a method that shares nothing with the library. COSTATE_SCENES sets how many;
/// COSTATE_VERBOSE has every scene printed, else only those that went wrong.
#include "coulomb/coulomb_scene.hpp"
#include "coulomb_reference.hpp"
#include "runge_kutta.hpp"

#include <cstdlib>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <numbers>
#include <random>

namespace costate::test {
namespace {

using coulomb::Scene;
using tools::Outcome;

/// x, y, v e^{μb}, λv e^{−μb}; b the slope from straight down.
using State = std::array<double, 4>;

/// The slope at which H(b) = λx v sin b + λy v cos b + λv (cos b − μ sin b) − 1 is greatest, v e^{μb} and λv e^{−μb} held, g
/// = 1. While λv > 0 it is below that at which the first two terms alone would be stationary; λv = 0 at the end is passed by
/// rounding, hence the margin.
double fastest(const State& q, double lambda_x, double lambda_y, double mu) {
  double low = 0.0, high = 1.001 * std::atan2(lambda_x - mu * lambda_y, lambda_y + mu * lambda_x);
  while (true) {
    const double b = 0.5 * (low + high);
    if (b == low || b == high) return b;
    const double sine = std::sin(b), cosine = std::cos(b), grow = std::exp(mu * b);
    const double v = q[2] / grow, lambda_v = q[3] * grow;
    const double slope = v * (lambda_x * cosine - lambda_y * sine - mu * (lambda_x * sine + lambda_y * cosine)) +
                         lambda_v * (mu * (cosine - mu * sine) - sine - mu * cosine);
    (slope > 0.0 ? low : high) = b;
  }
}

/// The end of the extremal of given costates after the time t, in units of L and √(L/g).
State integrate_again(double lambda_x, double lambda_y, double mu, double t, double tolerance) {
  const auto rates = [&](double, const State& q) {
    const double b = fastest(q, lambda_x, lambda_y, mu), sine = std::sin(b), cosine = std::cos(b), grow = std::exp(mu * b);
    const double v = q[2] / grow;
    return State{v * sine, v * cosine, (cosine - mu * sine) * grow, -(lambda_x * sine + lambda_y * cosine) / grow};
  };
  return runge_kutta<4>(rates, 0.0, t, {0.0, 0.0, 0.0, 1.0}, tolerance);
}

/// How far the end of a solution is from where it should be, and how far what the solution claims of its errors lets it be.
struct Miss {
  double error = 0.0, allowed = 0.0;
};

/// `end` maps (λx, λy, t) to numbers that should vanish; `noise` is what its own computation may be off by.
template <class End>
Miss miss(const Outcome& outcome, double lambda_unit, double time_unit, double noise, const End& end) {
  const auto lambda = [&](const char* name) { return outcome[name].value * lambda_unit; };
  const double x = lambda("lambda_x"), y = lambda("lambda_y"), t = outcome["final_time"].value / time_unit;
  const auto there = end(x, y, t);
  // So small that λv is hardly below zero at the end, beyond which H has no maximum.
  constexpr double shift = 1e-10;
  const double size_x = std::abs(x), size_y = std::max(std::abs(y), 1e-3 * std::abs(x));
  const auto moved_x = end(x + shift * size_x, y, t), moved_y = end(x, y + shift * size_y, t),
             moved_t = end(x, y, t * (1.0 + shift));
  Miss result;
  for (std::size_t i = 0; i < there.size(); ++i) {
    const double relative_x = outcome["lambda_x"].error_bound * lambda_unit / size_x;
    const double relative_y = outcome["lambda_y"].error_bound * lambda_unit / size_y;
    const double relative_t = outcome["final_time"].error_bound / time_unit / t;
    // Costates are doubles: what rounds off them moves the end too.
    constexpr double rounding = 4e-16;
    const double allowed = noise + (std::abs(moved_x[i] - there[i]) * (relative_x + rounding) +
                                    std::abs(moved_y[i] - there[i]) * (relative_y + rounding) +
                                    std::abs(moved_t[i] - there[i]) * (relative_t + rounding)) /
                                       shift;
    if (std::abs(there[i]) / allowed > result.error / std::max(result.allowed, 1e-300))
      result = {std::abs(there[i]), allowed};
  }
  return result;
}

struct Counts {
  int solved = 0, infeasible = 0, failed = 0, wrong = 0;
};

TEST(CoulombSweep, RandomScenesAreSolvedAndIntegrateAgain) {
  const char* wanted = std::getenv("COSTATE_SCENES");
  const int scenes = wanted != nullptr ? std::atoi(wanted) : 40;
  ASSERT_GT(scenes, 0);
  std::mt19937_64 random(2501'18622);
  const auto within = [&](double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); };
  Counts counts;
  std::string table;
  double worst_condition = 0.0, worst_seconds = 0.0, worst_flow = 0.0, loosest = 0.0;
  long worst_newton = 0;
  for (int i = 0; i < scenes; ++i) {
    const double span = std::pow(10.0, within(-2.0, 2.0)), chord = std::pow(10.0, within(-3.0, 3.0));
    const double kind = within(0.0, 1.0), part = kind < 0.05 ? 0.0 : kind < 0.92 ? within(0.0, 0.99) : within(1.0, 1.5);
    const Scene scene{chord * span, span, std::pow(10.0, within(-1.0, 2.0)), part * chord};
    const std::string line = fmt::format("drop {:.6g} span {:.6g} gravity {:.6g} mu {:.6g} (of H/L: {:.4f})", scene.drop,
                                         scene.span, scene.gravity, scene.friction, part);
    const Outcome outcome = coulomb::solve_scene(scene, {.accuracy = 1e-10});
    const bool feasible = scene.friction < scene.drop / scene.span;
    worst_seconds = std::max(worst_seconds, outcome.cost.seconds);
    worst_newton = std::max(worst_newton, outcome.cost.newton_iterations);
    if (!outcome.solved()) {
      const bool right = outcome.status == Outcome::Status::infeasible && !feasible;
      const bool claimed = outcome.status == Outcome::Status::infeasible;
      ++(right ? counts.infeasible : claimed ? counts.wrong : counts.failed);
      if (!right) table += fmt::format("  {} {}: {}\n", claimed ? "WRONG" : "failed", line, outcome.message);
      continue;
    }
    worst_condition = std::max(worst_condition, outcome.solution.certificate.condition);
    const double time_unit = std::sqrt(scene.span / scene.gravity), lambda_unit = scene.span / time_unit,
                 mu = scene.friction;
    const double fall = scene.drop / scene.span;
    constexpr double tolerance = 1e-11;
    const Miss flow = miss(outcome, lambda_unit, time_unit, 100.0 * tolerance, [&](double x, double y, double t) {
      const State end = integrate_again(x, y, mu, t, tolerance);
      const double largest_speed = std::sqrt(2.0 * fall);
      return std::array<double, 3>{end[0] - 1.0, (end[1] - fall) / std::max(1.0, fall),
                                   end[3] / (1.0 + std::abs(y)) / largest_speed};
    });
    const Miss closed = miss(outcome, lambda_unit, time_unit, 1e-13, [&](double x, double y, double t) {
      const CoulombEnd end = coulomb_closed_form({fall, 1.0, 1.0, mu}, x, y);
      return std::array<double, 3>{static_cast<double>(end.x) - 1.0,
                                   static_cast<double>(end.y) / std::max(1.0, fall) - std::min(fall, 1.0),
                                   static_cast<double>(end.t) / t - 1.0};
    });
    worst_flow = std::max(worst_flow, flow.error);
    loosest = std::max(loosest, flow.allowed);
    const bool good = feasible && flow.error <= flow.allowed && closed.error <= closed.allowed;
    ++(good ? counts.solved : counts.wrong);
    for (const coulomb::Curve curve : coulomb::curves) {
      const coulomb::Descent descent = descend(curve, scene);
      EXPECT_EQ(descent.end == coulomb::Descent::End::arrives,
                curve == coulomb::Curve::gladkov ? scene.friction <= descent.limit : scene.friction < descent.limit)
          << name_of(curve) << ": " << line;
      if (descent.end != coulomb::Descent::End::arrives) continue;
      EXPECT_GE(descent.final_time + descent.time_bound + outcome["final_time"].error_bound, outcome["final_time"].value)
          << name_of(curve) << " is faster than the optimum: " << line;
    }
    if (!good) {
      table += fmt::format("  WRONG {}: integrated again {:.1e} (allowed {:.1e}), closed form {:.1e} (allowed {:.1e})\n",
                           line, flow.error, flow.allowed, closed.error, closed.allowed);
    }
    if (std::getenv("COSTATE_VERBOSE") != nullptr) {
      table += fmt::format("  {}: flow {:.1e} ({:.1e}), closed {:.1e} ({:.1e}), condition {:.2f}\n", line, flow.error,
                           flow.allowed, closed.error, closed.allowed, outcome.solution.certificate.condition);
    }
  }
  fmt::print(
      "{} scenes: {} solved, {} rightly infeasible, {} failed, {} wrong\n{}"
      "condition at most {:.3g}, {} Newton iterations and {:.2g} s a scene at most; integrated again the end is missed by "
      "at most "
      "{:.1e} of the span or drop (allowed at most {:.1e})\n",
      scenes, counts.solved, counts.infeasible, counts.failed, counts.wrong, table, worst_condition, worst_newton,
      worst_seconds, worst_flow, loosest);
  EXPECT_EQ(counts.wrong, 0);
  EXPECT_LE(counts.failed, scenes / 100);
  EXPECT_GE(counts.solved, scenes / 2);
  EXPECT_LT(worst_seconds, 1.0);
}

}  // namespace
}  // namespace costate::test
