/// Shots: the chain rule from a problem's unknowns through the flow, both end times included.
#include "closed_flows.hpp"

#include <costate/error.hpp>
#include <costate/shot.hpp>

#include <gtest/gtest.h>
#include <set>
#include <string>

namespace costate {
namespace {

using namespace closed;

const FieldOf<ModulatedRotation> rotation;
const FlowOptions tight{.tolerance = {1e-12, 1e-12}, .method = Method::adams, .max_steps = 20000};
/// A few hundred steps at 1e-12 over an arc of length 3 that magnifies nothing but by the rates of the jets, below 4.
constexpr double tolerance = 500 * 1e-12 * 4;

/// Where an arc of the rotation ends for inputs on any scalar that has sin and cos; w0 is added to the quadrature.
struct Inputs {
  Jet t0, t1, z1, z2, w0, a;
};
ArcEnd shoot(const Inputs& in) {
  FlowCache flows;
  flows.set_options(tight);
  Shot shot(flows, {}, {}, 0);
  return shot.arc(
      {.field = &rotation, .t0 = in.t0, .t1 = in.t1, .state = {in.z1, in.z2}, .quadrature = {in.w0}, .parameter = {in.a}});
}
/// The same in closed form, on jets.
ArcEnd closed_form(const Inputs& in) {
  const Jet angle = in.a * (sin(in.t1) - sin(in.t0));
  const Jet c = cos(angle), s = sin(angle);
  const Jet end = in.z1 * s + in.z2 * c;
  return {{in.z1 * c - in.z2 * s, end}, {in.w0 + end - in.z2}};
}

void expect_equal(const Jet& computed, const Jet& expected, double bound) {
  EXPECT_NEAR(computed.value, expected.value, bound);
  std::set<int> columns;
  for (const auto* gradient : {&computed.gradient(), &expected.gradient()}) {
    for (const auto& entry : *gradient) columns.insert(entry.column);
  }
  for (const int column : columns) {
    EXPECT_NEAR(computed.derivative(column), expected.derivative(column), bound) << "column " << column;
  }
}
void expect_equal(const ArcEnd& computed, const ArcEnd& expected, double bound = tolerance) {
  ASSERT_EQ(computed.state.size(), expected.state.size());
  ASSERT_EQ(computed.quadrature.size(), expected.quadrature.size());
  for (std::size_t i = 0; i < expected.state.size(); ++i) expect_equal(computed.state[i], expected.state[i], bound);
  for (std::size_t i = 0; i < expected.quadrature.size(); ++i) {
    expect_equal(computed.quadrature[i], expected.quadrature[i], bound);
  }
}
std::set<int> columns(const Jet& a) {
  std::set<int> present;
  for (const auto& entry : a.gradient()) present.insert(entry.column);
  return present;
}

// A field that knows the time tells ∂/∂t0 from −∂/∂t1, so every end time is a column of its own.
TEST(Shot, EveryInputInAColumnOfItsOwn) {
  const Inputs in{Jet::variable(0.3, 5),  Jet::variable(2.9, 2), Jet::variable(0.8, 7),
                  Jet::variable(-0.6, 9), Jet::variable(4.0, 1), Jet::variable(1.5, 3)};
  expect_equal(shoot(in), closed_form(in));
}

TEST(Shot, OneEndTimeAtATime) {
  const Inputs start{Jet::variable(0.3, 0), 2.9, 0.8, -0.6, 4.0, 1.5};
  expect_equal(shoot(start), closed_form(start));
  const Inputs end{0.3, Jet::variable(2.9, 0), 0.8, -0.6, 4.0, 1.5};
  expect_equal(shoot(end), closed_form(end));
  EXPECT_EQ(columns(shoot(end).state[0]), std::set{0});
}

TEST(Shot, BackwardInTime) {
  const Inputs in{Jet::variable(2.9, 0), Jet::variable(0.3, 1), Jet::variable(0.8, 2), -0.6, 4.0, Jet::variable(1.5, 3)};
  expect_equal(shoot(in), closed_form(in));
}

// One unknown that moves everything at once: fewer columns than inputs.
TEST(Shot, ManyInputsOfOneColumn) {
  const Jet x = Jet::variable(0.7, 4);
  const Inputs in{0.5 * x, 4.0 * x, cos(x), -sin(x), x * x, 2.0 * x};
  expect_equal(shoot(in), closed_form(in));
  EXPECT_EQ(columns(shoot(in).state[1]), std::set{4});
}

// Five unknowns behind one input: fewer inputs than columns.
TEST(Shot, OneInputOfManyColumns) {
  const Jet sum(0.8, {{0, 1.0}, {1, -2.0}, {2, 0.5}, {3, 3.0}, {6, -1.0}});
  const Inputs in{0.3, Jet(2.9, {{6, 1.0}, {8, 2.0}}), sum, -0.6, Jet(4.0, {{11, 1.0}}), 1.5};
  expect_equal(shoot(in), closed_form(in));
}

TEST(Shot, ConstantInputsGiveConstantEnds) {
  const ArcEnd end = shoot({0.3, 2.9, 0.8, -0.6, 4.0, 1.5});
  for (const Jet& z : end.state) EXPECT_TRUE(z.gradient().empty());
  EXPECT_TRUE(end.quadrature[0].gradient().empty());
}

TEST(Shot, ArcOfNoLengthStillKnowsItsEndTimes) {
  const Inputs in{Jet::variable(0.3, 0), Jet::variable(0.3, 1), Jet::variable(0.8, 2), -0.6, 4.0, 1.5};
  expect_equal(shoot(in), closed_form(in), 1e-15);
}

// Independent of the closed form: h²/6·|f'''| + tolerance/h, with third derivatives below 10.
TEST(Shot, EndTimesAgreeWithDifferences) {
  constexpr double h = 1e-4;
  const ArcEnd end = shoot({Jet::variable(0.3, 0), Jet::variable(2.9, 1), 0.8, -0.6, 4.0, 1.5});
  for (const int column : {0, 1}) {
    const auto moved = [&](double by) {
      return shoot({column == 0 ? 0.3 + by : 0.3, column == 1 ? 2.9 + by : 2.9, 0.8, -0.6, 4.0, 1.5});
    };
    const ArcEnd above = moved(h), below = moved(-h);
    const double bound = 10 * h * h / 6 + tolerance / h / 10;
    for (std::size_t i = 0; i < 2; ++i) {
      EXPECT_NEAR(end.state[i].derivative(column), (above.state[i].value - below.state[i].value) / (2 * h), bound);
    }
    EXPECT_NEAR(end.quadrature[0].derivative(column), (above.quadrature[0].value - below.quadrature[0].value) / (2 * h),
                bound);
  }
}

TEST(Shot, ArcsInARowAreOneArc) {
  FlowCache flows;
  flows.set_options(tight);
  Shot shot(flows, {Jet::variable(1.1, 0), Jet::variable(0.8, 1)}, {Jet(1.5)}, 1);
  const ArcEnd first = shot.arc({.arc = 0,
                                 .field = &rotation,
                                 .t0 = 0.3,
                                 .t1 = shot.unknown(0),
                                 .state = {shot.unknown(1), -0.6},
                                 .quadrature = {4.0},
                                 .parameter = {shot.parameter(0)}});
  const ArcEnd second = shot.arc({.arc = 1,
                                  .field = &rotation,
                                  .t0 = shot.unknown(0),
                                  .t1 = 2.9,
                                  .state = first.state,
                                  .quadrature = first.quadrature,
                                  .parameter = {shot.parameter(0)}});
  // The junction's place does not matter, so its column is zero.
  expect_equal(second, closed_form({0.3, 2.9, Jet::variable(0.8, 1), -0.6, 4.0, 1.5}), 2 * tolerance);
  ASSERT_EQ(shot.arcs().size(), 2U);
  EXPECT_EQ(shot.arcs()[1].t0, 1.1);
  EXPECT_EQ(shot.arcs()[1].quadrature[0], first.quadrature[0].value);
  shot.complete({10.0}, {0.5});
  EXPECT_EQ(shot.arcs()[0].quadrature[0], 14.0);
  EXPECT_EQ(shot.arcs()[0].constants, std::vector{0.5});
  shot.row(0, second.state[0]);
  EXPECT_EQ(shot.rows()[0].value, second.state[0].value);
}

TEST(Shot, NamesTheArcThatLeftItsDomain) {
  const FieldOf<FiniteEscape> escape;
  const FieldOf<RootBorder> border;
  FlowCache flows;
  Shot shot(flows, {}, {}, 0);
  for (const Jet& start : {Jet(0.0), Jet::variable(0.0, 0)}) {
    try {
      shot.arc({.arc = 2, .field = &escape, .t0 = start, .t1 = 3.0, .state = {1.0}});
      ADD_FAILURE() << "no exception";
    } catch (const LeftDomain& failure) {
      EXPECT_EQ(std::string(failure.what()).substr(0, 5), "arc 3") << failure.what();
    }
    EXPECT_THROW(shot.arc({.field = &border, .t0 = start, .t1 = 1.0, .state = {2.0, 0.0}}), LeftDomain);
  }
  EXPECT_TRUE(shot.arcs().empty()) << "an arc that failed is not recorded";
}

TEST(Shot, RefusesAnArcThatStartsFromTooLittle) {
  const FieldOf<RootBorder> border;
  FlowCache flows;
  Shot shot(flows, {}, {}, 0);
  EXPECT_THROW(shot.arc({.field = &border, .t0 = 0.0, .t1 = 1.0, .state = {2.0}}), BadInput);
  EXPECT_THROW(shot.arc({.field = &border, .t0 = 0.0, .t1 = 1.0, .state = {0.5, 0.0}, .quadrature = {1.0}}), BadInput);
  EXPECT_THROW(shot.arc({.field = &border, .t0 = 0.0, .t1 = 1.0, .state = {0.5, 0.0}, .parameter = {1.0}}), BadInput);
}

TEST(FlowCache, KeepsOneFlowForEachFieldAndAddsUp) {
  const FieldOf<ModulatedRotation> other;
  FlowCache flows;
  Flow& flow = flows[rotation];
  EXPECT_EQ(&flows[rotation], &flow);
  EXPECT_NE(&flows[other], &flow);
  EXPECT_EQ(&flows[rotation], &flow) << "also after others came";
  for (Flow* each : {&flow, &flows[other]}) {
    each->run(0.0, 2.0, vector({0.8, -0.6}), vector({1.5}), all_directions(rotation));
  }
  const Statistics one = flow.statistics(), sum = flows.statistics();
  EXPECT_GT(one.steps, 0);
  EXPECT_EQ(sum.integrations, 2);
  EXPECT_EQ(sum.steps, one.steps + flows[other].statistics().steps);
  EXPECT_EQ(sum.rhs_evaluations, one.rhs_evaluations + flows[other].statistics().rhs_evaluations);
  EXPECT_EQ(sum.sensitivity_evaluations, one.sensitivity_evaluations + flows[other].statistics().sensitivity_evaluations);

  flows.set_options(tight);
  EXPECT_EQ(flow.options().tolerance.relative, tight.tolerance.relative) << "options reach flows that exist";
}

}  // namespace
}  // namespace costate
