// Optimal-control problems stated in a page, against closed forms.
#include "direct_problems.hpp"

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

// x = 3t² − 2t³: u = 6 − 12t, J = 6.
TEST(ControlProblem, EnergyOptimalTransfer) {
  ControlProblem problem(DoubleIntegrator{});
  problem.state("x", {.start = 0.0, .end = 1.0})
      .state("v", {.start = 0.0, .end = 0.0})
      .control("u")
      .final_time(1.0)
      .interior();
  const Solution s = solved(problem.shared());
  expect_result(s, "cost", 6.0);
  expect_result(s, "lambda_x", 12.0);
  expect_result(s, "lambda_v", 6.0);
  EXPECT_NEAR(s.at(0.25)[4], 3.0, 10 * accuracy);
}

TEST(ControlProblem, TimeOptimalTransfer) {
  ControlProblem problem(TimeOptimal{});
  problem.state("x", {.start = 0.0, .end = 1.0})
      .state("v", {.start = 0.0, .end = 0.0})
      .control("u", {.lower = -1.0, .upper = 1.0});
  problem.free_final_time(1.5).upper().lower();
  const Solution s = solved(problem.shared());
  expect_result(s, "final_time", 2.0);
  expect_result(s, "t1", 1.0);
  expect_result(s, "cost", 2.0);
}

// With slope p₁ and 2t₁ = 1 − 10/p₁: both rows are quadratics in t₁, whose root is (1 − √0.6)/2.
TEST(ControlProblem, BoundedEnergyOptimalTransfer) {
  ControlProblem problem(DoubleIntegrator{});
  problem.state("x", {.start = 0.0, .end = 1.0})
      .state("v", {.start = 0.0, .end = 0.0})
      .control("u", {.lower = -5.0, .upper = 5.0});
  problem.final_time(1.0).upper().interior().lower();
  const Solution s = solved(problem.shared());
  const double p = std::sqrt(500.0 / 3.0);
  expect_result(s, "lambda_x", p);
  expect_result(s, "lambda_v", 0.5 * p);
  expect_result(s, "t1", 0.5 - 5.0 / p);
  expect_result(s, "cost", 25.0 * (0.5 - 5.0 / p) + 125.0 / (3.0 * p));
}

}  // namespace
}  // namespace costate
