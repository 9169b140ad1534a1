/// The arcs of the rolling disk as they are integrated, against the full state–costate flow and the equations of the paper.
#include <costate/flow.hpp>
#include <costate/models/disk.hpp>

#include <gtest/gtest.h>
#include <numbers>

namespace costate::disk {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::VectorXd;

/// Invariants are held to fifty times this: some hundred steps, errors of which mostly cancel.
constexpr Tolerance tolerance{1e-12, 1e-12};
constexpr double rounding = 1e-15;

using FullFree = Pontryagin<FreeRolling, FastestRolling>;

// φ' = Ω, Ω' = A (λx sin φ − λy cos φ) with A = λx cos φ + λy sin φ, Ω = λφ, A² + Ω² = 1 on H = 0.
TEST(FreeArc, IsThePendulumOfThePaper) {
  for (double phi = -3.0; phi < 3.0; phi += 0.4) {
    for (const double sign : {1.0, -1.0}) {
      const double lambda_x = 0.5, lambda_y = -0.7;
      const double A = lambda_x * std::cos(phi) + lambda_y * std::sin(phi);
      const double Omega = sign * std::sqrt(1.0 - A * A);
      const auto r = FreeArc().rates(0.0, Vec<double, 2>{phi, Omega}, Vec<double, 2>{lambda_x, lambda_y});
      EXPECT_NEAR(r.state[0], Omega, rounding);
      EXPECT_NEAR(r.state[1], A * (lambda_x * std::sin(phi) - lambda_y * std::cos(phi)), rounding);
      EXPECT_NEAR(r.quadrature[0], A * std::cos(phi), rounding);
      EXPECT_NEAR(r.quadrature[1], A * std::sin(phi), rounding);
      EXPECT_NEAR(FullFree().hamiltonian({phi, Omega}, {lambda_x, lambda_y}), 0.0, rounding);
    }
  }
}

// On H = 0 the rates are those of Pontryagin's flow, and so are their derivatives along it: in directions (dφ, dλφ, dλx, dλy)
// across dH = A dA + λφ dλφ.
TEST(FreeArc, IsTheFullFlowWhereTheHamiltonianVanishes) {
  const FieldOf<FreeArc> arc;
  const FieldOf<FullFree> full;
  for (double phi = -3.0; phi < 3.0; phi += 0.4) {
    const Vector2d p(0.5, -0.7);
    const double A = p[0] * std::cos(phi) + p[1] * std::sin(phi), A_phi = p[1] * std::cos(phi) - p[0] * std::sin(phi);
    const double Omega = -std::sqrt(1.0 - A * A);
    const Eigen::Vector4d gradient(A * A_phi, Omega, A * std::cos(phi), A * std::sin(phi));
    const MatrixXd along = MatrixXd::Identity(4, 4) - gradient * gradient.transpose() / gradient.squaredNorm();
    std::vector<double> z, parameter;
    const auto append = [&](std::vector<double>& to, double value, int i) {
      to.push_back(value);
      for (int j = 0; j < 4; ++j) to.push_back(along(i, j));
    };
    append(z, phi, 0);
    append(z, Omega, 1);
    append(parameter, p[0], 2);
    append(parameter, p[1], 3);
    std::vector<double> a(20), b(20);
    ASSERT_TRUE(arc.variation(0.0, z, parameter, 4, a));
    ASSERT_TRUE(full.variation(0.0, z, parameter, 4, b));
    for (std::size_t i = 0; i < a.size(); ++i) EXPECT_NEAR(a[i], b[i], 10 * rounding) << phi << " entry " << i;
  }
}

TEST(FreeArc, HamiltonianStaysZero) {
  const FieldOf<FreeArc> field;
  Flow flow(field, {.tolerance = tolerance});
  const double A0 = 0.5 * std::cos(0.3) - 0.7 * std::sin(0.3);
  const Trajectory path = flow.record(0.0, 6.0, Vector2d(0.3, std::sqrt(1.0 - A0 * A0)), Vector2d::Zero(),
                                      Vector2d(0.5, -0.7));
  const double angular = std::sqrt(1.0 - A0 * A0);
  for (double t = 0.0; t <= 6.0; t += 0.1) {
    const VectorXd at = path.at(t);
    EXPECT_NEAR(FullFree().hamiltonian({at[0], at[1]}, {0.5, -0.7}), 0.0, 50 * tolerance.relative) << t;
    // λφ − λx y + λy x is constant. Error: a few hundred steps of at most √2·2·tolerance each.
    EXPECT_NEAR(at[1] - 0.5 * at[3] - 0.7 * at[2], angular, 1000 * tolerance.relative) << t;
  }
}

TEST(FastestRolling, MaximisesTheHamiltonianOverTheUnitCircle) {
  const FreeRolling model;
  for (double phi = -3.0; phi < 3.0; phi += 0.7) {
    const Vec<double, 3> q{0.0, 0.0, phi}, costate{0.5, -0.7, 0.9};
    const auto best = FastestRolling().control(q, costate, Vec<double, 0>{});
    EXPECT_NEAR(best[0] * best[0] + best[1] * best[1], 1.0, 4 * rounding);
    const double maximum = hamiltonian(model, q, costate, best, Vec<double, 0>{});
    for (int i = 0; i < 360; ++i) {
      const double angle = i * std::numbers::pi / 180;
      const Vec<double, 2> other{std::cos(angle), std::sin(angle)};
      EXPECT_LE(hamiltonian(model, q, costate, other, Vec<double, 0>{}), maximum + rounding);
    }
  }
}

TEST(LimitingFriction, MaximisesTheHamiltonianIfTheCostateHasTheSignOfTheAcceleration) {
  const LimitedRolling model;
  const Vec<double, 1> kappa{0.45};
  for (double V = -0.5; V <= 0.5; V += 0.1) {
    for (const double sign : {1.0, -1.0}) {
      const Vec<double, 4> q{0.0, 0.0, 0.3, V}, costate{0.5, -0.7, 0.4, sign * 0.8};
      const auto u = LimitingFriction{sign}.control(q, costate, kappa);
      EXPECT_NEAR(LimitingFriction{sign}.constraint(q, u, kappa), 0.0, rounding) << "the limit is reached";
      const double limit = std::sqrt(0.45 * 0.45 - V * V * (1.0 - V * V));
      const double maximum = hamiltonian(model, q, costate, u, kappa);
      for (int i = -50; i <= 50; ++i) {
        EXPECT_LE(hamiltonian(model, q, costate, Vec<double, 1>{limit * i / 50.0}, kappa), maximum + rounding);
      }
    }
  }
}

/// A saturated arc and its length: V' keeps its sign, but V passes 0 on the second.
struct Case {
  double sign, V, length;
};
VectorXd saturated_parameters(double lambda_x, double lambda_y, double V, double length, double turn = 1.0) {
  VectorXd p(5);
  p << lambda_x, lambda_y, V, length, turn;
  return p;
}

class EverySign : public testing::TestWithParam<Case> {};

// The full flow, z = (φ, V, λφ, λ_V), p = (λx, λy, κ), knows nothing of Duffing's equation or of q₁ and q₂.
TEST_P(EverySign, SaturatedArcIsTheFullFlow) {
  using Full = Pontryagin<LimitedRolling, LimitingFriction>;
  const auto [sign, V, length] = GetParam();
  const double kappa = 0.45, phi = 0.3, lambda_x = 0.5, lambda_y = -0.7, lambda_phi = 0.4;
  const Full full({}, {sign});
  const double Omega = std::sqrt(1.0 - V * V);
  const double acceleration = sign * std::sqrt(kappa * kappa - V * V * Omega * Omega);
  const double A = lambda_x * std::cos(phi) + lambda_y * std::sin(phi);
  const double lambda_V = (1.0 - A * V - lambda_phi * Omega) / acceleration;  // H = 0

  const FieldOf<Full> full_field(full);
  const FieldOf<SaturatedArc> arc_field;
  Flow full_flow(full_field, {.tolerance = tolerance}), arc_flow(arc_field, {.tolerance = tolerance});
  const Trajectory reference = full_flow.record(0.0, length, Eigen::Vector4d(phi, V, lambda_phi, lambda_V),
                                                Vector2d(2.0, -1.0), Eigen::Vector3d(lambda_x, lambda_y, kappa));
  const Trajectory arc = arc_flow.record(0.0, length, Eigen::Vector4d(phi, 0.0, acceleration, lambda_phi),
                                         Eigen::Vector4d(2.0, -1.0, 0.0, 0.0),
                                         saturated_parameters(lambda_x, lambda_y, V, length));

  // Both make at most a hundred steps with errors of at most 2√4·tolerance·(1 + |z|), which grow by less than e^length;
  // V' = √… magnifies an error of V by V(1 − 2V²)/V' < 3.
  const double bound = 100 * 4 * tolerance.relative * 10;
  const double angular = lambda_phi - lambda_x * -1.0 + lambda_y * 2.0;
  const double S1 = lambda_V * acceleration, G1 = A - lambda_phi * V / Omega;
  for (int i = 0; i <= 100; ++i) {
    const double t = length * i / 100;
    const VectorXd z = reference.at(t), a = arc.at(t);  // (φ, V, λφ, λ_V, x, y), (φ, ν, V', λφ, x, y, q₁, q₂)
    const double turning = std::sqrt(1.0 - z[1] * z[1]);
    const double rate = sign * std::sqrt(kappa * kappa - z[1] * z[1] * turning * turning);
    ASSERT_GT(std::abs(rate), 0.1) << "V' must not vanish on the arc";
    EXPECT_NEAR(a[0], z[0], bound);
    EXPECT_NEAR(V + length * a[1], z[1], bound);
    EXPECT_NEAR(a[2], rate, bound);
    EXPECT_NEAR(a[3], z[2], bound);
    EXPECT_NEAR(a[4], z[4], bound);
    EXPECT_NEAR(a[5], z[5], bound);
    EXPECT_NEAR(z[2] - lambda_x * z[5] + lambda_y * z[4], angular, bound);
    const double along = lambda_x * std::cos(z[0]) + lambda_y * std::sin(z[0]);
    EXPECT_NEAR(z[3] * rate, 1.0 - along * z[1] - z[2] * turning, bound);
    const double S = S1 - length * a[1] * G1 - length * length * (a[1] * a[6] - a[7]);
    EXPECT_NEAR(z[3] * rate, S, bound);
    // H holds λ_V V', in which λ_V multiplies that magnified error.
    EXPECT_NEAR(full.hamiltonian({z[0], z[1], z[2], z[3]}, {lambda_x, lambda_y, kappa}), 0.0,
                50 * tolerance.relative * (1.0 + 3.0 * std::abs(z[3])));
  }
}

INSTANTIATE_TEST_SUITE_P(SaturatedArc, EverySign, testing::Values(Case{1.0, 0.3, 0.5}, Case{-1.0, 0.3, 1.2}),
                         [](const auto& test) { return test.param.sign > 0.0 ? "accelerating" : "braking"; });

// V'' = 2V³ − V has the integral V'² + V²(1 − V²) = κ², also where V' changes sign.
TEST(SaturatedArc, KeepsTheFrictionAtItsLimitThroughATurningPoint) {
  const FieldOf<SaturatedArc> field;
  Flow flow(field, {.tolerance = tolerance});
  const double kappa = 0.45, V = 0.3;
  const Trajectory path = flow.record(0.0, 4.0,
                                      Eigen::Vector4d(0.0, 0.0, std::sqrt(kappa * kappa - V * V * (1 - V * V)), 0.4),
                                      Eigen::Vector4d::Zero(), saturated_parameters(0.5, -0.7, V, 4.0));
  EXPECT_LT(path.at(4.0)[2], 0.0) << "V' must have changed its sign";
  for (double t = 0.0; t <= 4.0; t += 0.1) {
    const double v = V + 4.0 * path.at(t)[1], rate = path.at(t)[2];
    EXPECT_NEAR(rate * rate + v * v * (1.0 - v * v), kappa * kappa, 50 * tolerance.relative) << t;
  }
}

TEST(BoundaryArc, TurnsAtAConstantRate) {
  const double kappa = 0.45;
  for (const double sign : {1.0, -1.0}) {
    const double V = std::sqrt(0.5 * (1.0 + sign * std::sqrt(1.0 - 4.0 * kappa * kappa)));
    EXPECT_NEAR(V * V * (1.0 - V * V), kappa * kappa, rounding) << "friction is at its limit with V' = 0";
    for (const double turn : {1.0, -1.0}) {
      const auto r = BoundaryArc().rates(0.0, Vec<double, 1>{0.3}, Vec<double, 2>{V, turn});
      EXPECT_NEAR(r.state[0], turn * std::sqrt(1.0 - V * V), rounding);
      EXPECT_NEAR(r.quadrature[0], V * std::cos(0.3), rounding);
      EXPECT_NEAR(r.quadrature[1], V * std::sin(0.3), rounding);
    }
  }
}

// Mirrored, φ → −φ, y → −y, λy → −λy, λφ → −λφ, a motion that turns left is one that turns right.
TEST(SaturatedArc, TurningRightIsTheMirrorImage) {
  const SaturatedArc arc;
  const auto left = arc.rates(0.0, Vec<double, 4>{0.3, 0.2, -0.1, 0.4}, Vec<double, 5>{0.5, -0.7, 0.3, 1.2, 1.0});
  const auto right = arc.rates(0.0, Vec<double, 4>{-0.3, 0.2, -0.1, -0.4}, Vec<double, 5>{0.5, 0.7, 0.3, 1.2, -1.0});
  const double state_signs[] = {-1.0, 1.0, 1.0, -1.0}, quadrature_signs[] = {1.0, -1.0, 1.0, 1.0};
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(right.state[i], state_signs[i] * left.state[i], rounding) << i;
    EXPECT_NEAR(right.quadrature[i], quadrature_signs[i] * left.quadrature[i], 10.0 * rounding) << i;
  }
}

}  // namespace
}  // namespace costate::disk
