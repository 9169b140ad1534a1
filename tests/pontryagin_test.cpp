/// State–costate flows derived from models, against costate equations written by hand and extremals in closed form.
#include "small_problems.hpp"

#include <costate/flow.hpp>
#include <costate/pontryagin.hpp>

#include <gtest/gtest.h>

namespace costate {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// x' = v cos θ, y' = v sin θ, v' = g sin θ in least time; y counts downward, x and y are cyclic, g is a parameter.
struct Brachistochrone {
  static constexpr int states = 3, cyclic = 2, controls = 1, parameters = 1;
  template <class S>
  Vec<S, 3> dynamics(const Vec<S, 3>& q, const Vec<S, 1>& u, const Vec<S, 1>& p) const {
    return {q[2] * cos(u[0]), q[2] * sin(u[0]), p[0] * sin(u[0])};
  }
};
struct SteepestGain {
  template <class S>
  Vec<S, 1> control(const Vec<S, 3>& q, const Vec<S, 3>& costate, const Vec<S, 1>& p) const {
    return {atan2(costate[1] * q[2] + costate[2] * p[0], costate[0] * q[2])};
  }
};

/// x' = v, v' = u in least time, on an arc where drag uses up the thrust: u + k v² − 1 = 0 with the parameter k. H_u ≠ 0.
struct Sled {
  static constexpr int states = 2, cyclic = 1, controls = 1, parameters = 1;
  template <class S>
  Vec<S, 2> dynamics(const Vec<S, 2>& q, const Vec<S, 1>& u, const Vec<S, 1>&) const {
    return {q[1], u[0]};
  }
};
struct FullThrust {
  template <class S>
  Vec<S, 1> control(const Vec<S, 2>& q, const Vec<S, 2>&, const Vec<S, 1>& p) const {
    return {1.0 - p[0] * q[1] * q[1]};
  }
  template <class S>
  S constraint(const Vec<S, 2>& q, const Vec<S, 1>& u, const Vec<S, 1>& p) const {
    return u[0] + p[0] * q[1] * q[1] - 1.0;
  }
};

using Energy = Pontryagin<small::Mass, small::LeastEffort>;
using Fastest = Pontryagin<Brachistochrone, SteepestGain>;
using Thrusting = Pontryagin<Sled, FullThrust>;

// Costates of cyclic states are parameters, cyclic states are quadratures.
static_assert(Energy::states == 2 && Energy::parameters == 1 && Energy::quadratures == 1);
static_assert(Fastest::states == 2 && Fastest::parameters == 3 && Fastest::quadratures == 2);
static_assert(VectorField<Energy> && VectorField<Fastest> && VectorField<Thrusting>);

constexpr double rounding = 1e-15;

TEST(Pontryagin, MassOnARailHasTheCostateEquationsOfTheTextbook) {
  const Vec<double, 2> z{0.7, -1.2};  // v, λv
  const Vec<double, 1> p{0.4};        // λx
  const auto r = Energy().rates(0.0, z, p);
  EXPECT_NEAR(r.state[0], -1.2, rounding);      // v' = u = λv
  EXPECT_NEAR(r.state[1], -0.4, rounding);      // λv' = −λx
  EXPECT_NEAR(r.quadrature[0], 0.7, rounding);  // x' = v
  EXPECT_NEAR(Energy().hamiltonian(z, p), 0.5 * 1.2 * 1.2 + 0.4 * 0.7, rounding);
}

TEST(Pontryagin, BrachistochroneHasTheCostateEquationsOfTheTextbook) {
  const Vec<double, 2> z{1.3, 0.5};        // v, λv
  const Vec<double, 3> p{0.6, -0.2, 9.8};  // λx, λy, g
  const double theta = std::atan2(-0.2 * 1.3 + 0.5 * 9.8, 0.6 * 1.3);
  const auto r = Fastest().rates(0.0, z, p);
  EXPECT_NEAR(r.state[0], 9.8 * std::sin(theta), 16 * rounding);
  EXPECT_NEAR(r.state[1], -(0.6 * std::cos(theta) - 0.2 * std::sin(theta)), rounding);
  EXPECT_NEAR(r.quadrature[0], 1.3 * std::cos(theta), rounding);
  EXPECT_NEAR(r.quadrature[1], 1.3 * std::sin(theta), rounding);
}

// Inserting v' = 1 − k v² into H first and differentiating then must give the same as the multiplier of the constraint.
TEST(Pontryagin, MultiplierOfAConstraintMatchesSubstitution) {
  const double v = 0.7, lambda_v = 1.9, lambda_x = 0.4, k = 0.8;
  const auto r = Thrusting().rates(0.0, Vec<double, 2>{v, lambda_v}, Vec<double, 2>{lambda_x, k});
  EXPECT_NEAR(r.state[0], 1.0 - k * v * v, rounding);
  EXPECT_NEAR(r.state[1], -lambda_x + 2.0 * k * v * lambda_v, 2 * rounding);
}

TEST(Pontryagin, PointIsInTheModelsOwnTerms) {
  const auto at = Fastest().point(Vec<double, 2>{1.3, 0.5}, Vec<double, 3>{0.6, -0.2, 9.8});
  EXPECT_EQ(at.state, (Vec<double, 3>{0.0, 0.0, 1.3}));
  EXPECT_EQ(at.costate, (Vec<double, 3>{0.6, -0.2, 0.5}));
  EXPECT_EQ(at.parameter, (Vec<double, 1>{9.8}));
  EXPECT_EQ(at.control[0], std::atan2(-0.2 * 1.3 + 0.5 * 9.8, 0.6 * 1.3));
}

// Differences of H at frozen control: H is linear in v, so only rounding ε|H|/h remains.
TEST(Pontryagin, CostateRateIsTheGradientOfHAtFrozenControl) {
  const Brachistochrone model;
  constexpr double h = 1e-5;
  const Vec<double, 3> p{0.6, -0.2, 9.8};
  for (double v = 0.1; v < 3.0; v += 0.3) {
    const Vec<double, 2> z{v, 0.5};
    const auto at = Fastest().point(z, p);
    auto above = at.state, below = at.state;
    above[2] += h;
    below[2] -= h;
    const double slope = (hamiltonian(model, above, at.costate, at.control, at.parameter) -
                          hamiltonian(model, below, at.costate, at.control, at.parameter)) /
                         (2.0 * h);
    EXPECT_NEAR(Fastest().rates(0.0, z, p).state[1], -slope, 10 * 2.2e-16 / h);
  }
}

// Where H_u = 0, differentiating with the law inserted is the same as at frozen control: the flow is that of the maximised
// Hamiltonian, and the Jacobian is a Hamiltonian matrix, J f_z symmetric.
TEST(Pontryagin, JacobianOfAMaximisingLawIsAHamiltonianMatrix) {
  const FieldOf<Fastest> field;
  MatrixXd fz(2, 2);
  ASSERT_TRUE(field.jacobian(0.0, Eigen::Vector2d(1.3, 0.5), Eigen::Vector3d(0.6, -0.2, 9.8), fz));
  EXPECT_NEAR(fz(0, 0), -fz(1, 1), 16 * rounding) << "free of divergence, as Liouville says";
  // The derivative of the law is part of it: ∂v'/∂λv = g cos θ ∂θ/∂λv > 0, which is 0 at frozen control.
  EXPECT_GT(fz(0, 1), 0.1);
  constexpr double h = 1e-5;
  for (int j = 0; j < 2; ++j) {
    Vec<double, 2> above{1.3, 0.5}, below{1.3, 0.5};
    above[static_cast<std::size_t>(j)] += h;
    below[static_cast<std::size_t>(j)] -= h;
    const Vec<double, 3> p{0.6, -0.2, 9.8};
    for (int i = 0; i < 2; ++i) {
      const auto row = static_cast<std::size_t>(i);
      const double difference = (Fastest().rates(0.0, above, p).state[row] - Fastest().rates(0.0, below, p).state[row]) /
                                (2.0 * h);
      // h²/6 times third derivatives below 100, ε·g/h
      EXPECT_NEAR(fz(i, j), difference, 100 * h * h / 6 + 10 * 2.2e-16 / h) << i << j;
    }
  }
}

constexpr Tolerance tolerance{1e-11, 1e-11};
Directions none(int states, int parameters) { return {MatrixXd(states, 0), MatrixXd(parameters, 0)}; }

TEST(Pontryagin, LeastEnergyExtremalIsACubic) {
  const FieldOf<Energy> field;
  Flow flow(field, {.tolerance = tolerance});
  const double v0 = 0.7, lambda_v = -1.2, lambda_x = 0.4, t = 2.0;
  const FlowEnd& end = flow.run(0.0, t, Eigen::Vector2d(v0, lambda_v), VectorXd::Constant(1, lambda_x), none(2, 1));
  // Polynomials of low degree: the method is exact once its order is 3, and below its tolerance before.
  const double bound = 100 * tolerance.relative;
  EXPECT_NEAR(end.state[0], v0 + lambda_v * t - lambda_x * t * t / 2, bound);
  EXPECT_NEAR(end.state[1], lambda_v - lambda_x * t, bound);
  EXPECT_NEAR(end.quadrature[0], v0 * t + lambda_v * t * t / 2 - lambda_x * t * t * t / 6, bound);
}

// Along a cycloid θ changes at a constant rate, θ' = −g λx for H = 0 and λy = 0.
TEST(Pontryagin, BrachistochroneIsACycloid) {
  const FieldOf<Fastest> field;
  Flow flow(field, {.tolerance = tolerance});
  const double g = 1.0, v0 = 0.5, theta0 = 1.0;
  const double lambda_x = std::cos(theta0) / v0, lambda_v = std::sin(theta0) / g;  // H = 0 at angle θ0
  const Eigen::Vector3d p(lambda_x, 0.0, g);
  const double bound = 100 * tolerance.relative;
  for (const double t : {0.2, 0.5, 1.0}) {
    const FlowEnd& end = flow.run(0.0, t, Eigen::Vector2d(v0, lambda_v), p, none(2, 3));
    const double theta = theta0 - g * lambda_x * t;
    EXPECT_NEAR(end.state[0], std::cos(theta) / lambda_x, bound);
    EXPECT_NEAR(end.state[1], std::sin(theta) / g, bound);
    EXPECT_NEAR(end.quadrature[1], (end.state[0] * end.state[0] - v0 * v0) / (2 * g), bound) << "energy";
  }
}

TEST(Pontryagin, HamiltonianIsConstantAlongExtremals) {
  const FieldOf<Fastest> fastest;
  Flow flow(fastest, {.tolerance = tolerance});
  const Eigen::Vector3d p(0.6, -0.2, 1.0);
  const double start = Fastest().hamiltonian({1.3, 0.5}, {0.6, -0.2, 1.0});
  const Trajectory path = flow.record(0.0, 2.0, Eigen::Vector2d(1.3, 0.5), Eigen::Vector2d::Zero(), p);
  const FieldOf<Thrusting> thrusting;
  Flow sled(thrusting, {.tolerance = tolerance});
  const double sled_start = Thrusting().hamiltonian({0.2, 1.9}, {0.4, 0.8});
  const Trajectory run = sled.record(0.0, 2.0, Eigen::Vector2d(0.2, 1.9), VectorXd::Zero(1), Eigen::Vector2d(0.4, 0.8));
  for (double t = 0.0; t <= 2.0; t += 0.05) {
    const VectorXd a = path.at(t), b = run.at(t);
    EXPECT_NEAR(Fastest().hamiltonian({a[0], a[1]}, {0.6, -0.2, 1.0}), start, 10 * tolerance.relative) << t;
    EXPECT_NEAR(Thrusting().hamiltonian({b[0], b[1]}, {0.4, 0.8}), sled_start, 10 * tolerance.relative * (1 + b.norm()))
        << t;
  }
}

}  // namespace
}  // namespace costate
