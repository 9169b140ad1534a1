/// The brachistochrone without friction, against references, an independent integration and the maximum principle.
#include "runge_kutta.hpp"

#include <costate/models/cycloid.hpp>

#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <numbers>
#include <random>
#include <utility>

namespace costate {
namespace {

TEST(Cycloid, HasTheReferenceValues) {
  // tests/reference/nonlinear_friction.json, A_A0_mu0: 20-digit collocation.
  const auto c = cycloid(6.0, -1.0, 2.0, 9.8);
  ASSERT_TRUE(c);
  EXPECT_NEAR(c->final_time, 1.3195056806149265, 2e-15);
  EXPECT_NEAR(c->theta1(), -1.2584714048451677, 2e-15);
  EXPECT_NEAR(c->theta2(), 0.7282190535855674, 2e-15);
  EXPECT_NEAR(c->lambda_x, 0.1536359556041674, 1e-15);
  EXPECT_NEAR(c->lambda_y, 0.13699954197560846, 1e-15);
  EXPECT_NEAR(c->at(0.0).lambda_v, 0.12506335134193272, 1e-15);
}

TEST(Cycloid, DoesNotExistAboveTheEnergyOfTheBead) {
  EXPECT_FALSE(cycloid(1.0, 0.0, 0.0, 9.8));
  EXPECT_FALSE(cycloid(1.0, 1.0, 2.0, 9.8));
  EXPECT_FALSE(cycloid(1.0, 4.0 / 19.6, 2.0, 9.8));
  EXPECT_TRUE(cycloid(1.0, 0.204, 2.0, 9.8));
}

/// Scenes over many orders of magnitude, at rest and moving, up and down.
TEST(Cycloid, ArrivesWhereItShould) {
  std::mt19937_64 random(20261124);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  for (int i = 0; i < 2000; ++i) {
    const double g = std::pow(10.0, 2.0 * uniform(random) - 1.0);
    const double speed = i % 4 == 0 ? 0.0 : std::pow(10.0, 6.0 * uniform(random) - 3.0);
    const double a = std::pow(10.0, 8.0 * uniform(random) - 4.0);
    const double height = 0.5 * speed * speed / g;
    const double b = i % 3 == 0 && speed > 0.0 ? 0.999 * height * uniform(random) : -std::pow(10.0, 8.0 * uniform(random) - 4.0);
    const auto c = cycloid(a, b, speed, g);
    ASSERT_TRUE(c) << a << ' ' << b << ' ' << speed << ' ' << g;
    const Cycloid::Point start = c->at(0.0), end = c->at(c->final_time);
    // A slope is known to a few units in the last place of π, so a speed sin ψ / λx to as many times 1/λx, and a height, which is
    // quadratic in ψ about its lowest and highest points, to that times the size of the circle.
    const double last_place = 8.0 * std::numbers::pi * std::numeric_limits<double>::epsilon();
    const double R = 0.25 / (g * c->lambda_x * c->lambda_x);
    EXPECT_NEAR(end.x, a, last_place * (a + R * std::sin(c->psi2 - c->psi1)));
    EXPECT_NEAR(end.y, b, last_place * (std::abs(b) + R * std::sin(c->psi2 - c->psi1)));
    EXPECT_NEAR(start.v, speed, last_place / c->lambda_x);
    EXPECT_NEAR(end.lambda_v, 0.0, 1e-14 * (std::abs(c->lambda_x) + std::abs(c->lambda_y)) / (g * c->lambda_x));
    EXPECT_GT(c->psi2, c->psi1);
  }
}

TEST(Cycloid, IsAnExtremal) {
  const double g = 9.8;
  const auto c = cycloid(6.0, -1.0, 2.0, g);
  ASSERT_TRUE(c);
  // x, y, v, λv with the slope that maximises H: along (λx v, λy v − λv g).
  const auto motion = [&](double, const std::array<double, 4>& z) {
    const double across = c->lambda_x * z[2], up = c->lambda_y * z[2] - z[3] * g, W = std::hypot(across, up);
    const double cosine = across / W, sine = up / W;
    return std::array{z[2] * cosine, z[2] * sine, -g * sine, -(c->lambda_x * cosine + c->lambda_y * sine)};
  };
  const auto end = test::runge_kutta<4>(motion, 0.0, c->final_time, {0.0, 0.0, 2.0, c->at(0.0).lambda_v}, 1e-13);
  EXPECT_NEAR(end[0], 6.0, 1e-11);
  EXPECT_NEAR(end[1], -1.0, 1e-11);
  EXPECT_NEAR(end[3], 0.0, 1e-11);
  for (int i = 0; i <= 20; ++i) {
    const Cycloid::Point p = c->at(c->final_time * i / 20.0);
    const double H = -1.0 + p.v * (c->lambda_x * std::cos(p.theta) + c->lambda_y * std::sin(p.theta)) -
                     p.lambda_v * g * std::sin(p.theta);
    EXPECT_NEAR(H, 0.0, 1e-14);
  }
}

}  // namespace
}  // namespace costate
