/// The Runge–Kutta engine: its coefficients, its orders, every size it is compiled for, and how it chooses its steps.
#include "closed_flows.hpp"

#include <costate/error.hpp>

#include <gtest/gtest.h>
#include <limits>
#include <runge_kutta_step.hpp>

namespace costate {
namespace {

using namespace closed;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double epsilon = std::numeric_limits<double>::epsilon();

FlowOptions chosen(double tolerance) { return options(Method::runge_kutta, tolerance); }

/// Σ rowₛ cₛ^power, and the rounding error it may have.
std::pair<double, double> moment(const verner::Row& row, int power) {
  double sum = 0.0, size = 0.0;
  for (std::size_t s = 0; s < row.size(); ++s) {
    const double term = row[s] * std::pow(verner::nodes[s], power);
    sum += term;
    size += std::abs(term);
  }
  return {sum, 4.0 * epsilon * size};
}

TEST(Tableau, RowsOfTheMatrixSumToTheNodes) {
  for (std::size_t s = 0; s < verner::stages; ++s) {
    const auto [sum, rounding] = moment(verner::matrix[s], 0);
    EXPECT_NEAR(sum, verner::nodes[s], rounding) << s;
    for (std::size_t j = s; j < verner::stages; ++j) EXPECT_EQ(verner::matrix[s][j], 0.0) << "explicit";
  }
}

// ∫₀¹ c^(q−1) dc is exact up to q = order, and no further.
TEST(Tableau, QuadratureConditionsHoldUpToTheOrder) {
  for (const auto& [row, order] : {std::pair(verner::weights, 8), std::pair(verner::embedded, 7)}) {
    for (int q = 1; q <= order; ++q) {
      const auto [sum, rounding] = moment(row, q - 1);
      EXPECT_NEAR(sum, 1.0 / q, rounding) << q;
    }
    const auto [sum, rounding] = moment(row, order);
    EXPECT_GT(std::abs(sum - 1.0 / (order + 1)), rounding) << "more than order " << order;
  }
}

// On the negative real axis the result is a polynomial in z = hλ: below 1 up to the limit, above it a percent beyond.
TEST(Tableau, StabilityEndsWhereItIsSaidTo) {
  const FieldOf<StiffRelaxation> field;
  const auto growth = [&](double z) {
    // z' = −λ(z − cos t) − sin t from the solution plus 1: what is left of 1 after a step that is short for cos t.
    constexpr double h = 1e-3;
    const std::array<double, 1> lambda{-z / h};
    const auto step = make_runge_kutta_step(field, 0);
    step->set_parameter(lambda);
    step->state()[0] = 2.0;
    step->evaluate_start(0.0);
    step->take(0.0, h);
    return std::abs(step->end()[0] - std::cos(h));
  };
  EXPECT_LT(growth(-verner::real_stability), 1.0);
  EXPECT_GT(growth(-1.01 * verner::real_stability), 1.0);
}

/// Errors of one step of length h: of its end against the closed form, and as it is estimated.
template <class F>
std::pair<double, double> errors_of_a_step(double h, const VectorXd& z0, const VectorXd& p) {
  const FieldOf<F> field;
  const auto step = make_runge_kutta_step(field, 0);
  step->set_parameter({p.data(), static_cast<std::size_t>(p.size())});
  std::copy(z0.begin(), z0.end(), step->state().begin());
  EXPECT_TRUE(step->evaluate_start(0.3));
  step->take(0.3, h);
  const Exact<F> exact(0.3, 0.3 + h, z0, p);
  double error = 0.0;
  for (Eigen::Index i = 0; i < F::states; ++i) {
    error = std::max(error, std::abs(step->end()[static_cast<std::size_t>(i)] - exact.state[i]));
  }
  std::fill(step->absolute().begin(), step->absolute().end(), 1.0);
  return {error, step->error(h, {})};
}

// The error of a step of a method of order q is of order q + 1, and the estimate is the error of the embedded formula. Steps are short
// enough for the leading term to rule and long enough for it to be far above rounding; the next term moves what is measured by less
// than 0.3.
template <class F>
std::pair<double, double> orders(double h, const VectorXd& z0, const VectorXd& p) {
  const auto [error, estimate] = errors_of_a_step<F>(h, z0, p);
  const auto [half_error, half_estimate] = errors_of_a_step<F>(0.5 * h, z0, p);
  EXPECT_GT(half_error, 1e-13);
  return {std::log2(error / half_error), std::log2(estimate / half_estimate)};
}

TEST(Step, ErrorsShrinkAtTheirOrders) {
  const auto [error, estimate] = orders<Oscillator>(0.56, vector({0.8, -0.6}), vector({1.3}));
  EXPECT_NEAR(error, 9.0, 0.3);
  EXPECT_NEAR(estimate, 8.0, 0.3);
  // On what is not linear the leading term is so small that the next one is seen.
  const auto [other_error, other_estimate] = orders<ModulatedRotation>(0.28, vector({0.8, -0.6}), vector({2.5}));
  EXPECT_GT(other_error, 8.7);
  EXPECT_NEAR(other_estimate, 8.0, 0.3);
}

// 3 (1 + d) entries, padded to an even number of directions: all the sizes compiled, and the one for any size.
TEST(Step, EverySizeFollowsTheClosedForm) {
  const FieldOf<Oscillator> field;
  const VectorXd z0 = vector({0.8, -0.6}), p = vector({1.3});
  const Exact<Oscillator> exact(0.0, 3.0, z0, p);
  for (int d = 0; d <= 17; ++d) {
    Flow flow(field, chosen(1e-11));
    MatrixXd directions(3, d);
    for (int j = 0; j < d; ++j) directions.col(j) << std::cos(j), std::sin(2.0 * j), 1.0 / (1.0 + j);
    const FlowEnd& end = flow.run(0.0, 3.0, z0, p, {directions.topRows(2), directions.bottomRows(1)});
    // Local errors, summed and stretched by at most ω and the length of the arc.
    const double bound = 10.0 * 1e-11 * static_cast<double>(flow.statistics().steps);
    EXPECT_LE(largest(end.state - exact.state), bound) << d;
    EXPECT_LE(largest(end.quadrature - exact.quadrature), bound) << d;
    EXPECT_LE(largest(end.state_directions - exact.state_derivative.leftCols(3) * directions), bound) << d;
    EXPECT_LE(largest(end.quadrature_directions - exact.quadrature_derivative.leftCols(3) * directions), bound) << d;
  }
}

TEST(Steps, SecondIntegrationNeedsNoSearchForItsFirstStep) {
  const FieldOf<Oscillator> field;
  const VectorXd z0 = vector({0.8, -0.6});
  // The guess of the first step does not depend on the unit of time.
  for (const double omega : {1e-6, 1.0, 1e6}) {
    const VectorXd p = vector({omega});
    for (const double tolerance : {1e-5, 1e-8, 1e-11}) {
      Flow flow(field, {.tolerance = {tolerance, tolerance * std::min(1.0, omega)}, .method = Method::runge_kutta});
      const VectorXd scaled = vector({z0[0], omega * z0[1]});
      (void)flow.run(0.0, 6.0 / omega, scaled, p, no_directions(field));
      const Statistics cold = flow.statistics();
      (void)flow.run(0.0, 6.0 / omega, scaled, p, no_directions(field));
      const long warm = flow.statistics().rhs_evaluations - cold.rhs_evaluations;
      // The difference: a step too short, or one or two refused.
      EXPECT_NEAR(static_cast<double>(warm), static_cast<double>(cold.rhs_evaluations), 2.0 * verner::stages)
          << omega << ' ' << tolerance;
    }
  }
}

TEST(Steps, LongestStepIsHonoured) {
  const FieldOf<FastQuadrature> field;
  for (const auto& [longest, steps] : {std::pair(0.0, 1), std::pair(1.0 / 32.0, 4), std::pair(1.0 / 80.0, 10)}) {
    FlowOptions options = chosen(1e-8);
    options.longest_step = longest;
    Flow flow(field, options);
    (void)flow.run(0.0, 7.0, vector({0.5}), vector({0.0}), no_directions(field));
    EXPECT_EQ(flow.statistics().steps, steps) << longest;
  }
}

/// z' = 1 with a quadrature that is no number at 0.38 < t < 0.4, where only a stage without weight in the error looks.
struct HoledQuadrature {
  static constexpr int states = 1, parameters = 0, quadratures = 1;
  template <class S>
  Rates<S, 1, 1> rates(const S& t, const Vec<S, 1>&, const Vec<S, 0>&) const {
    return {{S(1.0)}, {t > 0.38 && t < 0.4 ? S(std::nan("")) : S(1.0)}};
  }
};

TEST(Steps, NoStageThatIsNoNumberIsOverlooked) {
  const FieldOf<HoledQuadrature> field;
  Flow flow(field, chosen(1e-8));
  try {
    (void)flow.run(0.0, 1.0, vector({0.0}), VectorXd(0), no_directions(field));
  } catch (const LeftDomain&) {
    // It may get past the hole, but not in one step.
  }
  EXPECT_GT(flow.statistics().error_test_failures, 0);
}

/// z' = −1, and no number below ½.
struct HalfWay {
  static constexpr int states = 1, parameters = 0, quadratures = 0;
  template <class S>
  Rates<S, 1, 0> rates(const S&, const Vec<S, 1>& z, const Vec<S, 0>&) const {
    return {{z[0] < S(0.5) ? S(std::nan("")) : S(-1.0)}, {}};
  }
};

// An odd number of directions has an idle one beside it, which stays finite.
TEST(Steps, NoNumberIsNoEndInAnyNumberOfDirections) {
  const FieldOf<HalfWay> field;
  for (int d = 0; d <= 5; ++d) {
    Flow flow(field, chosen(1e-8));
    const Directions directions{MatrixXd::Ones(1, d), MatrixXd(0, d)};
    EXPECT_THROW((void)flow.run(0.0, 0.8, vector({1.0}), VectorXd(0), directions), LeftDomain) << d;
  }
}

TEST(DenseOutput, OfAnArcOfHardlyAnyLength) {
  const FieldOf<Oscillator> field;
  Flow flow(field, chosen(1e-8));
  const VectorXd z0 = vector({0.8, -0.6});
  const Trajectory trajectory = flow.record(0.0, 1e-60, z0, VectorXd::Zero(field.quadratures()), vector({1.3}));
  EXPECT_EQ(VectorXd(trajectory.at(0.5e-60).head(2)), z0);
}

TEST(Steps, AtTheFloorOfDoublePrecisionItEnds) {
  const FieldOf<Oscillator> field;
  const VectorXd z0 = vector({0.8, -0.6}), p = vector({1.0});
  const Exact<Oscillator> exact(0.0, 20.0, z0, p);
  Flow flow(field, chosen(1e-15));
  const FlowEnd& end = flow.run(0.0, 20.0, z0, p, all_directions(field));
  // A step rounds what it adds as its coefficients, which are below 32 in the result, magnify it; rotations leave that as it is.
  EXPECT_LE(largest(end.state - exact.state), 32.0 * epsilon * 20.0);
  // The parameter's direction grows with time, and so do its errors.
  EXPECT_LE(largest(end.state_directions - exact.state_derivative.leftCols(3)), 20.0 * 32.0 * epsilon * 20.0);
  EXPECT_LT(flow.statistics().steps, 2000);

  Flow impossible(field, chosen(1e-17));
  try {
    (void)impossible.run(0.0, 20.0, z0, p, no_directions(field));
    ADD_FAILURE() << "no exception";
  } catch (const LeftDomain& failure) {
    EXPECT_NE(std::string(failure.what()).find("double precision"), std::string::npos) << failure.what();
  }
}

TEST(Steps, StiffArcsEndEarly) {
  const FieldOf<StiffRelaxation> field;
  FlowOptions options = chosen(1e-6);
  options.max_steps = 20000;
  Flow flow(field, options);
  const auto run = [&](double lambda) { (void)flow.run(0.0, 2.0, vector({1.0}), vector({lambda}), all_directions(field)); };
  // Stability asks for 2λ / 5.9 steps: within the limit for the first, far beyond for the second.
  EXPECT_NO_THROW(run(1e3));
  EXPECT_EQ(flow.statistics().exhausted, 0);
  const long before = flow.statistics().steps;
  EXPECT_THROW(run(1e6), LeftDomain);
  EXPECT_EQ(flow.statistics().exhausted, 1);
  EXPECT_LT(flow.statistics().steps - before, 1000);
}

// Between the ends of steps the polynomial is no worse than what a step may be: √3 tol (1 + |z|) in one of three components.
TEST(DenseOutput, IsAsGoodAsTheStepsThemselves) {
  const FieldOf<ModulatedRotation> field;
  const VectorXd z0 = vector({0.8, -0.6}), w0 = vector({7.0}), p = vector({1.5});
  for (const double tolerance : {1e-4, 1e-6, 1e-8, 1e-10, 1e-12}) {
    Flow flow(field, chosen(tolerance));
    const Trajectory trajectory = flow.record(0.4, 6.4, z0, w0, p);
    const auto error = [&](double t) {
      const Exact<ModulatedRotation> exact(0.4, t, z0, p);
      const VectorXd at = trajectory.at(t);
      return std::max(largest(at.head(2) - exact.state), largest(at.tail(1) - w0 - exact.quadrature));
    };
    double at_ends = 0.0, between = 0.0;
    for (const auto& piece : trajectory.pieces()) at_ends = std::max(at_ends, error(piece.node));
    for (int i = 0; i <= 1000; ++i) between = std::max(between, error(0.4 + 6.0 * i / 1000.0));
    EXPECT_LE(between, at_ends + std::sqrt(3.0) * tolerance * 2.0) << tolerance;
  }
}

}  // namespace
}  // namespace costate
