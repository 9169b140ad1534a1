/// The ways in which CVODES integrates the variational equations, against closed forms, against each other, and against CVODE driven
/// by hand.
#include "bench/bare_cvode.hpp"
#include "closed_flows.hpp"

#include <costate/error.hpp>

#include <algorithm>
#include <array>
#include <gtest/gtest.h>
#include <stdexcept>
#include <string>

namespace costate {
namespace {

using namespace closed;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double tolerance = 1e-9;
constexpr std::array ways{Sensitivities::augmented, Sensitivities::simultaneous, Sensitivities::staggered};

std::string name(Sensitivities way) {
  return way == Sensitivities::augmented ? "augmented" : way == Sensitivities::simultaneous ? "simultaneous" : "staggered";
}

class EveryWay : public testing::TestWithParam<std::tuple<Sensitivities, Method>> {
 protected:
  [[nodiscard]] FlowOptions chosen() const {
    FlowOptions chosen = options(std::get<1>(GetParam()), tolerance);
    chosen.sensitivities = std::get<0>(GetParam());
    chosen.max_steps = 20000;  // the border of a domain is crept up to until they are used up
    return chosen;
  }

  /// The first d directions of all. Every step adds an error of √components·tolerance·(size + 1) at most, which grows by `growth`.
  template <class F>
  void expect_closed_form(double t0, double t1, const VectorXd& z0, const VectorXd& p, Eigen::Index d, double growth) const {
    const FieldOf<F> field;
    const Directions all = all_directions(field);
    Flow flow(field, chosen());
    const FlowEnd& end = flow.run(t0, t1, z0, p, {all.state.leftCols(d), all.parameter.leftCols(d)});
    const Exact<F> exact(t0, t1, z0, p);
    const double steps = static_cast<double>(flow.statistics().steps), components = F::states + F::quadratures;
    const auto compare = [&](const MatrixXd& computed, const MatrixXd& expected, const char* what) {
      ASSERT_EQ(computed.cols(), expected.cols());
      EXPECT_LE(largest(computed - expected), growth * steps * std::sqrt(components) * tolerance * (1.0 + largest(expected)))
          << what << ", d = " << d;
    };
    compare(end.state, exact.state, "state");
    compare(end.quadrature, exact.quadrature, "quadrature");
    compare(end.state_directions, exact.state_derivative.leftCols(d), "state directions");
    compare(end.quadrature_directions, exact.quadrature_derivative.leftCols(d), "quadrature directions");
    EXPECT_EQ(flow.statistics().sensitivity_evaluations > 0, d > 0);
  }
};

// Growths: see flow_test.
TEST_P(EveryWay, AnyNumberOfDirectionsFollowsTheClosedForm) {
  for (const Eigen::Index d : {0, 1, 2, 3}) {
    expect_closed_form<Oscillator>(0.0, 5.0, vector({0.8, -0.6}), vector({1.3}), d, 5.0);
    expect_closed_form<Oscillator>(2.0, -3.0, vector({0.8, -0.6}), vector({1.3}), d, 5.0);
    expect_closed_form<ModulatedRotation>(0.4, 4.4, vector({0.8, -0.6}), vector({1.5}), d, 4.0);
  }
  for (const Eigen::Index d : {0, 1, 2}) {
    expect_closed_form<StiffRelaxation>(0.0, 2.0, vector({1.5}), vector({1000.0}), d, 2.0);
  }
}

// A direction a million times as long carries an error a million times as large, and costs no more steps.
TEST_P(EveryWay, ErrorsAreRelativeToTheSizeOfADirection) {
  const FieldOf<Oscillator> field;
  const VectorXd z0 = vector({0.8, -0.6}), p = vector({1.3});
  const auto run = [&](double size) {
    Flow flow(field, chosen());
    const MatrixXd end =
        flow.run(0.0, 5.0, z0, p, {size * MatrixXd::Identity(2, 2), MatrixXd::Zero(1, 2)}).state_directions / size;
    return std::pair(end, flow.statistics().steps);
  };
  const auto [unit, unit_steps] = run(1.0);
  const auto [scaled, scaled_steps] = run(1048576.0);
  EXPECT_LE(largest(unit - scaled), 5.0 * static_cast<double>(unit_steps) * std::sqrt(3.0) * tolerance * 2.0);
  EXPECT_NEAR(static_cast<double>(scaled_steps), static_cast<double>(unit_steps), 0.1 * static_cast<double>(unit_steps));
}

TEST_P(EveryWay, WhatTheFieldThrowsArrivesOnce) {
  int complaints = 0;
  const FieldOf<EndingTable> field(EndingTable{&complaints});
  const Directions directions = all_directions(field);
  Flow flow(field, chosen());
  EXPECT_THROW(flow.run(0.0, 1.0, vector({1.0}), vector({0.5}), directions), std::out_of_range);
  EXPECT_EQ(complaints, 1);
  EXPECT_NEAR(flow.run(0.0, 0.25, vector({1.0}), vector({0.5}), directions).state_directions(0, 0), std::exp(0.25), 1e-6)
      << "usable afterwards";
}

TEST_P(EveryWay, BorderOfTheDomainIsLeftDomain) {
  const FieldOf<RootBorder> field;
  Flow flow(field, chosen());
  EXPECT_THROW(flow.run(0.0, 3.0, vector({0.0, 0.0}), VectorXd(0), all_directions(field)), LeftDomain);
}

INSTANTIATE_TEST_SUITE_P(Sensitivities, EveryWay,
                         testing::Combine(testing::ValuesIn(ways), testing::Values(Method::adams, Method::bdf)),
                         [](const auto& test) {
                           return name(std::get<0>(test.param)) +
                                  (std::get<1>(test.param) == Method::adams ? "_adams" : "_bdf");
                         });

// Under one error control, the same equations in the same method take the same steps but for rounding.
TEST(Sensitivities, AugmentedAndSimultaneousTakeTheSameSteps) {
  const FieldOf<ModulatedRotation> field;
  for (const Method method : {Method::adams, Method::bdf}) {
    std::array<long, 2> steps{}, evaluations{};
    for (const std::size_t i : {0U, 1U}) {
      FlowOptions chosen = options(method, tolerance);
      chosen.sensitivities = ways.at(i);
      Flow flow(field, chosen);
      flow.run(0.4, 4.4, vector({0.8, -0.6}), vector({1.5}), all_directions(field));
      steps.at(i) = flow.statistics().steps;
      evaluations.at(i) = flow.statistics().sensitivity_evaluations;
    }
    EXPECT_NEAR(static_cast<double>(steps[0]), static_cast<double>(steps[1]), 2.0);
    EXPECT_NEAR(static_cast<double>(evaluations[0]), static_cast<double>(evaluations[1]), 6.0);
  }
}

TEST(Sensitivities, TheWayCanBeChangedLater) {
  const FieldOf<Oscillator> field;
  const VectorXd z0 = vector({0.8, -0.6}), p = vector({1.3});
  Flow changed(field);
  for (const Sensitivities way : {ways[0], ways[1], ways[2], ways[0]}) {
    FlowOptions chosen = options(Method::adams, tolerance);
    chosen.sensitivities = way;
    changed.set_options(chosen);
    Flow fresh(field, chosen);
    EXPECT_EQ(changed.run(0.0, 5.0, z0, p, all_directions(field)).state_directions,
              fresh.run(0.0, 5.0, z0, p, all_directions(field)).state_directions);
  }
}

// The flow adds nothing to CVODE: every bit is the same, and so are the counts.
TEST(Sensitivities, FlowIsCvodeDrivenByHand) {
  const FieldOf<Oscillator> field;
  const double p[] = {1.3, 0.0, 0.0};  // followed by its derivatives
  const auto rates = [](double t, const double* y, double* dy, const void* data) {
    return FieldOf<Oscillator>().variation(t, {y, 6}, {static_cast<const double*>(data), 3}, 2, {dy, 9});
  };
  bench::BareCvode bare(rates, p, 3, 2);
  for (const double t1 : {5.0, -5.0}) {
    std::array<double, 9> y{0.8, 1.0, 0.0, -0.6, 0.0, 1.0};
    const std::array<double, 6> start{0.8, 1.0, 0.0, -0.6, 0.0, 1.0};
    bare.integrate(0.0, t1, y, tolerance, tolerance);
    Flow flow(field, options(Method::adams, tolerance));
    const auto end = flow.advance(0.0, t1, start, p, 2);
    EXPECT_TRUE(std::equal(end.begin(), end.end(), y.begin(), y.end()));
    EXPECT_EQ(flow.statistics().steps, bare.steps());
    EXPECT_EQ(flow.statistics().rhs_evaluations, bare.evaluations());
  }
}

}  // namespace
}  // namespace costate
