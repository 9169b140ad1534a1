/// A problem as a system of equations: its derivatives, what it remembers, and that it can be used again.
#include "small_problems.hpp"

#include <costate/error.hpp>
#include <costate/shooting/solve.hpp>

#include <gtest/gtest.h>

namespace costate {
namespace {

using closed::vector;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using small::contains;
using small::thrown;

TEST(Shooting, RefusesAsManyRowsAsAreNotUnknowns) {
  const auto problem = std::make_shared<small::Equations>(std::vector<Unknown>{{"a"}, {"b"}, {"c"}}, std::vector<Row>{{"only"}},
                                                          [](Shot& shot) { return std::vector{shot.unknown(0)}; });
  const std::string message = thrown<BadInput>([&] { Shooting shooting(problem); });
  EXPECT_TRUE(contains(message, "3 unknowns")) << message;
  EXPECT_TRUE(contains(message, "1 rows")) << message;
}

TEST(Shooting, RefusesParametersOfAnotherNumber) {
  Shooting shooting(std::make_shared<small::LeastEffortTransfer>());
  const std::string message = thrown<BadInput>([&] { shooting.set_parameters({1.0}); });
  EXPECT_TRUE(contains(message, "1 parameter")) << message;
  EXPECT_TRUE(contains(message, "2")) << message;
  EXPECT_EQ(shooting.parameters(), (std::vector{1.0, 10.0})) << "unchanged";
}

TEST(Shooting, CanBeUsedAgainAndGivesTheSameNumbers) {
  Shooting shooting(std::make_shared<small::RotationTransfer>());
  const VectorXd start = vector({0.1});
  const Solution first = solve(shooting, start);
  (void)solve(shooting, start, {.accuracy = 1e-4, .method = Method::bdf});
  shooting.set_parameters({1.2});
  const Solution other = solve(shooting, start);
  shooting.set_parameters({small::RotationTransfer::rate});
  const Solution again = solve(shooting, start);
  ASSERT_TRUE(first.solved() && other.solved() && again.solved());
  EXPECT_NE(first.y, other.y);
  EXPECT_EQ(first.y, again.y);
  EXPECT_EQ(first.cost.steps, again.cost.steps) << "each solve counts its own";
  EXPECT_EQ(first.cost.newton_iterations, again.cost.newton_iterations);
  EXPECT_EQ(first["end_y"].value, again["end_y"].value);
  EXPECT_EQ(first["end_y"].error_bound, again["end_y"].error_bound);
  EXPECT_EQ(first.at(0.7), again.at(0.7));
}

// Central differences err by h²/6 of the third derivative: their distance from the truth falls by four when h is halved.
void expect_second_order(const std::function<MatrixXd(double h)>& differences, const MatrixXd& exact) {
  double previous = 0.0;
  for (const double h : {0.04, 0.02, 0.01}) {
    const double error = (differences(h) - exact).cwiseAbs().maxCoeff();
    EXPECT_LT(error, 0.1 * exact.cwiseAbs().maxCoeff());
    if (previous > 0.0) {
      EXPECT_NEAR(previous / error, 4.0, 0.2) << "h = " << h;
    }
    previous = error;
  }
}

TEST(Shooting, DerivativesAreThoseOfTheResidual) {
  Shooting shooting(std::make_shared<small::PendulumTransfer>());
  shooting.set_flow_options({.tolerance = {.relative = 1e-13, .absolute = 1e-13}});
  const VectorXd y = vector({0.9, 0.7});
  const std::vector<double> parameters = shooting.parameters(), path{0.8, -0.5};
  const auto residual = [&](const VectorXd& at) { return VectorXd(shooting.residual(shooting.evaluate(at))); };
  const MatrixXd jacobian = shooting.jacobian(shooting.evaluate(y));
  expect_second_order(
      [&](double h) {
        MatrixXd columns(2, 2);
        for (Eigen::Index j = 0; j < 2; ++j) {
          const VectorXd step = h * VectorXd::Unit(2, j);
          columns.col(j) = (residual(y + step) - residual(y - step)) / (2.0 * h);
        }
        return columns;
      },
      jacobian);

  const Shot along = shooting.evaluate(y, path);
  const VectorXd path_derivative = shooting.path_derivative(along);
  EXPECT_LE((shooting.jacobian(along) - jacobian).cwiseAbs().maxCoeff(), 1e-10) << "the path adds a column, no more";
  expect_second_order(
      [&](double h) {
        const auto moved = [&](double by) {
          shooting.set_parameters({parameters[0] + by * path[0], parameters[1] + by * path[1]});
          return residual(y);
        };
        return MatrixXd((moved(h) - moved(-h)) / (2.0 * h));
      },
      path_derivative);
}

TEST(Shooting, RemembersTheLastPoint) {
  Shooting shooting(std::make_shared<small::PendulumTransfer>());
  const VectorXd y = vector({0.9, 0.7});
  VectorXd r;
  MatrixXd j;
  const auto integrations = [&] { return shooting.statistics().integrations; };
  shooting.residual(y, r);
  const long once = integrations();
  EXPECT_EQ(once, 2) << "one an arc";
  shooting.jacobian(y, j);
  (void)shooting.evaluate(y);
  (void)shooting.correction(y);
  EXPECT_EQ(integrations(), once);
  (void)shooting.evaluate(y, {1.0, 0.0});
  EXPECT_EQ(integrations(), 2 * once) << "another path is another evaluation";
  shooting.set_parameters({1.0, 0.4});
  VectorXd moved;
  shooting.residual(y, moved);
  EXPECT_NE(r, moved) << "other parameters are";
}

TEST(Shooting, CorrectionIsTheDistanceToTheRootInScales) {
  Shooting shooting(std::make_shared<small::Equations>(std::vector<Unknown>{{"a", 10.0}, {"b", 0.1}},
                                                       std::vector<Row>{{"r", 1e6}, {"s", 1e-6}}, [](Shot& shot) {
                                                         return std::vector{1e6 * (shot.unknown(0) - 3.0),
                                                                            1e-6 * (shot.unknown(1) - 2.0)};
                                                       }));
  EXPECT_NEAR(shooting.correction(vector({5.0, 2.0})), 0.2, 1e-15);
  EXPECT_NEAR(shooting.correction(vector({3.0, 2.3})), 3.0, 1e-14);
}

}  // namespace
}  // namespace costate
