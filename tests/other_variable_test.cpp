/// Arcs stated in another variable than time: no state at all, the time a quadrature among others.
#include <costate/shooting/solve.hpp>

#include <gtest/gtest.h>

namespace costate {
namespace {

/// A body falls from rest in a medium that resists with k v per unit mass, in the variable v: dt = dv/(g − k v), dy = v dt.
/// Constants g, k; quadratures y, t.
struct Fall {
  static constexpr int states = 0, parameters = 2, quadratures = 2;
  template <class S>
  Rates<S, 0, 2> rates(const S& v, const Vec<S, 0>&, const Vec<S, 2>& p) const {
    const S dt = 1.0 / (p[0] - p[1] * v);
    return {{}, {v * dt, dt}};
  }
};

constexpr double g = 9.81, k = 0.7, depth = 5.0;

/// The end speed at a given depth. Integrated from rest onward, or from the end back to rest.
class FallTo final : public Problem {
 public:
  explicit FallTo(bool backward) : backward_(backward) {
    unknowns_ = {{"end_speed", 5.0, 0.0}};
    rows_ = {{"depth", depth}};
    parameters_ = {{"resistance", "1/s", k}};
    structure_ = {"fall"};
  }
  void shoot(Shot& shot) const override {
    const Jet& speed = shot.unknown(0);
    const ArcEnd end = shot.arc({.field = &field_,
                                 .t0 = backward_ ? speed : Jet(0.0),
                                 .t1 = backward_ ? Jet(0.0) : speed,
                                 .state = {},
                                 .quadrature = {0.0, 0.0},
                                 .parameter = {g, shot.parameter(0)},
                                 .time_quadrature = 1});
    const double side = backward_ ? -1.0 : 1.0;
    shot.row(0, side * end.quadrature[0] - depth);
    shot.report("final_time", "s", side * end.quadrature[1]);
    shot.complete({backward_ ? -end.quadrature[0].value : 0.0}, {});
  }
  [[nodiscard]] std::vector<Column> columns() const override { return {{"y", "m"}}; }
  [[nodiscard]] std::vector<double> observe(const ArcPoint& point, const std::vector<double>&) const override {
    return {point.quadrature[0]};
  }
  [[nodiscard]] std::vector<PathCheck> check(const ArcPoint& point, const std::vector<double>&) const override {
    return {{"depth fallen", PathCheck::Kind::nonnegative, point.quadrature[0]}};
  }

 private:
  bool backward_;
  FieldOf<Fall> field_;
};

double speed_at(double t) { return g / k * -std::expm1(-k * t); }
double depth_at(double t) { return g / k * (t + std::expm1(-k * t) / k); }

class OtherVariable : public testing::TestWithParam<bool> {};

TEST_P(OtherVariable, HasItsTimeFromTheQuadrature) {
  const double accuracy = 1e-10;
  const Solution solution = solve(std::make_shared<FallTo>(GetParam()), Eigen::VectorXd::Constant(1, 5.0), {.accuracy = accuracy});
  ASSERT_TRUE(solution.solved()) << solution.message;
  const double T = solution["final_time"].value;
  EXPECT_NEAR(depth_at(T), depth, 10.0 * accuracy);
  EXPECT_NEAR(speed_at(T), solution["end_speed"].value, 10.0 * accuracy);
  EXPECT_NEAR(solution.final_time(), T, accuracy);
  EXPECT_EQ(solution.arcs.front().begin, 0.0);
  for (int i = 0; i <= 10; ++i) {
    const double t = solution.final_time() * i / 10.0;
    EXPECT_NEAR(solution.at(t)[0], depth_at(t), accuracy) << "t = " << t;
    EXPECT_NEAR(solution.arcs.front().own(t), speed_at(t), accuracy) << "t = " << t;
    EXPECT_NEAR(solution.arcs.front().time(solution.arcs.front().own(t)), t, 1e-14) << "t = " << t;
  }
}

TEST_P(OtherVariable, HasExactDerivatives) {
  Shooting shooting(std::make_shared<FallTo>(GetParam()));
  shooting.set_flow_options({.tolerance = {.relative = 1e-13, .absolute = 1e-13}});
  const Eigen::VectorXd y = Eigen::VectorXd::Constant(1, 6.0);
  const Shot& shot = shooting.evaluate(y, {1.0});
  // y(v; k) = ∫ v dv/(g − k v): its integrand, and for k the closed form −g/k² log(1 − k v/g) − v/k, differentiated by hand.
  const double v = y[0], left = g - k * v, log = std::log1p(-k * v / g);
  EXPECT_NEAR(shooting.jacobian(shot)(0, 0), v / left, 1e-11);
  EXPECT_NEAR(shooting.path_derivative(shot)[0], 2.0 * g / (k * k * k) * log + g * v / (k * k * left) + v / (k * k), 1e-11);
}

INSTANTIATE_TEST_SUITE_P(Directions, OtherVariable, testing::Bool(),
                         [](const auto& info) { return info.param ? "Backward" : "Forward"; });

}  // namespace
}  // namespace costate
