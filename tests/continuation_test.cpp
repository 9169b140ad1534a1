/// Following a solution along a path of parameters: where it leads, what it costs, and how it ends early.
#include "small_problems.hpp"

#include <costate/error.hpp>
#include <costate/shooting/continuation.hpp>
#include <costate/shooting/solve.hpp>

#include <cmath>
#include <gtest/gtest.h>

namespace costate {
namespace {

using closed::vector;
using Eigen::VectorXd;
using small::contains;
using small::thrown;

std::shared_ptr<const Problem> scalar(small::Equations::RowsOf rows_of, double p) {
  return std::make_shared<small::Equations>(std::vector<Unknown>{{"y"}}, std::vector<Row>{{"r"}}, std::move(rows_of),
                                            std::vector<Parameter>{{"p", "1", p}});
}

/// y³ + y = p has one root for every p: follows from Cardano's formula.
std::shared_ptr<const Problem> cubic(double p) {
  return scalar(
      [](Shot& shot) {
        const Jet& y = shot.unknown(0);
        return std::vector{y * y * y + y - shot.parameter(0)};
      },
      p);
}
double cubic_root(double p) {
  const double root = std::sqrt(0.25 * p * p + 1.0 / 27.0);
  return std::cbrt(0.5 * p + root) + std::cbrt(0.5 * p - root);
}

/// y² = p has its fold at p = 0.
std::shared_ptr<const Problem> parabola(double p) {
  return scalar([](Shot& shot) { return std::vector{shot.unknown(0) * shot.unknown(0) - shot.parameter(0)}; }, p);
}

/// The residual at a followed point is at most ten times the tolerance, and R_y = 3y² + 1 ≥ 1 makes it the error too.
constexpr double point_accuracy = 10.0 * FollowOptions{}.tolerance;

TEST(Follow, ReachesTheTarget) {
  Shooting shooting(cubic(0.0));
  const Followed path = follow(shooting, vector({0.0}), {30.0});
  ASSERT_TRUE(path.reached) << path.message;
  EXPECT_FALSE(path.stopped);
  EXPECT_EQ(path.fraction, 1.0);
  EXPECT_TRUE(path.message.empty());
  EXPECT_EQ(path.parameters, std::vector{30.0}) << "exactly";
  EXPECT_EQ(shooting.parameters(), std::vector{30.0});
  EXPECT_NEAR(path.y[0], cubic_root(30.0), point_accuracy);
  EXPECT_GE(path.points, 2);
}

TEST(Follow, EveryPointIsASolution) {
  Shooting shooting(cubic(-5.0));
  double last = -5.0;
  int points = 0;
  const Followed path = follow(shooting, vector({cubic_root(-5.0)}), {20.0}, {},
                               [&](const VectorXd& y, const std::vector<double>& p) {
                                 EXPECT_NEAR(y[0], cubic_root(p[0]), point_accuracy);
                                 EXPECT_GT(p[0], last) << "always forward";
                                 last = p[0];
                                 ++points;
                                 return false;
                               });
  EXPECT_TRUE(path.reached) << path.message;
  EXPECT_EQ(points, path.points);
  EXPECT_EQ(last, 20.0);
}

// A wrong predictor is repaired by Newton's method and shows in nothing but its iterations. The prediction is exact where the
// path of y is straight.
TEST(Follow, PredictsAlongTheTangent) {
  const auto straight = std::make_shared<small::Equations>(
      std::vector<Unknown>{{"a"}, {"b"}}, std::vector<Row>{{"r"}, {"s"}},
      [](Shot& shot) {
        const Jet sum = shot.unknown(0) + 2.0 * shot.unknown(1) - 3.0 * shot.parameter(0);
        const Jet difference = shot.unknown(0) - shot.unknown(1) - shot.parameter(1) + shot.parameter(0);
        return std::vector{sum * (1.0 + sum * sum), difference};
      },
      std::vector<Parameter>{{"p", "1", 0.0}, {"q", "1", 0.0}});
  Shooting shooting(straight);
  const Followed path = follow(shooting, vector({0.0, 0.0}), {2.0, -3.0});
  ASSERT_TRUE(path.reached) << path.message;
  EXPECT_EQ(path.newton_iterations, 0);
  // a + 2b = 3p = 6, a − b = q − p = −5
  EXPECT_NEAR(path.y[0], -4.0 / 3.0, point_accuracy);
  EXPECT_NEAR(path.y[1], 11.0 / 3.0, point_accuracy);
}

// From a point on the curve the tangent is wrong by O(Δs²), the point itself by O(Δs).
TEST(Follow, PredictionSparesNewtonIterations) {
  Shooting shooting(cubic(0.0));
  Shooting plain(cubic(0.0));
  Kinsol newton(1);
  VectorXd y = vector({0.0});
  long without = 0;
  const Followed path = follow(shooting, y, {10.0}, {.first_step = 0.05},
                               [&](const VectorXd&, const std::vector<double>& p) {
                                 plain.set_parameters(p);
                                 without += newton
                                                .solve(plain, y, plain.unknown_scales(), plain.row_scales(),
                                                       {.residual_tolerance = point_accuracy})
                                                .iterations;
                                 return false;
                               });
  ASSERT_TRUE(path.reached) << path.message;
  EXPECT_LT(path.newton_iterations, without);
}

TEST(Follow, MonitorStopsThePathWhereItSays) {
  Shooting shooting(cubic(0.0));
  const auto above_one = [](const VectorXd& y, const std::vector<double>&) { return y[0] > 1.0; };
  const Followed path = follow(shooting, vector({0.0}), {8.0}, {.first_step = 0.01}, above_one);
  EXPECT_TRUE(path.stopped);
  EXPECT_FALSE(path.reached);
  EXPECT_TRUE(path.message.empty()) << path.message;
  EXPECT_GT(path.y[0], 1.0);
  EXPECT_LT(path.fraction, 1.0);
  EXPECT_NEAR(path.parameters[0], 8.0 * path.fraction, 1e-14);
  EXPECT_EQ(shooting.parameters(), path.parameters);
  EXPECT_NEAR(path.y[0], cubic_root(path.parameters[0]), point_accuracy);
}

TEST(Follow, MonitorThatStopsAtTheTargetStops) {
  Shooting shooting(cubic(0.0));
  const Followed path = follow(shooting, vector({0.0}), {8.0}, {},
                               [](const VectorXd&, const std::vector<double>& p) { return p[0] == 8.0; });
  EXPECT_TRUE(path.stopped);
  EXPECT_EQ(path.fraction, 1.0);
  EXPECT_EQ(shooting.parameters(), std::vector{8.0});
}

// From p = 1 to p = −3 the fold is a quarter of the way. A residual of point_accuracy is still a root: that far beyond the
// fold a point may be accepted.
TEST(Follow, FoldEndsThePathAndIsLocated) {
  Shooting shooting(parabola(1.0));
  const Followed path = follow(shooting, vector({1.0}), {-3.0});
  EXPECT_FALSE(path.reached);
  EXPECT_FALSE(path.stopped);
  EXPECT_LE(path.fraction, 0.25 + point_accuracy);
  EXPECT_NEAR(path.fraction, 0.25, 1e-5);
  EXPECT_TRUE(contains(path.message, "the path ends 0.2")) << path.message;
  EXPECT_TRUE(contains(path.message, "of the way: ")) << path.message;
  EXPECT_NEAR(std::stod(path.message.substr(path.message.find("ends ") + 5)), path.fraction, 1e-6) << path.message;
  EXPECT_EQ(shooting.parameters(), path.parameters);
  EXPECT_NEAR(path.y[0] * path.y[0], path.parameters[0], point_accuracy);
}

TEST(Follow, BorderOfTheDomainEndsThePathAndIsNamed) {
  const auto problem = scalar(
      [](Shot& shot) { return std::vector{shot.unknown(0) - sqrt(shot.parameter(0), "friction left")}; }, 1.0);
  Shooting shooting(problem);
  const Followed path = follow(shooting, vector({1.0}), {-2.0});
  EXPECT_FALSE(path.reached);
  EXPECT_LE(path.fraction, 1.0 / 3.0);
  EXPECT_NEAR(path.fraction, 1.0 / 3.0, 1e-5);
  EXPECT_TRUE(contains(path.message, "friction left")) << path.message;
  EXPECT_EQ(shooting.parameters(), path.parameters);
}

TEST(Follow, FirstPointIsCorrected) {
  Shooting shooting(cubic(2.0));
  const Followed path = follow(shooting, vector({1.6}), {2.0001});
  ASSERT_TRUE(path.reached) << path.message;
  EXPECT_GE(path.newton_iterations, 3) << "from 1.6 to the root 1";
  EXPECT_NEAR(path.y[0], cubic_root(2.0001), point_accuracy);
}

TEST(Follow, StartWithoutASolutionIsSaid) {
  Shooting shooting(parabola(-1.0));
  int calls = 0;
  const Followed path = follow(shooting, vector({0.7}), {1.0}, {}, [&](const VectorXd&, const std::vector<double>&) {
    ++calls;
    return true;
  });
  EXPECT_FALSE(path.reached);
  EXPECT_EQ(path.fraction, 0.0);
  EXPECT_EQ(path.points, 0);
  EXPECT_EQ(calls, 0);
  EXPECT_TRUE(contains(path.message, "no solution at the start of the path")) << path.message;
  EXPECT_EQ(shooting.parameters(), std::vector{-1.0});
}

TEST(Follow, PathOfNoLengthStaysWhereItIs) {
  Shooting shooting(cubic(2.0));
  const Followed path = follow(shooting, vector({1.1}), {2.0});
  EXPECT_TRUE(path.reached) << path.message;
  EXPECT_EQ(path.fraction, 1.0);
  EXPECT_NEAR(path.y[0], 1.0, point_accuracy);
}

TEST(Follow, ProblemWithoutParametersIsSolved) {
  const auto problem = std::make_shared<small::Equations>(std::vector<Unknown>{{"y"}}, std::vector<Row>{{"r"}}, [](Shot& shot) {
    return std::vector{shot.unknown(0) - 2.0};
  });
  Shooting shooting(problem);
  const Followed path = follow(shooting, vector({1.5}), {});
  EXPECT_TRUE(path.reached) << path.message;
  EXPECT_NEAR(path.y[0], 2.0, point_accuracy);
}

TEST(Follow, PointsBeyondTheBudgetAreSaid) {
  Shooting shooting(cubic(0.0));
  const Followed path = follow(shooting, vector({0.0}), {1e6}, {.first_step = 1e-4, .max_points = 3});
  EXPECT_FALSE(path.reached);
  EXPECT_EQ(path.points, 3);
  EXPECT_TRUE(contains(path.message, "given up")) << path.message;
  EXPECT_TRUE(contains(path.message, "3 points")) << path.message;
  EXPECT_EQ(shooting.parameters(), path.parameters);
  EXPECT_NEAR(path.y[0], cubic_root(path.parameters[0]), point_accuracy);
}

TEST(Follow, IntegrationStepsBeyondTheBudgetAreSaid) {
  Shooting shooting(std::make_shared<small::LeastEffortTransfer>());
  const Followed free = follow(shooting, vector({12.0, 6.0}), {50.0, 10.0});
  ASSERT_TRUE(free.reached) << free.message;
  // The budget counts the steps of this path, not those of earlier ones: the next path has spent nothing yet.
  const long spent = shooting.statistics().steps;
  const Followed path = follow(shooting, free.y, {1.0, 10.0}, {.first_step = 1e-3, .max_integration_steps = 100});
  EXPECT_FALSE(path.reached);
  EXPECT_GE(path.points, 1);
  EXPECT_TRUE(contains(path.message, "given up")) << path.message;
  const long steps = shooting.statistics().steps - spent;
  EXPECT_GE(steps, 100);
  EXPECT_TRUE(contains(path.message, std::to_string(steps) + " integration steps")) << path.message;
}

// λ_x = 12 D, λ_v(0) = 6 D: the scale of the unknowns is 10, an error of 1e-7 in a row one of 12e-7.
TEST(Follow, FollowsThroughAnIntegration) {
  Shooting shooting(std::make_shared<small::LeastEffortTransfer>());
  const Followed path = follow(shooting, vector({12.0, 6.0}), {3.0, 10.0});
  ASSERT_TRUE(path.reached) << path.message;
  EXPECT_NEAR(path.y[0], 36.0, 18.0 * point_accuracy);
  EXPECT_NEAR(path.y[1], 18.0, 10.0 * point_accuracy);
  const Solution solution = solve(shooting, path.y);
  EXPECT_TRUE(solution.solved()) << solution.message;
  EXPECT_NEAR(solution["lambda_x"].value, 36.0, 36.0 * 1e-8);
}

TEST(Follow, UnlikelySizesAreBadInput) {
  Shooting shooting(cubic(0.0));
  EXPECT_FALSE(thrown<BadInput>([&] { (void)follow(shooting, vector({0.0}), {1.0, 2.0}); }).empty());
  EXPECT_FALSE(thrown<BadInput>([&] { (void)follow(shooting, vector({0.0}), {}); }).empty());
  EXPECT_FALSE(thrown<BadInput>([&] { (void)follow(shooting, vector({0.0, 0.0}), {1.0}); }).empty());
  EXPECT_FALSE(thrown<BadInput>([&] { (void)follow(shooting, vector({0.0}), {std::nan("")}); }).empty());
}

TEST(Follow, ExceptionsOfTheProblemPassThrough) {
  const auto problem = scalar(
      [](Shot& shot) {
        if (shot.parameter(0).value > 0.5) throw std::logic_error("table ends at 0.5");
        return std::vector{shot.unknown(0) - shot.parameter(0)};
      },
      0.0);
  Shooting shooting(problem);
  EXPECT_EQ(thrown<std::logic_error>([&] { (void)follow(shooting, vector({0.0}), {1.0}); }), "table ends at 0.5");
}

}  // namespace
}  // namespace costate
