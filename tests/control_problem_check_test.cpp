// Roots of the rows that are no extremals, and what follows for extremals in other units.
#include "direct_problems.hpp"
#include "small_problems.hpp"

#include <costate/control_problem.hpp>
#include <costate/shooting/solve.hpp>

#include <gtest/gtest.h>

namespace costate {
namespace {

using small::contains;

double worst(const Solution& s, const std::string& check) {
  for (const CheckResult& result : s.certificate.checks) {
    if (result.name == check) return result.worst;
  }
  throw std::runtime_error("no check '" + check + "'");
}

/// x' = u, L = k u²/2.
struct Single {
  double k = 1.0;
  static constexpr int states = 1, controls = 1, parameters = 0;
  template <class S>
  Vec<S, 1> dynamics(const Vec<S, 1>&, const Vec<S, 1>& u, const Vec<S, 0>&) const {
    return {u[0]};
  }
  template <class S>
  S cost(const Vec<S, 1>&, const Vec<S, 1>& u, const Vec<S, 0>&) const {
    return 0.5 * k * u[0] * u[0];
  }
};

// From 0 to 1 at once, u = 1 is optimal; upper, then lower has a root too, with H_u = −k u of the wrong sign: −1 of its terms, whatever k is.
TEST(Check, OfSwitchingFunctionsDoesNotDependOnTheUnitOfTheCost) {
  for (const double k : {1e-12, 1.0, 1e12}) {
    ControlProblem problem(Single{k});
    problem.state("x", {.start = 0.0, .end = 1.0}).control("u", {.lower = -5.0, .upper = 5.0}).final_time(1.0);
    problem.upper().lower();
    const Solution s = solve(problem.shared());
    EXPECT_EQ(s.status, Solution::Status::refused);
    EXPECT_NEAR(worst(s, "H_u of u at its upper bound"), -1.0, 1e-9) << k;
  }
}

// One metre from rest to rest at 1 m/s², in units of time of 1 s, 1 ms and 1000 s: T = 2 s.
TEST(Check, DoesNotDependOnTheUnitOfTime) {
  for (const double unit : {1.0, 1e-3, 1e3}) {
    ControlProblem problem(TimeOptimal{});
    const double most = unit * unit;
    problem.state("x", {.start = 0.0, .end = 1.0}).state("v", {.start = 0.0, .end = 0.0, .scale = unit});
    problem.control("u", {.lower = -most, .upper = most}).free_final_time(1.5 / unit).upper().lower();
    const Solution s = solve(problem.shared());
    ASSERT_TRUE(s.solved()) << unit << ": " << s.message;
    EXPECT_NEAR(s["final_time"].value * unit, 2.0, 1e-7);
  }
}

/// x' = u, s' = 1, L = u²/2 + g(s) x with g < 0 for a while around s = 2.
struct Dip {
  static constexpr int states = 2, controls = 1, parameters = 0;
  template <class S>
  Vec<S, 2> dynamics(const Vec<S, 2>&, const Vec<S, 1>& u, const Vec<S, 0>&) const {
    return {u[0], S(1.0)};
  }
  template <class S>
  S cost(const Vec<S, 2>& q, const Vec<S, 1>& u, const Vec<S, 0>&) const {
    const S z = (q[1] - 2.0) / 0.3;
    return 0.5 * u[0] * u[0] + (4.0 - 6.0 * exp(-z * z)) * q[0];
  }
};

ControlProblem<Dip> dip() {
  ControlProblem problem(Dip{});
  problem.state("x", {.start = 1.0, .end = 1.0}).state("s", {.start = 0.0}).control("u").final_time(4.0);
  problem.constraint("floor", [](const auto& q, const auto&) { return -q[0]; });
  return problem;
}

// On the floor η = g, which is −2 at s = 2: μ = ∫ η falls from the entry to the exit, but not all the way.
TEST(Check, OfTheMultiplierOfAStateConstraintOfOrderOne) {
  auto throughout = dip();
  throughout.interior({.duration = 0.7}).boundary("floor", {.duration = 2.6}).interior();
  EXPECT_FALSE(solve(throughout.shared()).solved());
  auto between = dip();
  between.interior({.duration = 0.7}).boundary("floor", {.duration = 0.8}).interior({.duration = 1.0});
  between.boundary("floor", {.duration = 0.8}).interior();
  const Solution s = solve(between.shared());
  ASSERT_TRUE(s.solved()) << s.message;
  EXPECT_GE(worst(s, "multiplier of floor"), 0.0);
}

// Φ = −a v(T) − 2 x(T), x ≤ 1/5. Along x = 1/5 to the end μ(T) = λ_v(T) = a must vanish: with a > 0 it pays to dip and come back.
TEST(Check, OfAnEndOnAStateConstraintOfOrderTwo) {
  for (const double a : {0.0, 0.3}) {
    ControlProblem problem(DoubleIntegrator{});
    problem.state("x", {.start = 0.0}).state("v", {.start = 0.5}).control("u").final_time(4.0);
    problem.constraint("ceiling", [](const auto& q, const auto&) { return q[0] - 0.2; });
    problem.terminal_cost([a](const auto& at) { return -a * at.end[1] - 2.0 * at.end[0]; });
    problem.interior({.duration = 1.2}).boundary("ceiling");
    const Solution s = solve(problem.shared());
    EXPECT_EQ(s.solved(), a == 0.0) << s.message;
    if (a > 0.0) {
      EXPECT_TRUE(contains(s.message, "multiplier of the arc along ceiling at the end")) << s.message;
    }
  }
}

/// x' = u, L = (u² − 1)².
struct DoubleWell {
  static constexpr int states = 1, controls = 1, parameters = 0;
  template <class S>
  Vec<S, 1> dynamics(const Vec<S, 1>&, const Vec<S, 1>& u, const Vec<S, 0>&) const {
    return {u[0]};
  }
  template <class S>
  S cost(const Vec<S, 1>&, const Vec<S, 1>& u, const Vec<S, 0>&) const {
    const S d = u[0] * u[0] - 1.0;
    return d * d;
  }
};

// Φ = −x(T)/2: λ = 1/2, and H = λ u − L has a maximum near each of u = ±1, the larger one near 1.
TEST(Check, TellsALocalMaximumOfTheHamiltonianFromTheLargest) {
  for (const double guess : {-1.0, 1.0}) {
    ControlProblem problem(DoubleWell{});
    problem.state("x", {.start = 0.0}).control("u", {.lower = -2.0, .upper = 2.0, .guess = guess}).final_time(1.0);
    problem.terminal_cost([](const auto& at) { return -0.5 * at.end[0]; }).interior();
    const Solution s = solve(problem.shared());
    EXPECT_EQ(s.solved(), guess > 0.0) << s.message;
    if (guess < 0.0) {
      EXPECT_TRUE(contains(s.message, "H - H at other controls")) << s.message;
    }
  }
}

// A convex H is largest at a bound, but at one of them only: with L = −u²/2 and λ = 1/2, H(1) = 1 and H(−1) = 0.
TEST(Check, ComparesTheBounds) {
  for (const bool upper : {false, true}) {
    ControlProblem problem(Single{-1.0});
    problem.state("x", {.start = 0.0}).control("u", {.lower = -1.0, .upper = 1.0}).final_time(1.0);
    problem.terminal_cost([](const auto& at) { return -0.5 * at.end[0]; });
    upper ? problem.upper() : problem.lower();
    EXPECT_EQ(solve(problem.shared()).solved(), upper);
  }
}

}  // namespace
}  // namespace costate
