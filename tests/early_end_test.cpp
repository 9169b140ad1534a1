/// Every way an integration can end before its time, and that the flow is as good as new afterwards.
#include "closed_flows.hpp"

#include <costate/error.hpp>

#include <gtest/gtest.h>
#include <numbers>
#include <string>

namespace costate {
namespace {

using namespace closed;
using Eigen::VectorXd;

/// The message of the LeftDomain that `body` must throw.
template <class Body>
std::string left_domain(Body body) {
  try {
    body();
  } catch (const LeftDomain& failure) {
    return failure.what();
  }
  return "no LeftDomain was thrown";
}

/// The time a message names: "… t = 0.99…".
double time_named(const std::string& message) {
  const auto at = message.find("t = ");
  return at == std::string::npos ? std::nan("") : std::stod(message.substr(at + 4));
}

/// Some ends are only found by creeping up to them until the steps are used up.
FlowOptions bounded(Method method) {
  FlowOptions chosen = options(method, 1e-8);
  chosen.max_steps = 20000;
  return chosen;
}

class EarlyEnd : public testing::TestWithParam<Method> {};

TEST_P(EarlyEnd, FiniteEscapeNamesItsTime) {
  const FieldOf<FiniteEscape> field;
  Flow flow(field, bounded(GetParam()));
  for (const Directions& directions : {no_directions(field), all_directions(field)}) {
    const auto message = left_domain([&] { flow.run(0.0, 3.0, vector({1.0}), VectorXd(0), directions); });
    EXPECT_NEAR(time_named(message), 1.0, 1e-4) << message;
    EXPECT_NEAR(flow.run(0.0, 0.5, vector({1.0}), VectorXd(0), directions).state[0], 2.0, 1e-5) << "usable afterwards";
  }
}

TEST_P(EarlyEnd, BorderOfTheDomainNamesItsTime) {
  const FieldOf<RootBorder> field;
  Flow flow(field, bounded(GetParam()));
  const VectorXd z0 = vector({0.0, 0.0});
  for (const Directions& directions : {no_directions(field), all_directions(field)}) {
    const auto message = left_domain([&] { flow.run(0.0, 3.0, z0, VectorXd(0), directions); });
    EXPECT_NEAR(time_named(message), 1.0, 1e-2) << message;
    // y = ⅔(1 − (1 − t)^(3/2))
    EXPECT_NEAR(flow.run(0.0, 0.5, z0, VectorXd(0), directions).state[1], 2.0 / 3.0 * (1.0 - std::pow(0.5, 1.5)), 1e-6);
  }
  const auto outside = left_domain([&] { flow.run(0.0, 1.0, vector({2.0, 0.0}), VectorXd(0), no_directions(field)); });
  EXPECT_EQ(time_named(outside), 0.0) << outside;
  EXPECT_NE(outside.find("not finite"), std::string::npos) << outside;
  EXPECT_THROW(flow.run(0.0, 0.0, vector({2.0, 0.0}), VectorXd(0), no_directions(field)), LeftDomain);
}

TEST_P(EarlyEnd, StepLimitIsNamed) {
  const FieldOf<Oscillator> field;
  const VectorXd z0 = vector({0.8, -0.6}), w0 = vector({0.0}), p = vector({1.3});
  FlowOptions few = bounded(GetParam());
  few.max_steps = 10;
  Flow flow(field, few);
  const auto run = left_domain([&] { flow.run(0.0, 50.0, z0, p, no_directions(field)); });
  EXPECT_NE(run.find("step limit"), std::string::npos) << run;
  EXPECT_GT(time_named(run), 0.0) << run;
  const auto record = left_domain([&] { flow.record(0.0, 50.0, z0, w0, p); });
  EXPECT_NE(record.find("step limit"), std::string::npos) << record;
}

// Not even if the integrator gets past the point with a shorter step.
TEST_P(EarlyEnd, OtherExceptionsOfTheFieldPassThrough) {
  int complaints = 0;
  const FieldOf<EndingTable> field(EndingTable{&complaints});
  Flow flow(field, bounded(GetParam()));
  const VectorXd z0 = vector({1.0}), w0 = vector({0.0});
  for (const double end_of_table : {0.5, -1.0}) {
    for (const Directions& directions : {no_directions(field), all_directions(field)}) {
      complaints = 0;
      try {
        flow.run(0.0, 1.0, z0, vector({end_of_table}), directions);
        ADD_FAILURE() << "no exception";
      } catch (const std::out_of_range& failure) {
        EXPECT_STREQ(failure.what(), "the table ends here");
      }
      const FlowEnd& end = flow.run(0.0, 1.0, z0, vector({9.0}), directions);
      EXPECT_NEAR(end.state[0], std::numbers::e, 1e-5) << "usable afterwards";
    }
    complaints = 0;
    EXPECT_THROW(flow.record(0.0, 1.0, z0, w0, vector({end_of_table})), std::out_of_range);
  }
}

INSTANTIATE_TEST_SUITE_P(Flow, EarlyEnd, testing::Values(Method::adams, Method::bdf, Method::runge_kutta),
                         [](const auto& test) { return name(test.param); });

}  // namespace
}  // namespace costate
