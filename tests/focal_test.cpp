/// Conjugate and focal points of families known in closed form.
#include <costate/shooting/focal.hpp>

#include <gtest/gtest.h>
#include <numbers>

namespace costate {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// x' = v, v' = −ω² x: extremals of ∫(v² − ω² x²) dt. z = (x, v), p = ω, w = ∫x dt.
struct Oscillator {
  static constexpr int states = 2, parameters = 1, quadratures = 1;
  template <class S>
  Rates<S, 2, 1> rates(const S&, const Vec<S, 2>& z, const Vec<S, 1>& p) const {
    return {{z[1], -(p[0] * p[0] * z[0])}, {z[0]}};
  }
};

Front family(double x, double v, double dx, double dv) {
  Front front;
  front.state = Eigen::Vector2d(x, v);
  front.quadrature = VectorXd::Zero(1);
  front.state_directions = Eigen::Vector2d(dx, dv);
  front.quadrature_directions = MatrixXd::Zero(1, 1);
  return front;
}

std::vector<double> nodes_to(double end, int count) {
  std::vector<double> nodes;
  for (int i = 1; i <= count; ++i) nodes.push_back(end * i / count);
  return nodes;
}

/// ∂x/∂(parameter), which with t as the other coordinate is the determinant of (t, x).
double spread(const Front& front) { return front.state_directions(0, 0); }

class FocalScans : public testing::Test {
 protected:
  [[nodiscard]] FocalLeg leg(std::vector<double> nodes) {
    return {&flow_, VectorXd::Constant(1, omega), MatrixXd::Zero(1, 1), std::move(nodes), spread};
  }
  static constexpr double omega = 1.5;
  FieldOf<Oscillator> field_;
  Flow flow_{field_, {.tolerance = {1e-12, 1e-12}}};
};

// Extremals through one point, x = (v/ω) sin ωt, meet at t = kπ/ω, and the place found is good to the integration.
TEST_F(FocalScans, ConjugatePointsOfTheOscillator) {
  FocalScan scan(family(0.0, 0.7, 0.0, 1.0));
  scan.follow(leg(nodes_to(7.0, 23)));
  ASSERT_EQ(scan.found().size(), 3U);
  for (std::size_t k = 0; k < 3; ++k) {
    const Front& front = scan.found()[k];
    EXPECT_NEAR(front.t, (static_cast<double>(k) + 1.0) * std::numbers::pi / omega, 1e-9);
    EXPECT_NEAR(front.state[0], 0.7 / omega * std::sin(omega * front.t), 1e-9);
    EXPECT_NEAR(front.quadrature[0], 0.7 / (omega * omega) * (1.0 - std::cos(omega * front.t)), 1e-9);
  }
}

// Extremals that leave a line x = parameter at rest, x = x₀ cos ωt, meet at t = π/(2ω), backward as forward.
TEST_F(FocalScans, FocalPointsOfAManifoldBackward) {
  FocalScan scan(family(1.0, 0.0, 1.0, 0.0));
  scan.follow(leg(nodes_to(-2.0, 9)));
  ASSERT_EQ(scan.found().size(), 1U);
  EXPECT_NEAR(scan.found()[0].t, -0.5 * std::numbers::pi / omega, 1e-9);
}

TEST_F(FocalScans, ThereIsNoneBeforeTheFirst) {
  FocalScan scan(family(0.0, 0.7, 0.0, 1.0));
  scan.follow(leg(nodes_to(2.0, 9)));
  EXPECT_TRUE(scan.found().empty());
}

// A family stated in t up to the second leg and in −t from there on: the sign is carried over.
TEST_F(FocalScans, LegsMayBeStatedInDifferentVariables) {
  FocalScan scan(family(0.0, 0.7, 0.0, 1.0));
  scan.follow(leg(nodes_to(2.0, 7)));
  Front mirrored = scan.front();
  mirrored.t = -mirrored.t;
  mirrored.state[1] = -mirrored.state[1];  // dx/d(−t)
  mirrored.state_directions.row(1) = -mirrored.state_directions.row(1);
  scan.restate(mirrored);
  scan.follow(leg({-2.05, -2.1, -2.2, -2.5}));
  ASSERT_EQ(scan.found().size(), 1U);
  EXPECT_NEAR(scan.found()[0].t, -std::numbers::pi / omega, 1e-9);
}

// Where the determinant is below the noise its sign is not believed: here nowhere.
TEST_F(FocalScans, NoiseHasNoSign) {
  FocalScan scan(family(0.0, 0.7, 0.0, 1.0), {.noise = 10.0});
  scan.follow(leg(nodes_to(7.0, 23)));
  EXPECT_TRUE(scan.found().empty());
}

TEST_F(FocalScans, AnExtremalThatCannotBeIntegratedThrows) {
  flow_.set_options({.tolerance = {1e-12, 1e-12}, .max_steps = 3});
  FocalScan scan(family(0.0, 0.7, 0.0, 1.0));
  EXPECT_THROW(scan.follow(leg({7.0})), std::runtime_error);
}

}  // namespace
}  // namespace costate
