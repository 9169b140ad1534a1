/// Solving to a wanted accuracy: values against closed forms, what a solution can be asked, and every honest way to fail.
#include "small_problems.hpp"

#include <costate/error.hpp>
#include <costate/shooting/solve.hpp>

#include <cmath>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <numbers>

namespace costate {
namespace {

using closed::vector;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using small::contains;
using small::thrown;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

std::shared_ptr<const Problem> least_effort(double speed_limit = 10.0) {
  return std::make_shared<small::LeastEffortTransfer>(1.0, speed_limit);
}
std::shared_ptr<const Problem> time_optimal(bool backward = false) {
  return std::make_shared<small::TimeOptimalTransfer>(backward);
}
std::shared_ptr<const Problem> rotation() { return std::make_shared<small::RotationTransfer>(); }
std::shared_ptr<const Problem> one_row(const std::string& row, small::Equations::RowsOf rows_of) {
  return std::make_shared<small::Equations>(std::vector<Unknown>{{"x"}}, std::vector<Row>{{row}}, std::move(rows_of));
}
std::shared_ptr<const Problem> parabola_without_root() {
  return one_row("parabola", [](Shot& shot) { return std::vector{shot.unknown(0) * shot.unknown(0) + 1.0}; });
}

/// A solution must have the value, and what it claims of its error must be true and no worse than asked.
void expect_known(const Solution& solution, const std::string& name, double value, double accuracy) {
  const Quantity& quantity = solution[name];
  EXPECT_LE(std::abs(quantity.value - value), quantity.error_bound) << name << " at accuracy " << accuracy;
  EXPECT_LE(quantity.error_bound, accuracy * std::max(1.0, std::abs(value))) << name;
}

class Accuracy : public testing::TestWithParam<double> {
 protected:
  static Solution solved(const std::shared_ptr<const Problem>& problem, const VectorXd& start, Method method = Method::adams) {
    Solution solution = solve(problem, start, {.accuracy = GetParam(), .method = method});
    EXPECT_TRUE(solution.solved()) << solution.message;
    EXPECT_TRUE(solution.message.empty());
    EXPECT_TRUE(solution.certificate.holds());
    return solution;
  }
};

TEST_P(Accuracy, IsKeptByLeastEffortTransfer) {
  const Solution solution = solved(least_effort(), vector({1.0, 1.0}));
  expect_known(solution, "lambda_x", 12.0, GetParam());
  expect_known(solution, "lambda_v0", 6.0, GetParam());
  expect_known(solution, "end_lambda_v", -6.0, GetParam());
  expect_known(solution, "final_time", 1.0, GetParam());
}

TEST_P(Accuracy, IsKeptByTimeOptimalTransfer) {
  for (const bool backward : {false, true}) {
    const Solution solution = solved(time_optimal(backward), vector({0.7, 1.4}));
    expect_known(solution, "first duration", 1.0, GetParam());
    expect_known(solution, "second duration", 1.0, GetParam());
    expect_known(solution, "t1", 1.0, GetParam());
    expect_known(solution, "final_time", 2.0, GetParam());
    // A report is that of the corrected root, as the unknowns are.
    EXPECT_NEAR(solution["t1"].value, solution["first duration"].value, 1e-15);
  }
}

TEST_P(Accuracy, IsKeptWhereTimeEntersTheRightHandSide) {
  const Solution solution = solved(rotation(), vector({0.1}));
  const double y0 = small::RotationTransfer::y0();
  const double end_y = std::sin(small::RotationTransfer::angle(1.8)) + y0 * std::cos(small::RotationTransfer::angle(1.8));
  expect_known(solution, "y0", y0, GetParam());
  expect_known(solution, "end_y", end_y, GetParam());
  expect_known(solution, "end_y_by_quadrature", end_y, GetParam());
}

INSTANTIATE_TEST_SUITE_P(Decades, Accuracy,
                         testing::Values(1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12),
                         [](const auto& at) { return fmt::format("Minus{}", std::lround(-std::log10(at.param))); });

TEST(Solve, BackwardDifferentiationKeepsTheAccuracyToo) {
  const SolveOptions options{.accuracy = 1e-6, .method = Method::bdf};
  const Solution transfer = solve(least_effort(), vector({1.0, 1.0}), options);
  ASSERT_TRUE(transfer.solved()) << transfer.message;
  expect_known(transfer, "lambda_x", 12.0, 1e-6);
  const Solution bang = solve(time_optimal(), vector({0.7, 1.4}), options);
  ASSERT_TRUE(bang.solved()) << bang.message;
  expect_known(bang, "final_time", 2.0, 1e-6);
  const Solution turn = solve(rotation(), vector({0.1}), options);
  ASSERT_TRUE(turn.solved()) << turn.message;
  expect_known(turn, "y0", small::RotationTransfer::y0(), 1e-6);
}

// Over many periods the errors of the steps add up to thousands of times their tolerance.
TEST(Solve, ErrorBoundHoldsOnLongArcs) {
  for (const double time : {1.0, 5.0, 20.0, 50.0}) {
    for (const double omega : {0.7, 1.0, 1.3, 1.9}) {
      const auto problem = std::make_shared<small::OscillatorTransfer>(omega, time, 0.5);
      for (const double accuracy : {1e-4, 1e-6, 1e-8, 1e-10, 1e-11}) {
        const Solution solution = solve(problem, vector({0.3}), {.accuracy = accuracy});
        if (!solution.solved()) continue;  // an accuracy that doubles do not reach may be refused
        SCOPED_TRACE(fmt::format("T = {}, omega = {}", time, omega));
        expect_known(solution, "v0", problem->v0(), accuracy);
        expect_known(solution, "end_v", problem->end_v(), accuracy);
      }
    }
  }
}

// 1e-4 before a conjugate point an error of the integration moves the root by ten thousand times as much.
TEST(Solve, ToleranceIsTightenedWhereTheRootIsIllConditioned) {
  const auto problem = std::make_shared<small::OscillatorTransfer>(1.0, std::numbers::pi - 1e-4, -0.99);
  for (const double accuracy : {1e-4, 1e-6, 1e-8}) {
    const Solution solution = solve(problem, vector({50.0}), {.accuracy = accuracy});
    ASSERT_TRUE(solution.solved()) << solution.message;
    EXPECT_NEAR(solution["v0"].value, problem->v0(), accuracy * std::abs(problem->v0()));
    EXPECT_LE(solution["v0"].error_bound, accuracy * std::abs(problem->v0()));
  }
}

TEST(Solve, AccuracyThatDoublesCannotReachIsRefusedWithTheBestBound) {
  const auto problem = std::make_shared<small::OscillatorTransfer>(1.0, std::numbers::pi - 1e-4, -0.99);
  const Solution solution = solve(problem, vector({50.0}), {.accuracy = 1e-12});
  EXPECT_FALSE(solution.solved());
  EXPECT_TRUE(contains(solution.message, "accuracy 1e-12 is not reached: the best error bound is")) << solution.message;
}

// At a root known to ten digits |x − value| is the integration's and the rounding's: 1e-9 is ten times what was asked.
constexpr double trajectory_accuracy = 1e-9;

TEST(Trajectory, IsTheClosedFormOnTheWholeArc) {
  const Solution solution = solve(least_effort(), vector({1.0, 1.0}), {.accuracy = 1e-10});
  ASSERT_TRUE(solution.solved()) << solution.message;
  EXPECT_EQ(solution.final_time(), 1.0);
  for (int i = 0; i <= 101; ++i) {
    const double t = i / 101.0;
    const std::vector<double> at = solution.at(t);
    ASSERT_EQ(at.size(), 3U);
    EXPECT_NEAR(at[0], (3.0 - 2.0 * t) * t * t, trajectory_accuracy) << t;
    EXPECT_NEAR(at[1], 6.0 * t * (1.0 - t), trajectory_accuracy) << t;
    EXPECT_NEAR(at[2], 6.0 - 12.0 * t, trajectory_accuracy) << t;
  }
}

TEST(Trajectory, BelongsAtAJunctionToTheArcThatBeginsThere) {
  for (const bool backward : {false, true}) {
    const Solution solution = solve(time_optimal(backward), vector({0.7, 1.4}), {.accuracy = 1e-10});
    ASSERT_TRUE(solution.solved()) << solution.message;
    ASSERT_EQ(solution.arcs.size(), 2U);
    const double junction = solution.arcs[1].begin;
    EXPECT_NEAR(junction, 1.0, trajectory_accuracy);
    EXPECT_NEAR(solution.final_time(), 2.0, trajectory_accuracy);
    EXPECT_EQ(solution.at(std::nextafter(junction, 0.0))[2], 1.0);
    EXPECT_EQ(solution.at(junction)[2], -1.0);
    EXPECT_EQ(solution.at(solution.final_time())[2], -1.0);
    for (int i = 0; i <= 200; ++i) {
      const double t = std::min(0.01 * i, solution.final_time());
      const double left = 2.0 - t;
      const std::vector<double> at = solution.at(t);
      EXPECT_NEAR(at[0], t < 1.0 ? 0.5 * t * t : 1.0 - 0.5 * left * left, trajectory_accuracy) << t;
      EXPECT_NEAR(at[1], t < 1.0 ? t : left, trajectory_accuracy) << t;
    }
  }
}

TEST(Trajectory, ClockStartsWithTheFirstArc) {
  const Solution solution = solve(rotation(), vector({0.1}), {.accuracy = 1e-10});
  ASSERT_TRUE(solution.solved()) << solution.message;
  const double y0 = small::RotationTransfer::y0();
  for (int i = 0; i <= 50; ++i) {
    const double t = solution.final_time() * i / 50;
    const double angle = small::RotationTransfer::angle(small::RotationTransfer::begin + t);
    const std::vector<double> at = solution.at(t);
    EXPECT_NEAR(at[0], std::cos(angle) - y0 * std::sin(angle), trajectory_accuracy);
    EXPECT_NEAR(at[1], std::sin(angle) + y0 * std::cos(angle), trajectory_accuracy);
    EXPECT_NEAR(at[2], at[1], trajectory_accuracy) << "the quadrature starts at y0 and adds up y'";
  }
}

TEST(Trajectory, OutsideItsTimesIsBadInput) {
  const Solution solution = solve(time_optimal(), vector({0.7, 1.4}));
  const std::string range = fmt::format("0 … {:.17g}", solution.final_time());
  for (const double t : {-1e-12, solution.final_time() + 1e-9, 1e300, nan}) {
    const std::string message = thrown<BadInput>([&] { (void)solution.at(t); });
    EXPECT_TRUE(contains(message, range)) << t << ": " << message;
    EXPECT_TRUE(contains(message, fmt::format("t = {:.17g}", t))) << message;
  }
}

TEST(Trajectory, ThatWasNeverFoundHasNoPoint) {
  const Solution failed = solve(parabola_without_root(), vector({3.0}));
  EXPECT_FALSE(thrown<BadInput>([&] { (void)failed.at(0.0); }).empty());
}

TEST(Solution, UnknownNameIsBadInputThatListsTheNames) {
  const Solution solution = solve(least_effort(), vector({1.0, 1.0}));
  const std::string message = thrown<BadInput>([&] { (void)solution["lambda_y"]; });
  for (const char* name : {"lambda_y", "lambda_x", "lambda_v0", "final_time", "end_lambda_v"}) {
    EXPECT_TRUE(contains(message, name)) << message;
  }
}

TEST(Solve, RefusesAnAccuracyOutOfRange) {
  for (const double accuracy : {0.0, -1e-8, 9.9e-13, 1.1e-3, 1.0, nan, std::numeric_limits<double>::infinity()}) {
    const auto message = thrown<BadInput>([&] { (void)solve(least_effort(), vector({1.0, 1.0}), {.accuracy = accuracy}); });
    EXPECT_TRUE(contains(message, fmt::format("accuracy = {:g}", accuracy))) << message;
    EXPECT_TRUE(contains(message, "1e-12 … 0.001")) << message;
  }
}

TEST(Solve, RefusesAStartThatIsNone) {
  const std::string three = thrown<BadInput>([] { (void)solve(least_effort(), vector({1.0, 1.0, 1.0})); });
  EXPECT_TRUE(contains(three, "3")) << three;
  EXPECT_TRUE(contains(three, "2")) << three;
  EXPECT_FALSE(thrown<BadInput>([] { (void)solve(least_effort(), VectorXd(0)); }).empty());
  EXPECT_FALSE(thrown<BadInput>([] { (void)solve(least_effort(), vector({1.0, nan})); }).empty());
  EXPECT_FALSE(thrown<BadInput>([] { (void)solve(least_effort(), vector({-HUGE_VAL, 1.0})); }).empty());
}

TEST(Solve, RefusesOptionsThatAreNone) {
  for (const SolveOptions& options : {SolveOptions{.max_steps = 0}, SolveOptions{.max_iterations = -1},
                                      SolveOptions{.max_step = -1.0}, SolveOptions{.max_step = nan}}) {
    EXPECT_FALSE(thrown<BadInput>([&] { (void)solve(least_effort(), vector({1.0, 1.0}), options); }).empty());
  }
}

TEST(Solve, SystemWithoutARootFailsAndNamesTheRow) {
  for (const double start : {0.0, 1.0, 3.0, 100.0, 1e-3}) {
    const Solution solution = solve(parabola_without_root(), vector({start}));
    EXPECT_FALSE(solution.solved());
    EXPECT_EQ(solution.status, Solution::Status::failed);
    EXPECT_TRUE(contains(solution.message, "not converged")) << solution.message;
    EXPECT_TRUE(contains(solution.message, "parabola: ")) << solution.message;
    EXPECT_TRUE(contains(solution.message, "try ")) << solution.message;
  }
}

// Newton's method with a line search never ends above its start.
TEST(Solve, WorstRowsAreThoseWhereTheIterationEnded) {
  for (const double start : {0.0, 1.0, 3.0, 1e-3, -1e-9}) {
    const std::string message = solve(parabola_without_root(), vector({start})).message;
    EXPECT_LE(std::stod(message.substr(message.find("parabola: ") + 10)), 1.01 * (start * start + 1.0)) << message;
  }
}

TEST(Solve, ThreeWorstRowsAreNamedInOrder) {
  const auto rows_of = [](Shot& shot) {
    std::vector<Jet> rows;
    for (std::size_t i = 0; i < 4; ++i) rows.push_back(shot.unknown(i) * shot.unknown(i) + std::pow(3.0, double(i)));
    return rows;
  };
  // Measured by its scale the last row is the least of all.
  const auto problem =
      std::make_shared<small::Equations>(std::vector<Unknown>{{"a"}, {"b"}, {"c"}, {"d"}},
                                         std::vector<Row>{{"one"}, {"three"}, {"nine"}, {"twentyseven", 100.0}}, rows_of);
  const std::string message = solve(problem, VectorXd::Constant(4, 0.0)).message;
  EXPECT_LT(message.find("nine: 9.00e+00"), message.find("three: 3.00e+00")) << message;
  EXPECT_LT(message.find("three: 3.00e+00"), message.find("one: 1.00e+00")) << message;
  EXPECT_FALSE(contains(message, "twentyseven")) << message;
}

TEST(Solve, RootThatIsNotIsolatedIsSaidToBeSingular) {
  const auto circle = std::make_shared<small::Equations>(
      std::vector<Unknown>{{"x"}, {"y"}}, std::vector<Row>{{"circle"}, {"again"}}, [](Shot& shot) {
        const Jet r = shot.unknown(0) * shot.unknown(0) + shot.unknown(1) * shot.unknown(1) - 1.0;
        return std::vector{r, r * shot.unknown(0)};
      });
  for (const VectorXd& start : {vector({0.5, 0.5}), vector({1.0, 2.0}), vector({0.6, 0.8})}) {
    const Solution solution = solve(circle, start);
    EXPECT_FALSE(solution.solved());
    EXPECT_TRUE(contains(solution.message, "singular")) << solution.message;
  }
}

TEST(Solve, RootOutsideItsDomainFailsAndNamesTheUnknown) {
  const Solution solution = solve(time_optimal(), vector({-0.7, -1.4}));
  EXPECT_FALSE(solution.solved());
  EXPECT_TRUE(contains(solution.message, "first duration = -1")) << solution.message;
  EXPECT_TRUE(contains(solution.message, "0 … inf")) << solution.message;
}

// v has its maximum 1.5 at half time.
TEST(Solve, PathCheckThatFailsIsNamed) {
  EXPECT_TRUE(solve(least_effort(1.5), vector({1.0, 1.0})).solved());
  const Solution solution = solve(least_effort(1.4), vector({1.0, 1.0}));
  EXPECT_FALSE(solution.solved());
  EXPECT_TRUE(contains(solution.message, "speed below its limit")) << solution.message;
  EXPECT_FALSE(solution.certificate.holds());
  EXPECT_EQ(solution.status, Solution::Status::refused);
}

TEST(Solve, PathCheckIsMetBetweenTheStepsOfTheIntegratorToo) {
  for (const double accuracy : {1e-4, 1e-6, 1e-8, 1e-10}) {
    for (const double limit : {1.49, 1.499}) {
      const Solution solution = solve(least_effort(limit), vector({1.0, 1.0}), {.accuracy = accuracy});
      EXPECT_FALSE(solution.solved()) << "limit " << limit << ", accuracy " << accuracy;
    }
  }
}

TEST(Solve, NumberThatIsNoneIsNeverCertified) {
  const auto reporting = one_row("r", [](Shot& shot) {
    shot.report("undefined", "s", nan);
    return std::vector{shot.unknown(0) - 2.0};
  });
  EXPECT_FALSE(solve(reporting, vector({0.0})).solved());

  const auto undefined_inside = std::make_shared<small::OscillatorTransfer>(
      1.0, 1.0, 0.0, [](double t) { return t > 0.2 && t < 0.8 ? nan : 1.0; });
  EXPECT_FALSE(solve(undefined_inside, vector({0.0})).solved());
}

TEST(Solve, ExceptionsOfTheProblemPassThrough) {
  const auto broken = one_row("r", [](Shot&) -> std::vector<Jet> { throw std::logic_error("table ends at 3 km"); });
  EXPECT_EQ(thrown<std::logic_error>([&] { (void)solve(broken, vector({0.0})); }), "table ends at 3 km");
}

TEST(Solve, ArcThatCannotBeIntegratedFailsAndNamesTheArc) {
  const Solution solution = solve(time_optimal(), vector({0.7, 1.4}), {.max_steps = 3});
  EXPECT_FALSE(solution.solved());
  EXPECT_TRUE(contains(solution.message, "arc 1: integration stopped")) << solution.message;
  EXPECT_TRUE(contains(solution.message, "step limit")) << solution.message;
}

}  // namespace
}  // namespace costate
