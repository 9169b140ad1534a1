// Terminal costs, end conditions, free ends, several controls, parameters: problems in a page, against closed forms.
#include <costate/control_problem.hpp>
#include <costate/shooting/solve.hpp>

#include <gtest/gtest.h>

namespace costate {
namespace {

constexpr double accuracy = 1e-10;

Solution solved(const std::shared_ptr<const Problem>& problem) {
  Solution s = solve(problem, {.accuracy = accuracy});
  EXPECT_TRUE(s.solved()) << s.message;
  return s;
}

/// A named result is right within the accuracy asked for, relative above 1.
void expect_result(const Solution& s, const std::string& name, double value) {
  EXPECT_NEAR(s[name].value, value, accuracy * std::max(1.0, std::abs(value))) << name;
}

/// x' = u, L = u²/2 + c, with parameters (c, w).
struct Integrator {
  static constexpr int states = 1, controls = 1, parameters = 2;
  template <class S>
  Vec<S, 1> dynamics(const Vec<S, 1>&, const Vec<S, 1>& u, const Vec<S, 2>&) const {
    return {u[0]};
  }
  template <class S>
  S cost(const Vec<S, 1>&, const Vec<S, 1>& u, const Vec<S, 2>& p) const {
    return 0.5 * u[0] * u[0] + p[0];
  }
};

ControlProblem<Integrator> integrator(double c, double w) {
  ControlProblem problem(Integrator{});
  problem.control("u").parameter("c", c).parameter("w", w);
  return problem;
}

// Φ = w (x(1) − 1)²/2: u = λ = w (1 − u), J = w/(2(1 + w)).
TEST(EndsOfAProblem, TerminalCost) {
  const double w = 3.0;
  auto problem = integrator(0.0, w);
  problem.state("x", {.start = 0.0}).final_time(1.0).interior();
  problem.terminal_cost([](const auto& at) { return 0.5 * at.parameters[1] * (at.end[0] - 1.0) * (at.end[0] - 1.0); });
  const Solution s = solved(problem.shared());
  expect_result(s, "lambda_x", w / (1.0 + w));
  expect_result(s, "cost", 0.5 * w / (1.0 + w));
}

// Φ = w (x(0) − 1)²/2, x(1) = 0: the same, mirrored.
TEST(EndsOfAProblem, CostOfAFreeStart) {
  const double w = 3.0;
  auto problem = integrator(0.0, w);
  problem.state("x", {.end = 0.0}).final_time(1.0).interior();
  problem.terminal_cost([](const auto& at) { return 0.5 * at.parameters[1] * (at.start[0] - 1.0) * (at.start[0] - 1.0); });
  const Solution s = solved(problem.shared());
  expect_result(s, "x_start", w / (1.0 + w));
  expect_result(s, "lambda_x", -w / (1.0 + w));
  expect_result(s, "cost", 0.5 * w / (1.0 + w));
}

// Φ = (x(0) − 1)²/2 + (x(1) + 1)²/2 and x(1) = x(0) ²: a condition that ties both ends. With x₀ = a, x₁ = a², J is the polynomial
// ((a − 1)² + (a² + 1)² + (a² − a)²)/2, whose least value is where 4a³ − 3a² + 4a − 1 = 0.
TEST(EndsOfAProblem, ConditionOnBothEnds) {
  const auto slope = [](const auto& a, const auto&) { return 4.0 * a * a * a - 3.0 * a * a + 4.0 * a - 1.0; };
  const double a = guarded_root(slope, std::array<double, 0>{}, 0.0, 1.0), b = a * a;
  auto problem = integrator(0.0, 0.0);
  problem.state("x", {}).final_time(1.0).interior();
  problem.terminal_cost([](const auto& at) {
    return 0.5 * ((at.start[0] - 1.0) * (at.start[0] - 1.0) + (at.end[0] + 1.0) * (at.end[0] + 1.0));
  });
  problem.end_condition("square", [](const auto& at) { return at.end[0] - at.start[0] * at.start[0]; });
  const Solution s = solved(problem.shared());
  expect_result(s, "x_start", a);
  expect_result(s, "lambda_x", b - a);
  expect_result(s, "multiplier of square", -(b - a) - (b + 1.0));
  expect_result(s, "cost", 0.5 * ((a - 1.0) * (a - 1.0) + (b + 1.0) * (b + 1.0) + (b - a) * (b - a)));
}

// A target that moves, x(T) = 2 + T, at J = T + (2 + T)²/(2T): least at T = 2/√3, with H(T) = −σ. The equations have a second root, with
// T = −2/√3: the guess of x(T) tells them apart.
TEST(EndsOfAProblem, ConditionOnTheFreeFinalTime) {
  auto problem = integrator(1.0, 0.0);
  problem.state("x", {.start = 0.0, .guess = 2.0}).free_final_time(1.0).interior();
  problem.end_condition("target", [](const auto& at) { return at.end[0] - 2.0 - at.time; });
  const Solution s = solved(problem.shared());
  const double T = 2.0 / std::sqrt(3.0);
  expect_result(s, "final_time", T);
  expect_result(s, "cost", T + (2.0 + T) * (2.0 + T) / (2.0 * T));
  expect_result(s, "multiplier of target", -(2.0 + T) / T);
}

/// q' = u in the plane, L = (u₁⁴ + u₂⁴)/4 + u₁² + u₁u₂ + u₂².
struct Plane {
  static constexpr int states = 2, controls = 2, parameters = 0;
  template <class S>
  Vec<S, 2> dynamics(const Vec<S, 2>&, const Vec<S, 2>& u, const Vec<S, 0>&) const {
    return u;
  }
  template <class S>
  S cost(const Vec<S, 2>&, const Vec<S, 2>& u, const Vec<S, 0>&) const {
    const auto& [a, b] = u;
    return 0.25 * (a * a * a * a + b * b * b * b) + a * a + a * b + b * b;
  }
};

// Constant controls (1, 2): λ = L_u = (5, 13), J = 17/4 + 7.
TEST(SeveralControls, InteriorMaximumByNewtonsMethod) {
  ControlProblem problem(Plane{});
  problem.state("x", {.start = 0.0, .end = 1.0}).state("y", {.start = 0.0, .end = 2.0}).control("a").control("b");
  problem.final_time(1.0).interior();
  const Solution s = solved(problem.shared());
  expect_result(s, "lambda_x", 5.0);
  expect_result(s, "lambda_y", 13.0);
  expect_result(s, "cost", 11.25);
}

/// Two masses on rails, xᵢ'' = uᵢ, in minimum time.
struct TwoMasses {
  static constexpr int states = 4, cyclic = 2, controls = 2, parameters = 0;
  template <class S>
  Vec<S, 4> dynamics(const Vec<S, 4>& q, const Vec<S, 2>& u, const Vec<S, 0>&) const {
    return {q[2], q[3], u[0], u[1]};
  }
};

// The first from rest to rest over 1 with |u| ≤ 1, the second left alone: T = 2 with a switch at 1.
ControlProblem<TwoMasses> one_of_two_masses() {
  ControlProblem problem(TwoMasses{});
  problem.state("x", {.start = 0.0, .end = 1.0}).state("y", {.start = 0.0});
  problem.state("vx", {.start = 0.0, .end = 0.0}).state("vy", {.start = 0.0});
  problem.control("ux", {.lower = -1.0, .upper = 1.0}).control("uy").free_final_time(1.8);
  return problem;
}

TEST(SeveralControls, BangsWithContinuousHamiltonian) {
  auto problem = one_of_two_masses();
  problem.constant({1.0, 0.0}).constant({-1.0, 0.0});
  const Solution s = solved(problem.shared());
  expect_result(s, "t1", 1.0);
  expect_result(s, "final_time", 2.0);
  expect_result(s, "lambda_x", 1.0);
  expect_result(s, "lambda_y", 0.0);
}

TEST(SeveralControls, JunctionRowOfTheUsersOwn) {
  auto problem = one_of_two_masses();
  problem.constant({1.0, 0.0});
  problem.junction("first switch", [](const auto& at) { return at.costate[2] * (at.before[0] - at.after[0]); });
  problem.constant({-1.0, 0.0});
  const auto stated = problem.shared();
  EXPECT_EQ(stated->rows().front().name, "first switch at t1");
  expect_result(solved(stated), "t1", 1.0);
}

}  // namespace
}  // namespace costate
