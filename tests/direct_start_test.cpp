// Problems stated without any guess: the direct phase alone, and the solutions it leads to.
#include "direct_problems.hpp"

#include <costate/shooting/solve.hpp>

#include <gtest/gtest.h>
#include <numbers>

namespace costate {
namespace {

constexpr double accuracy = 1e-8;

std::vector<double> values(const Problem& problem) {
  std::vector<double> all;
  for (const Parameter& parameter : problem.parameters()) all.push_back(parameter.value);
  return all;
}

Start started(const Problem& problem) {
  auto start = problem.search_start(values(problem));
  if (!start) throw std::runtime_error("no start was found");
  return *start;
}

/// The start's unknowns alone lead to the solution, and are near it already: the midpoint rule has an error of order (1/80)² in costates,
/// and a junction lies within a step of the grid, T/80 long, or two where two arcs begin alike.
Solution solved(const std::shared_ptr<const Problem>& problem, double steps_off = 1.0) {
  const Start start = started(*problem);
  Solution s = solve(problem, start.unknowns, {.accuracy = accuracy});
  EXPECT_TRUE(s.solved()) << s.message;
  if (!s.solved()) return s;
  double costates = 0.0;
  for (const Quantity& unknown : s.unknowns) {
    if (unknown.name.starts_with("lambda")) costates = std::max(costates, std::abs(unknown.value));
  }
  for (std::size_t i = 0; i < s.unknowns.size(); ++i) {
    const Quantity& unknown = s.unknowns[i];
    const double found = start.unknowns[static_cast<Eigen::Index>(i)];
    if (unknown.name.starts_with("lambda")) {
      EXPECT_NEAR(found, unknown.value, 0.03 * costates) << unknown.name;
    }
    // Both ends of an arc may be off.
    if (unknown.name.starts_with("duration")) {
      EXPECT_NEAR(found, unknown.value, 2.0 * steps_off * s.final_time() / 80.0) << unknown.name;
    }
  }
  return s;
}

void expect_result(const Solution& s, const std::string& name, double value) {
  EXPECT_NEAR(s[name].value, value, accuracy * std::max(1.0, std::abs(value))) << name;
}

// u = 6 − 12t.
TEST(DirectStart, EnergyOptimalTransfer) {
  ControlProblem problem(DoubleIntegrator{});
  problem.state("x", {.start = 0.0, .end = 1.0}).state("v", {.start = 0.0, .end = 0.0}).control("u");
  problem.final_time(1.0).interior();
  const Solution s = solved(problem.shared());
  expect_result(s, "cost", 6.0);
  expect_result(s, "lambda_x", 12.0);
}

// See control_problem_test.cpp.
TEST(DirectStart, BoundedEnergyOptimalTransfer) {
  ControlProblem problem(DoubleIntegrator{});
  problem.state("x", {.start = 0.0, .end = 1.0}).state("v", {.start = 0.0, .end = 0.0});
  problem.control("u", {.lower = -5.0, .upper = 5.0}).final_time(1.0).upper().interior().lower();
  const Solution s = solved(problem.shared());
  const double p = std::sqrt(500.0 / 3.0);
  expect_result(s, "t1", 0.5 - 5.0 / p);
  expect_result(s, "cost", 25.0 * (0.5 - 5.0 / p) + 125.0 / (3.0 * p));
}

TEST(DirectStart, TimeOptimalTransferFromAnyTime) {
  for (const double guess : {0.2, 1.0, 5.0, 20.0}) {
    ControlProblem problem(TimeOptimal{});
    problem.state("x", {.start = 0.0, .end = 1.0}).state("v", {.start = 0.0, .end = 0.0});
    problem.control("u", {.lower = -1.0, .upper = 1.0}).free_final_time(guess).upper().lower();
    const Solution s = solved(problem.shared());
    expect_result(s, "final_time", 2.0);
  }
}

// v ≤ w: t = w, then the rest of the way at w, and w to stop. λ_x = 1/w, and the multiplier is λ_x times the time at w. (Were the junctions
// nodes of the grid, as for w = 1/2, the discrete multipliers would not be unique.)
TEST(DirectStart, TimeOptimalTransferWithALimitOfSpeed) {
  const double w = 0.45;
  ControlProblem problem(TimeOptimal{});
  problem.state("x", {.start = 0.0, .end = 1.0}).state("v", {.start = 0.0, .end = 0.0});
  problem.control("u", {.lower = -1.0, .upper = 1.0}).free_final_time(5.0);
  problem.constraint("speed", [w](const auto& q, const auto&) { return q[1] - w; });
  problem.upper().boundary("speed").lower();
  const Solution s = solved(problem.shared());
  expect_result(s, "final_time", w + 1.0 / w);
  expect_result(s, "multiplier of speed at t1", 1.0 / (w * w) - 1.0);
}

TEST(DirectStart, TurnpikeAlongASingularArc) {
  ControlProblem problem(Turnpike{});
  problem.state("x", {.start = 1.0, .end = 0.5}).control("u", {.lower = -1.0, .upper = 1.0}).final_time(2.0);
  problem.lower().singular().upper();
  const Solution s = solved(problem.shared());
  expect_result(s, "t1", 1.0);
  expect_result(s, "cost", 0.375);
}

// See control_problem_arcs_test.cpp. The constraint of order 2 is met tangentially: c is of third order in the time to the entry.
TEST(DirectStart, BrysonDenham) {
  const auto stated = [](double limit) {
    ControlProblem problem(DoubleIntegrator{});
    problem.state("x", {.start = 0.0, .end = 0.0}).state("v", {.start = 1.0, .end = -1.0}).control("u").final_time(1.0);
    problem.constraint("height", [limit](const auto& q, const auto&) { return q[0] - limit; });
    return problem;
  };
  auto along = stated(1.0 / 9.0);
  along.interior().boundary("height").interior();
  const Solution s = solved(along.shared(), 3.0);
  expect_result(s, "cost", 4.0);
  expect_result(s, "multiplier of height at t1", 36.0);
  expect_result(s, "second multiplier of height at t1", 6.0);
  auto touching = stated(0.2);
  touching.interior().touch("height").interior();
  const Solution t = solved(touching.shared());
  expect_result(t, "t1", 0.5);
  expect_result(t, "multiplier of height at t1", 9.6);
}

// Betts, Practical Methods for Optimal Control, 2nd ed., example 4.4. The control has no bounds and no guess.
TEST(DirectStart, LinearTangentSteering) {
  ControlProblem problem(Thrust{});
  problem.state("x", {.start = 0.0}).state("y", {.start = 0.0, .end = 5.0});
  problem.state("vx", {.start = 0.0, .end = 45.0}).state("vy", {.start = 0.0, .end = 0.0});
  problem.control("steering").parameter("thrust", 100.0).free_final_time(1.0).interior();
  const Solution s = solved(problem.shared());
  expect_result(s, "final_time", 0.554570878334603);
}

// Published as the tutorial problem of OptimalControl.jl.
TEST(DirectStart, GoddardAlongASingularArcAndASpeedLimit) {
  for (const double guess : {0.1, 0.4, 1.0}) {
    ControlProblem problem(Goddard{});
    problem.state("r", {.start = 1.0}).state("v", {.start = 0.0}).state("m", {.start = 1.0, .end = 0.6});
    problem.control("thrust", {.lower = 0.0, .upper = 1.0}).free_final_time(guess);
    problem.terminal_cost([](const auto& at) { return -at.end[0]; });
    problem.constraint("speed", [](const auto& q, const auto&) { return q[1] - 0.1; });
    problem.upper().singular().boundary("speed").lower();
    const Solution s = solved(problem.shared(), 2.0);
    expect_result(s, "cost", -1.0125763246569);
    expect_result(s, "final_time", 0.20204744057148);
  }
}

// No closed form: two methods agree, and the certificate of the indirect one holds. The bound is met in between.
TEST(DirectStart, VanDerPolWithABound) {
  ControlProblem problem(VanDerPol{});
  problem.state("x", {.start = 1.0, .end = 0.0}).state("y", {.start = 0.0, .end = 0.0});
  problem.control("u", {.lower = -0.8, .upper = 0.8}).final_time(5.0).interior().upper().interior();
  solved(problem.shared());
}

// From orbit to orbit with a thrust that turns; Bryson & Ho, §2.5 give 1.525 for the radius reached.
TEST(DirectStart, OrbitRaising) {
  ControlProblem problem(OrbitRaising{});
  problem.state("t", {.start = 0.0}).state("r", {.start = 1.0}).state("vr", {.start = 0.0, .end = 0.0});
  problem.state("vt", {.start = 1.0}).control("direction", {.unit = "rad"}).final_time(3.32);
  problem.terminal_cost([](const auto& at) { return -at.end[1]; });
  problem.end_condition("circular", [](const auto& at) { return at.end[3] - 1.0 / sqrt(at.end[1]); }).interior();
  const Solution s = solved(problem.shared());
  EXPECT_NEAR(s["cost"].value, -1.525, 5e-4);
}

// A left turn, a tangent, a right turn of the same angle α; the centres are (4, 1) apart.
TEST(DirectStart, CarWithAStraightLineAsSingularArc) {
  ControlProblem problem(Car{});
  problem.state("x", {.start = 0.0, .end = 4.0}).state("y", {.start = 0.0, .end = 3.0});
  problem.state("heading", {.start = 0.0, .end = 0.0}).control("turn", {.lower = -1.0, .upper = 1.0});
  problem.free_final_time(8.0).upper().singular().lower();
  const Solution s = solved(problem.shared());
  const double turn = std::atan2(1.0, 4.0) + std::asin(2.0 / std::sqrt(17.0));
  expect_result(s, "t1", turn);
  expect_result(s, "final_time", 2.0 * turn + std::sqrt(13.0));
}

// Hanging to upright with too little torque to lift it: it swings back first, which no straight line of states suggests.
// H = −1 − λ_ω/2 = 0 at the start.
TEST(DirectStart, PendulumThatHasToSwing) {
  ControlProblem problem(FastPendulum{});
  problem.state("angle", {.start = 0.0, .end = std::numbers::pi}).state("rate", {.start = 0.0, .end = 0.0});
  problem.control("torque", {.lower = -0.5, .upper = 0.5}).free_final_time(5.0).lower().upper().lower();
  const Solution s = solved(problem.shared());
  expect_result(s, "lambda_rate", -2.0);
}

// The states along the arcs are those of the solution: fractions of the way from 0 to 1, order 2 in between.
TEST(DirectStart, GuessesTheStatesAlongTheArcs) {
  ControlProblem problem(DoubleIntegrator{});
  problem.state("x", {.start = 0.0, .end = 1.0}).state("v", {.start = 0.0, .end = 0.0});
  problem.control("u", {.lower = -5.0, .upper = 5.0}).final_time(1.0).upper().interior().lower();
  const auto shared = problem.shared();
  const Start start = started(*shared);
  const double t1 = start.unknowns[shared->place_of("duration 1")];
  const double p = std::sqrt(500.0 / 3.0);
  for (const double fraction : {0.0, 0.5, 1.0}) {
    const auto z = start.state(0, fraction);
    ASSERT_TRUE(z);
    const double t = fraction * t1;
    EXPECT_NEAR((*z)[0], 2.5 * t * t, 1e-3) << fraction;
    EXPECT_NEAR((*z)[1], 5.0 * t, 1e-2) << fraction;
    EXPECT_NEAR((*z)[3], p * (0.5 - t), 1e-2 * p) << fraction;
  }
}

TEST(DirectStart, IsDeterministic) {
  ControlProblem problem(Thrust{});
  problem.state("x", {.start = 0.0}).state("y", {.start = 0.0, .end = 5.0});
  problem.state("vx", {.start = 0.0, .end = 45.0}).state("vy", {.start = 0.0, .end = 0.0});
  problem.control("steering").parameter("thrust", 100.0).free_final_time(1.0).interior();
  const auto shared = problem.shared();
  EXPECT_EQ(started(*shared).unknowns, started(*shared).unknowns);
}

// The start belongs to the parameters asked for: λ_x = 12 x(T) for T = 1.
TEST(DirectStart, FollowsTheParameters) {
  ControlProblem problem(DoubleIntegrator{});
  problem.state("x", {.start = 0.0, .end = 1.0}).state("v", {.start = 0.0, .end = 0.0}).control("u");
  problem.final_time(1.0).interior();
  const auto shared = problem.shared();
  std::vector<double> parameters = values(*shared);
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    if (shared->parameters()[i].name == "x_end") parameters[i] = 2.0;
  }
  const auto start = shared->search_start(parameters);
  ASSERT_TRUE(start);
  EXPECT_NEAR(start->unknowns[shared->place_of("lambda_x")], 24.0, 0.1);
}

// x' = u, |u| ≤ 1 does not get from 0 to 2 in time 1.
TEST(DirectStart, FindsNothingWhereThereIsNothing) {
  ControlProblem problem(Turnpike{});
  problem.state("x", {.start = 0.0, .end = 2.0}).control("u", {.lower = -1.0, .upper = 1.0}).final_time(1.0);
  problem.upper().lower();
  EXPECT_FALSE(problem.shared()->search_start(values(*problem.shared())));
}

/// x' = u √(x − 2), which is no number at the start.
struct NoNumber {
  static constexpr int states = 1, controls = 1, parameters = 0;
  template <class S>
  Vec<S, 1> dynamics(const Vec<S, 1>& q, const Vec<S, 1>& u, const Vec<S, 0>&) const {
    return {u[0] * sqrt(q[0] - 2.0)};
  }
};

TEST(DirectStart, FindsNothingWhereTheSystemIsNoNumber) {
  ControlProblem problem(NoNumber{});
  problem.state("x", {.start = 0.0, .end = 1.0}).control("u", {.lower = -1.0, .upper = 1.0}).free_final_time(1.0).upper();
  EXPECT_FALSE(problem.shared()->search_start(values(*problem.shared())));
}

}  // namespace
}  // namespace costate
