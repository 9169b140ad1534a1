// Singular arcs, state constraints, functions of the ends: problems in a page, against closed forms and published values.
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

/// x' = v, v' = u, L = u²/2.
struct DoubleIntegrator {
  static constexpr int states = 2, controls = 1, parameters = 0;
  template <class S>
  Vec<S, 2> dynamics(const Vec<S, 2>& q, const Vec<S, 1>& u, const Vec<S, 0>&) const {
    return {q[1], u[0]};
  }
  template <class S>
  S cost(const Vec<S, 2>&, const Vec<S, 1>& u, const Vec<S, 0>&) const {
    return 0.5 * u[0] * u[0];
  }
};

/// x(0) = x(1) = 0, v(0) = 1 = −v(1), x ≤ l. Bryson & Ho, §3.11, example 2.
ControlProblem<DoubleIntegrator> bryson_denham(double limit) {
  ControlProblem problem(DoubleIntegrator{});
  problem.state("x", {.start = 0.0, .end = 0.0, .costate = -10.0}).state("v", {.start = 1.0, .end = -1.0, .costate = -5.0});
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

/// x' = u, L = x².
struct Turnpike {
  static constexpr int states = 1, controls = 1, parameters = 0;
  template <class S>
  Vec<S, 1> dynamics(const Vec<S, 1>&, const Vec<S, 1>& u, const Vec<S, 0>&) const {
    return {u[0]};
  }
  template <class S>
  S cost(const Vec<S, 1>& q, const Vec<S, 1>&, const Vec<S, 0>&) const {
    return q[0] * q[0];
  }
};

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

/// (x, y, vx, vy)' = (vx, vy, a cos u, a sin u).
struct Thrust {
  static constexpr int states = 4, cyclic = 2, controls = 1, parameters = 1;
  template <class S>
  Vec<S, 4> dynamics(const Vec<S, 4>& q, const Vec<S, 1>& u, const Vec<S, 1>& a) const {
    return {q[2], q[3], a[0] * cos(u[0]), a[0] * sin(u[0])};
  }
};

// Betts, Practical Methods for Optimal Control, 2nd ed., example 4.4.
TEST(ControlProblem, LinearTangentSteering) {
  ControlProblem problem(Thrust{});
  problem.state("x", {.start = 0.0}).state("y", {.start = 0.0, .end = 5.0});
  problem.state("vx", {.start = 0.0, .end = 45.0, .costate = 0.01}).state("vy", {.start = 0.0, .end = 0.0, .costate = 0.005});
  problem.control("steering", {.unit = "rad"}).parameter("thrust", 100.0).free_final_time(0.5).interior();
  const Solution s = solved(problem.shared());
  EXPECT_NEAR(s["final_time"].value, 0.554570878334603, 1e-10);
}

/// The rocket of Goddard. r' = v, v' = (u T − D)/m − 1/r², m' = −b T u, D = 310 v² exp(−500 (r − 1)).
struct Goddard {
  static constexpr int states = 3, controls = 1, parameters = 0;
  template <class S>
  Vec<S, 3> dynamics(const Vec<S, 3>& q, const Vec<S, 1>& u, const Vec<S, 0>&) const {
    const auto& [r, v, m] = q;
    const S thrust = 3.5 * u[0], drag = 310.0 * v * v * exp(-500.0 * (r - 1.0));
    return {v, (thrust - drag) / m - 1.0 / (r * r), -2.0 * thrust};
  }
  template <class S>
  S cost(const Vec<S, 3>&, const Vec<S, 1>&, const Vec<S, 0>&) const {
    return S(0.0);
  }
};

// Published as the tutorial problem of OptimalControl.jl: the four durations, and the height reached.
TEST(ControlProblem, GoddardAlongASingularArcAndASpeedLimit) {
  ControlProblem problem(Goddard{});
  problem.state("r", {.start = 1.0, .costate = 3.9457646587}).state("v", {.start = 0.0, .costate = 0.15039559623});
  problem.state("m", {.start = 1.0, .end = 0.6, .costate = 0.05371271294}).control("thrust", {.lower = 0.0, .upper = 1.0});
  problem.free_final_time(0.2).terminal_cost([](const auto& at) { return -at.end[0]; });
  problem.constraint("speed", [](const auto& q, const auto&) { return q[1] - 0.1; });
  problem.upper({.duration = 0.0235}).singular({.duration = 0.0362}).boundary("speed", {.duration = 0.0418}).lower();
  const Solution s = solved(problem.shared(), 1e-8);
  for (auto* l : {&s.unknowns, &s.reports}) for (auto& q : *l) printf("%s %.15g  %.2g\n", q.name.c_str(), q.value, q.error_bound);
  for (auto& c: s.certificate.checks) printf("%s %.3g\n", c.name.c_str(), c.worst); printf("cond %g secs %g it %ld\n", s.certificate.condition, s.cost.seconds, s.cost.newton_iterations);
  EXPECT_NEAR(s["cost"].value, -1.0125763246569, 1e-10);
  EXPECT_NEAR(s["final_time"].value, 0.20204744057148, 1e-8);
}

}  // namespace
}  // namespace costate
