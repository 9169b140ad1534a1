// Singular arcs, constraints, laws of the user's own: problems in a page, against closed forms and published values.
#include "direct_problems.hpp"

#include <costate/control_problem.hpp>
#include <costate/shooting/solve.hpp>

#include <gtest/gtest.h>

namespace costate {
namespace {

constexpr double accuracy = 1e-10;

Solution solved(const std::shared_ptr<const Problem>& problem, double wanted = accuracy) {
  Solution s = solve(problem, {.accuracy = wanted});
  EXPECT_TRUE(s.solved()) << s.message;
  return s;
}

/// A named result is right within the accuracy asked for, relative above 1.
void expect_result(const Solution& s, const std::string& name, double value) {
  EXPECT_NEAR(s[name].value, value, accuracy * std::max(1.0, std::abs(value))) << name;
}

/// x(0) = x(1) = 0, v(0) = 1 = −v(1), x ≤ l. Bryson & Ho, §3.11, example 2.
ControlProblem<DoubleIntegrator> bryson_denham(double limit) {
  ControlProblem problem(DoubleIntegrator{});
  problem.state("x", {.start = 0.0, .end = 0.0}).state("v", {.start = 1.0, .end = -1.0});
  problem.control("u").final_time(1.0);
  problem.constraint("height", [limit](const auto& q, const auto&) { return q[0] - limit; });
  return problem;
}

// l ≤ 1/6: u = −(2/3l)(1 − t/3l) until 3l, zero until 1 − 3l; J = 4/(9l).
TEST(ControlProblem, BrysonDenhamAlongItsConstraint) {
  const double l = 1.0 / 9.0;
  auto problem = bryson_denham(l);
  problem.interior().boundary("height").interior();
  const Solution s = solved(problem.shared());
  expect_result(s, "t1", 3.0 * l);
  expect_result(s, "t2", 1.0 - 3.0 * l);
  expect_result(s, "cost", 4.0 / (9.0 * l));
  expect_result(s, "lambda_x", -2.0 / (9.0 * l * l));
  // λ_x = −u' jumps from one arc's slope to the other's; on the boundary λ_v = λ_x (t2 − t), from 0 before it to 0 after.
  expect_result(s, "multiplier of height at t1", 4.0 / (9.0 * l * l));
  expect_result(s, "second multiplier of height at t1", 2.0 / (9.0 * l * l) * (1.0 - 6.0 * l));
}

// 1/6 ≤ l ≤ 1/4: on [0, 1/2] the cubic from (0, 1) to (l, 0), u = a + b t with a = 24 l − 8 and b = 24 − 96 l, then its mirror image.
// λ_x = −u' jumps from −b to b.
TEST(ControlProblem, BrysonDenhamAtATouchPoint) {
  const double l = 0.2;
  auto problem = bryson_denham(l);
  problem.interior().touch("height").interior();
  const Solution s = solved(problem.shared());
  const double a = 24.0 * l - 8.0, b = 24.0 - 96.0 * l;
  expect_result(s, "t1", 0.5);
  expect_result(s, "cost", (a * a + a * b / 2.0 + b * b / 12.0) / 2.0);
  expect_result(s, "lambda_x", -b);
  expect_result(s, "multiplier of height at t1", 2.0 * b);
}

ControlProblem<TimeOptimal> rest_to_rest(double guess) {
  ControlProblem problem(TimeOptimal{});
  problem.state("x", {.start = 0.0, .end = 1.0}).state("v", {.start = 0.0, .end = 0.0});
  problem.control("u", {.lower = -1.0, .upper = 1.0}).free_final_time(guess);
  return problem;
}

// v ≤ w: T = 1/w + w, t1 = w, t2 = 1/w. On the boundary λ_v falls from λ_x (t2 − t1) to 0; H = 0 at the end: λ_x w = 1.
TEST(ControlProblem, SpeedLimitOfOrderOne) {
  const double w = 0.5;
  auto problem = rest_to_rest(3.0);
  problem.constraint("speed", [w](const auto& q, const auto&) { return q[1] - w; });
  problem.upper().boundary("speed").lower();
  const Solution s = solved(problem.shared());
  expect_result(s, "t1", w);
  expect_result(s, "t2", 1.0 / w);
  expect_result(s, "final_time", 1.0 / w + w);
  expect_result(s, "lambda_x", 1.0 / w);
  expect_result(s, "multiplier of speed at t1", (1.0 / w - w) / w);
}

// u + v ≤ 1: v = 1 − exp(−t), then v falls at rate 1. With d the duration of braking, exp(−t1) = 1 − d and
// x = t1 − d + d²/2 = 1: −log(1 − d) = 1 + d − d²/2.
TEST(ControlProblem, MixedConstraintThenBang) {
  const auto f = [](const auto& d, const auto&) { return -log(1.0 - d) - 1.0 - d + 0.5 * d * d; };
  const double d = guarded_root(f, std::array<double, 0>{}, 0.1, 0.99);
  auto problem = rest_to_rest(2.5);
  problem.mixed("thrust", [](const auto& q, const auto& u, const auto&) { return u[0] + q[1] - 1.0; });
  problem.boundary("thrust").lower();
  const Solution s = solved(problem.shared());
  expect_result(s, "t1", -std::log(1.0 - d));
  expect_result(s, "final_time", d - std::log(1.0 - d));
}

// 2u + 3v ≤ 3: u = 1 until v = 1/3, then v = 1 − (2/3) exp(−(3/2)(t − 1/3)), then u = −1 from v = d on.
TEST(ControlProblem, BangThenMixedConstraintOnTheSameSide) {
  const auto way = [](const auto& d) {
    return 1.0 / 18.0 - log(1.5 * (1.0 - d)) / 1.5 - (2.0 / 3.0) * (d - 1.0 / 3.0) + 0.5 * d * d;
  };
  const auto f = [way](const auto& d, const auto&) { return way(d) - 1.0; };
  const double d = guarded_root(f, std::array<double, 0>{}, 0.34, 0.99);
  auto problem = rest_to_rest(2.5);
  problem.mixed("thrust", [](const auto& q, const auto& u, const auto&) { return 2.0 * u[0] + 3.0 * q[1] - 3.0; });
  problem.upper().boundary("thrust").lower();
  const Solution s = solved(problem.shared());
  expect_result(s, "t1", 1.0 / 3.0);
  expect_result(s, "t2", 1.0 / 3.0 - std::log(1.5 * (1.0 - d)) / 1.5);
}

// u = −1 until x = 0 at t = 1, x = 0 until 3/2, then u = 1: J = 1/3 + 1/24.
TEST(ControlProblem, TurnpikeAlongASingularArc) {
  ControlProblem problem(Turnpike{});
  problem.state("x", {.start = 1.0, .end = 0.5}).control("u", {.lower = -1.0, .upper = 1.0}).final_time(2.0);
  problem.lower().singular().upper();
  const Solution s = solved(problem.shared());
  expect_result(s, "t1", 1.0);
  expect_result(s, "t2", 1.5);
  expect_result(s, "cost", 0.375);
}

// Betts, Practical Methods for Optimal Control, 2nd ed., example 4.4.
ControlProblem<Thrust> linear_tangent_steering() {
  ControlProblem problem(Thrust{});
  problem.state("x", {.start = 0.0}).state("y", {.start = 0.0, .end = 5.0});
  problem.state("vx", {.start = 0.0, .end = 45.0}).state("vy", {.start = 0.0, .end = 0.0});
  problem.control("steering", {.unit = "rad"}).parameter("thrust", 100.0).free_final_time(0.5);
  return problem;
}

TEST(ControlProblem, LinearTangentSteering) {
  auto problem = linear_tangent_steering();
  problem.interior();
  EXPECT_NEAR(solved(problem.shared())["final_time"].value, 0.554570878334603, accuracy);
}

/// The law of the problem above in closed form: tan u = λ_vy/λ_vx.
struct TangentLaw {
  template <class S>
  Vec<S, 1> control(const Vec<S, 4>&, const Vec<S, 4>& costate, const Vec<S, 1>&) const {
    return {atan2(costate[3], costate[2])};
  }
};

TEST(ControlProblem, LawOfTheUsersOwn) {
  auto problem = linear_tangent_steering();
  problem.arc("steering", TangentLaw{});
  EXPECT_NEAR(solved(problem.shared())["final_time"].value, 0.554570878334603, accuracy);
}

// Published with the tutorial of OptimalControl.jl: λ(0), the height reached and the time it takes. No costate is guessed, and no time
// but the final one, to a fiftieth.
TEST(ControlProblem, GoddardAlongASingularArcAndASpeedLimit) {
  ControlProblem problem(Goddard{});
  problem.state("r", {.start = 1.0}).state("v", {.start = 0.0});
  problem.state("m", {.start = 1.0, .end = 0.6}).control("thrust", {.lower = 0.0, .upper = 1.0});
  problem.free_final_time(0.2).terminal_cost([](const auto& at) { return -at.end[0]; });
  problem.constraint("speed", [](const auto& q, const auto&) { return q[1] - 0.1; });
  problem.upper().singular().boundary("speed").lower();
  const Solution s = solved(problem.shared(), 1e-8);
  EXPECT_NEAR(s["lambda_r"].value, 3.9457646587, 4e-8);
  EXPECT_NEAR(s["lambda_v"].value, 0.15039559623, 1e-8);
  EXPECT_NEAR(s["lambda_m"].value, 0.05371271294, 1e-8);
  EXPECT_NEAR(s["cost"].value, -1.0125763246569, 1e-10);
  EXPECT_NEAR(s["final_time"].value, 0.20204744057148, 1e-8);
}

}  // namespace
}  // namespace costate
