/// Flows against closed forms: states, quadratures, sensitivities, dense output, and every way an integration can end early.
#include "closed_flows.hpp"

#include <costate/error.hpp>

#include <Eigen/LU>
#include <cstdlib>
#include <limits>
#include <gtest/gtest.h>
#include <malloc.h>
#include <new>
#include <string>

namespace {
long allocations = 0;
}
// Counted so that a test can see that memory is reused. (Eigen and SUNDIALS go to malloc, which is not counted.) Not inlined,
// because GCC would then warn of a free that meets a new.
[[gnu::noinline]] void* operator new(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace costate {
namespace {

using namespace closed;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::VectorXd;

/// What the error of a flow that magnifies no error by more than `growth` can sum up to: CVODES keeps the root mean square of
/// the local errors of the n components (states and quadratures) below tolerance·(|z| + 1) at each of N steps, so that of one
/// component is below √n times that.
double error_bound(const Flow& flow, double size, double growth = 1.0) {
  const auto components = static_cast<double>(flow.field().states() + flow.field().quadratures());
  const auto steps = static_cast<double>(flow.statistics().steps);
  return growth * steps * std::sqrt(components) * flow.options().tolerance.relative * (1.0 + size);
}

class EveryMethod : public testing::TestWithParam<std::tuple<Method, double>> {
 protected:
  [[nodiscard]] FlowOptions chosen() const { return options(std::get<0>(GetParam()), std::get<1>(GetParam())); }

  template <class F>
  void expect_closed_form(double t0, double t1, const VectorXd& z0, const VectorXd& p, double growth) const {
    const FieldOf<F> field;
    Flow flow(field, chosen());
    const FlowEnd& end = flow.run(t0, t1, z0, p, all_directions(field));
    const Exact<F> exact(t0, t1, z0, p);
    const Eigen::Index d = F::states + F::parameters;
    const auto compare = [&](const MatrixXd& computed, const MatrixXd& expected, const char* what) {
      ASSERT_EQ(computed.rows(), expected.rows());
      ASSERT_EQ(computed.cols(), expected.cols());
      EXPECT_LE(largest(computed - expected), error_bound(flow, largest(expected), growth)) << what;
    };
    compare(end.state, exact.state, "state");
    compare(end.quadrature, exact.quadrature, "quadrature");
    compare(end.state_directions, exact.state_derivative.leftCols(d), "state directions");
    compare(end.quadrature_directions, exact.quadrature_derivative.leftCols(d), "quadrature directions");
    compare(end.state_rate, exact.state_derivative.col(exact.t1_column), "state rate");
    compare(end.quadrature_rate, exact.quadrature_derivative.col(exact.t1_column), "quadrature rate");
  }
};

// The growths: transition matrices are rotations, stretched by ω, and what is forced by the state (the direction of the
// parameter, the quadrature) collects errors over the arc's length.
TEST_P(EveryMethod, OscillatorFollowsItsClosedForm) {
  expect_closed_form<Oscillator>(0.0, 5.0, vector({0.8, -0.6}), vector({1.3}), 5.0);
  expect_closed_form<Oscillator>(2.0, -3.0, vector({0.8, -0.6}), vector({1.3}), 5.0);
}

TEST_P(EveryMethod, NonAutonomousFieldFollowsItsClosedForm) {
  expect_closed_form<ModulatedRotation>(0.4, 4.4, vector({0.8, -0.6}), vector({1.5}), 4.0);
  expect_closed_form<ModulatedRotation>(4.4, 0.4, vector({0.8, -0.6}), vector({1.5}), 4.0);
}

// Errors decay, so no growth; the quadrature collects them.
TEST_P(EveryMethod, StiffFieldFollowsItsClosedForm) {
  expect_closed_form<StiffRelaxation>(0.0, 2.0, vector({1.5}), vector({1000.0}), 2.0);
}

TEST_P(EveryMethod, QuadraturesAreUnderErrorControlToo) {
  expect_closed_form<FastQuadrature>(0.0, 5.0, vector({0.5}), vector({20.0}), 1.0);
}

// ∂z₁/∂z₀ = (z₁/z₀)², which is 100 here.
TEST_P(EveryMethod, GrowthBeforeAnEscapeFollowsItsClosedForm) {
  expect_closed_form<FiniteEscape>(0.0, 0.9, vector({1.0}), VectorXd(0), 100.0);
}

TEST_P(EveryMethod, BackwardUndoesForward) {
  const FieldOf<Oscillator> field;
  Flow flow(field, chosen());
  const VectorXd z0 = vector({0.8, -0.6}), p = vector({1.0});
  const FlowEnd there = flow.run(0.0, 5.0, z0, p, no_directions(field));
  const FlowEnd& back = flow.run(5.0, 0.0, there.state, p, no_directions(field));
  EXPECT_LE(largest(back.state - z0), error_bound(flow, 1.0));
  EXPECT_LE(largest(back.quadrature + there.quadrature), error_bound(flow, 1.0, 5.0));
}

TEST_P(EveryMethod, DenseOutputFollowsTheClosedFormEverywhere) {
  const FieldOf<Oscillator> field;
  const VectorXd z0 = vector({0.8, -0.6}), w0 = vector({7.0}), p = vector({1.3});
  for (const double t1 : {5.0, -5.0}) {
    Flow flow(field, chosen());
    const Trajectory trajectory = flow.record(0.0, t1, z0, w0, p);
    EXPECT_EQ(trajectory.start_time(), 0.0);
    EXPECT_EQ(trajectory.end_time(), t1);
    for (int i = 0; i <= 1000; ++i) {
      const double t = t1 * i / 1000.0;
      const Exact<Oscillator> exact(0.0, t, z0, p);
      const VectorXd at = trajectory.at(t);
      ASSERT_EQ(at.size(), 3);
      ASSERT_LE(largest(at.head(2) - exact.state), error_bound(flow, 2.0, 5.0)) << t;
      ASSERT_LE(largest(at.tail(1) - w0 - exact.quadrature), error_bound(flow, 2.0, 5.0)) << t;
    }
    EXPECT_EQ(trajectory.at(-t1), trajectory.at(0.0)) << "times before the start are clamped";
    EXPECT_EQ(trajectory.at(2.0 * t1), trajectory.at(t1)) << "times after the end are clamped";
  }
}

// Two integrators made alike, one in memory filled with rubbish (0x7f, which reads as 1e306). Sanitizers ignore mallopt.
TEST_P(EveryMethod, DoesNotReadMemoryItHasNotWritten) {
  const FieldOf<Oscillator> field;
  const VectorXd z0 = vector({0.8, -0.6}), p = vector({1.3});
  Flow clean(field, chosen()), rubbish(field, chosen());
  const VectorXd expected = clean.run(0.0, 2.0, z0, p, all_directions(field)).state;
  mallopt(M_PERTURB, 0x80);
  try {
    EXPECT_EQ(rubbish.run(0.0, 2.0, z0, p, all_directions(field)).state, expected);
  } catch (const std::exception& failure) {
    ADD_FAILURE() << failure.what();
  }
  mallopt(M_PERTURB, 0);
}

INSTANTIATE_TEST_SUITE_P(Flow, EveryMethod,
                         testing::Combine(testing::Values(Method::adams, Method::bdf, Method::runge_kutta),
                                          testing::Values(1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 1e-13)),
                         [](const auto& test) {
                           const auto digits = std::lround(-std::log10(std::get<1>(test.param)));
                           return name(std::get<0>(test.param)) + '_' + std::to_string(digits);
                         });

// A method of order q with local error tol has global error ~ tol^(q/(q+1)): with q ≥ 3 a hundredth of the tolerance leaves
// at most a thirtieth of the error; half of that is granted to chance.
TEST(Flow, ErrorShrinksWithTheTolerance) {
  const FieldOf<Oscillator> field;
  const VectorXd z0 = vector({0.8, -0.6}), p = vector({1.3});
  const Exact<Oscillator> exact(0.0, 20.0, z0, p);
  for (const Method method : {Method::adams, Method::bdf, Method::runge_kutta}) {
    double previous = 1e300;
    for (const double tolerance : {1e-5, 1e-7, 1e-9, 1e-11}) {
      Flow flow(field, options(method, tolerance));
      const FlowEnd& end = flow.run(0.0, 20.0, z0, p, all_directions(field));
      const double error = std::max(largest(end.state - exact.state),
                                    largest(end.state_directions - exact.state_derivative.leftCols(3)));
      EXPECT_LT(error, previous / 15.0) << tolerance;
      previous = error;
    }
  }
}

TEST(Flow, BdfIsTheMethodForStiffFields) {
  const FieldOf<StiffRelaxation> field;
  Flow adams(field, options(Method::adams, 1e-6)), bdf(field, options(Method::bdf, 1e-6));
  for (Flow* flow : {&adams, &bdf}) flow->run(0.0, 2.0, vector({1.5}), vector({1e4}), no_directions(field));
  EXPECT_LT(10 * bdf.statistics().steps, adams.statistics().steps) << "stability, not accuracy, bounds the step of Adams";
}

TEST(Flow, TransitionMatricesCompose) {
  const FieldOf<ModulatedRotation> field;
  Flow flow(field, options(Method::adams, 1e-11));
  const VectorXd z0 = vector({0.8, -0.6}), p = vector({1.5});
  const Directions identity{MatrixXd::Identity(2, 2), MatrixXd::Zero(1, 2)};
  const FlowEnd first = flow.run(0.2, 1.7, z0, p, identity);
  const FlowEnd second = flow.run(1.7, 3.1, first.state, p, identity);
  const FlowEnd& both = flow.run(0.2, 3.1, z0, p, identity);
  EXPECT_LE(largest(both.state_directions - second.state_directions * first.state_directions), error_bound(flow, 1.0));
  EXPECT_NEAR(both.state_directions.determinant(), 1.0, 2.0 * error_bound(flow, 1.0)) << "a field without divergence";
}

// The error of a central difference is h²/6 times the third derivative: a quarter when h is halved, as long as that is far
// above the tolerance over h.
TEST(Flow, DifferencesConvergeToTheSensitivityAtTheirOrder) {
  const FieldOf<Oscillator> field;
  Flow flow(field, options(Method::adams, 1e-13));
  const VectorXd z0 = vector({0.8, -0.6});
  const MatrixXd sensitivity =
      flow.run(0.0, 3.0, z0, vector({1.3}), {MatrixXd::Zero(2, 1), MatrixXd::Ones(1, 1)}).state_directions;
  const auto error = [&](double h) {
    const VectorXd above = flow.run(0.0, 3.0, z0, vector({1.3 + h}), no_directions(field)).state;
    const VectorXd below = flow.run(0.0, 3.0, z0, vector({1.3 - h}), no_directions(field)).state;
    return ((above - below) / (2.0 * h) - sensitivity).norm();
  };
  for (const double h : {0.04, 0.02, 0.01, 0.005}) EXPECT_NEAR(error(h) / error(h / 2.0), 4.0, 0.05) << h;
}

TEST(Flow, OnlyTheDirectionsAskedForAreIntegrated) {
  const FieldOf<Oscillator> field;
  Flow flow(field);
  const VectorXd z0 = vector({0.8, -0.6}), p = vector({1.3});
  const FlowEnd none = flow.run(0.0, 5.0, z0, p, no_directions(field));
  EXPECT_EQ(none.state_directions.cols(), 0);
  EXPECT_EQ(none.quadrature_directions.cols(), 0);
  EXPECT_EQ(flow.statistics().sensitivity_evaluations, 0);
  EXPECT_GT(flow.statistics().steps, 0);
  EXPECT_GE(flow.statistics().rhs_evaluations, flow.statistics().steps);

  const Directions one{Vector2d(3.0, 4.0), MatrixXd::Constant(1, 1, 0.5)};
  const FlowEnd& end = flow.run(0.0, 5.0, z0, p, one);
  ASSERT_EQ(end.state_directions.cols(), 1);
  EXPECT_GT(flow.statistics().sensitivity_evaluations, 0);
  EXPECT_EQ(flow.statistics().integrations, 2);
  const Exact<Oscillator> exact(0.0, 5.0, z0, p);
  const Eigen::Vector3d weights(3.0, 4.0, 0.5);
  EXPECT_LE(largest(end.state_directions - exact.state_derivative.leftCols(3) * weights), error_bound(flow, 10.0, 5.0));
  EXPECT_LE(largest(end.quadrature_directions - exact.quadrature_derivative.leftCols(3) * weights),
            error_bound(flow, 10.0, 5.0));
}

TEST(Flow, ArcOfNoLengthIsTheIdentity) {
  const FieldOf<Oscillator> field;
  Flow flow(field);
  const VectorXd z0 = vector({0.8, -0.6}), w0 = vector({7.0}), p = vector({1.3});
  const Directions all = all_directions(field);
  const FlowEnd& end = flow.run(1.0, 1.0, z0, p, all);
  EXPECT_EQ(end.state, z0);
  EXPECT_EQ(end.quadrature, vector({0.0}));
  EXPECT_EQ(end.state_directions, all.state);
  EXPECT_EQ(end.quadrature_directions, MatrixXd::Zero(1, 3));
  EXPECT_EQ(end.state_rate, vector({-0.6, -1.3 * 1.3 * 0.8}));
  EXPECT_EQ(end.quadrature_rate, vector({0.8}));
  const Trajectory point = flow.record(1.0, 1.0, z0, w0, p);
  EXPECT_EQ(point.at(1.0), vector({0.8, -0.6, 7.0}));
  EXPECT_EQ(point.at(9.0), vector({0.8, -0.6, 7.0}));
}

TEST(Flow, MemoryIsReused) {
  const FieldOf<Oscillator> field;
  Flow flow(field);
  const VectorXd z0 = vector({0.8, -0.6}), p = vector({1.3});
  const Directions all = all_directions(field), none = no_directions(field);
  const VectorXd first = flow.run(0.0, 5.0, z0, p, all).state;
  flow.run(0.0, 5.0, z0, p, none);
  const long before = allocations;
  for (int i = 0; i < 20; ++i) {
    flow.run(0.0, 1.0, z0, p, none);
    flow.run(0.0, 2.0, z0, p, all);
  }
  EXPECT_EQ(allocations, before);
  EXPECT_EQ(flow.run(0.0, 5.0, z0, p, all).state, first) << "what was integrated in between leaves no trace";
}

TEST(Flow, RefusesOptionsAndSizesThatCannotBe) {
  const FieldOf<Oscillator> field;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const FlowOptions& wrong :
       {FlowOptions{.tolerance = {-1e-6, 1e-6}}, FlowOptions{.tolerance = {nan, 1e-6}},
        FlowOptions{.tolerance = {1e-6, 0.0}}, FlowOptions{.tolerance = {1e-6, nan}},
        FlowOptions{.tolerance = {}, .max_steps = 0}, FlowOptions{.tolerance = {}, .longest_step = -0.1}}) {
    EXPECT_THROW(Flow(field, wrong), BadInput);
    Flow flow(field);
    EXPECT_THROW(flow.set_options(wrong), BadInput);
  }
  Flow flow(field);
  const std::vector<double> three(3), four(4), one(1), two(2);
  EXPECT_THROW((void)flow.advance(0.0, 1.0, three, two, 1), BadInput);
  EXPECT_THROW((void)flow.advance(0.0, 1.0, four, one, 1), BadInput);
  EXPECT_THROW((void)flow.record(0.0, 1.0, vector({1.0}), VectorXd::Zero(field.quadratures()), vector({1.3})), BadInput);
}

TEST(Flow, CountsWhatStepLimitsEnd) {
  const FieldOf<Oscillator> field;
  for (const Method method : {Method::adams, Method::bdf, Method::runge_kutta}) {
    FlowOptions few = options(method, 1e-10);
    few.max_steps = 3;
    Flow flow(field, few);
    const VectorXd z0 = vector({0.8, -0.6}), p = vector({1.3});
    EXPECT_THROW((void)flow.run(0.0, 50.0, z0, p, no_directions(field)), LeftDomain);
    EXPECT_THROW((void)flow.record(0.0, 50.0, z0, VectorXd::Zero(field.quadratures()), p), LeftDomain);
    EXPECT_EQ(flow.statistics().exhausted, 2);
  }
}

TEST(Flow, MethodAndToleranceCanBeChangedLater) {
  const FieldOf<Oscillator> field;
  const VectorXd z0 = vector({0.8, -0.6}), p = vector({1.3});
  Flow changed(field, options(Method::adams, 1e-6)), fresh(field, options(Method::bdf, 1e-9));
  changed.run(0.0, 5.0, z0, p, no_directions(field));
  changed.set_options(fresh.options());
  EXPECT_EQ(changed.run(0.0, 5.0, z0, p, no_directions(field)).state,
            fresh.run(0.0, 5.0, z0, p, no_directions(field)).state);
}

}  // namespace
}  // namespace costate
