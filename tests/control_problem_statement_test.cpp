// What follows from a statement besides its solution: refusals, names, guesses, exact Jacobians, scene parameters.
#include "small_problems.hpp"

#include <costate/control_problem.hpp>
#include <costate/shooting/solve.hpp>

#include <gtest/gtest.h>

namespace costate {
namespace {

using small::contains;
using small::thrown;

/// x' = v, v' = u − k v, L = u²/2.
struct Slider {
  static constexpr int states = 2, controls = 1, parameters = 1;
  template <class S>
  Vec<S, 2> dynamics(const Vec<S, 2>& q, const Vec<S, 1>& u, const Vec<S, 1>& p) const {
    return {q[1], u[0] - p[0] * q[1]};
  }
  template <class S>
  S cost(const Vec<S, 2>&, const Vec<S, 1>& u, const Vec<S, 1>&) const {
    return 0.5 * u[0] * u[0];
  }
};

using Statement = ControlProblem<Slider>;

Statement slider(Control bounds = {.lower = -5.0, .upper = 5.0}) {
  Statement problem;
  problem.state("x", {.start = 0.0, .end = 1.0}).state("v", {.start = 0.0, .end = 0.0}).control("u", bounds);
  problem.parameter("k", 0.0, "1/s").final_time(1.0);
  return problem;
}

std::string refusal(const Statement& problem) {
  return thrown<BadInput>([&] { (void)problem.shared(); });
}

TEST(Statement, MustBeComplete) {
  Statement none;
  EXPECT_TRUE(contains(refusal(none), "the system has 2 states, but 0 are described"));
  auto problem = slider();
  EXPECT_TRUE(contains(refusal(problem), "no arcs"));
  auto timeless = slider();
  timeless.final_time(0.0).interior();
  EXPECT_TRUE(contains(refusal(timeless), "final time = 0 s is not admissible"));
  auto unbounded = slider({.lower = -5.0});
  unbounded.upper();
  EXPECT_TRUE(contains(refusal(unbounded), "the upper bound of u, which has none"));
}

TEST(Statement, NamesWhatIsWrong) {
  auto bounds = slider({.lower = 5.0, .upper = -5.0});
  bounds.interior();
  EXPECT_TRUE(contains(refusal(bounds), "lower bound of u = 5 is not admissible: below its upper bound -5"));
  auto twice = slider().parameter("k", 1.0);
  EXPECT_TRUE(contains(refusal(twice), "1 parameters, but 2 are described"));
  auto unknown = slider();
  unknown.interior().boundary("wall").interior();
  EXPECT_TRUE(contains(refusal(unknown), "no constraint 'wall'"));
  auto durations = slider();
  durations.upper({.duration = 0.7}).interior({.duration = 0.6}).lower();
  EXPECT_TRUE(contains(refusal(durations), "leave -0.3 s of 1 s"));
  auto same = slider();
  same.constraint("u", [](const auto& q, const auto&) { return q[1] - 1.0; }).interior();
  EXPECT_TRUE(contains(refusal(same), "the name 'u' is used twice"));
}

TEST(Statement, NeedsARowAtEveryJunction) {
  auto problem = slider();
  problem.interior().interior();
  EXPECT_TRUE(contains(refusal(problem), "nothing marks the junction between arc 1 'interior' and arc 2 'interior'"));
  auto last = slider();
  last.lower().singular();
  EXPECT_TRUE(contains(refusal(last), "4 rows for 3 unknowns"));
  auto touch = slider();
  touch.constraint("speed", [](const auto& q, const auto&) { return q[1] - 1.0; }).upper().touch("speed").interior();
  EXPECT_TRUE(contains(refusal(touch), "touched between two interior arcs"));
  EXPECT_TRUE(contains(thrown<BadInput>([] { slider().touch("speed"); }), "not before the first"));
}

TEST(Statement, FindsTheOrderOfAConstraint) {
  const auto rows = [](Statement& problem) {
    std::vector<std::string> names;
    const auto stated = problem.shared();
    for (const Row& row : stated->rows()) names.push_back(row.name);
    return names;
  };
  auto first = slider();
  first.constraint("speed", [](const auto& q, const auto&) { return q[1] - 1.0; }).interior().boundary("speed").interior();
  EXPECT_EQ(rows(first), (std::vector<std::string>{"switching function at t1", "speed at t1", "switching function at t2",
                                                   "value of x at the end", "value of v at the end"}));
  auto second = slider();
  second.constraint("wall", [](const auto& q, const auto&) { return q[0] - 1.0; }).interior().boundary("wall").interior();
  EXPECT_EQ(rows(second).at(2), "rate of wall at t1");
  auto third = slider();
  third.constraint("nothing", [](const auto& q, const auto&) { return 0.0 * q[0] - 1.0; }).interior();
  EXPECT_TRUE(contains(refusal(third), "neither the first nor the second time derivative of the constraint nothing"));
}

TEST(Statement, RefusesAnOrderThatIsWrong) {
  auto second = slider();
  second.constraint("speed", [](const auto& q, const auto&) { return q[1] - 1.0; }, {.order = 2}).interior();
  EXPECT_TRUE(contains(refusal(second), "order of speed = 2 is not admissible: 1,"));
  auto first = slider();
  first.constraint("wall", [](const auto& q, const auto&) { return q[0] - 1.0; }, {.order = 1}).interior();
  EXPECT_TRUE(contains(refusal(first), "order of wall = 1 is not admissible: 2,"));
  auto third = slider();
  third.constraint("wall", [](const auto& q, const auto&) { return q[0] - 1.0; }, {.order = 3}).interior();
  EXPECT_TRUE(contains(refusal(third), "order of wall = 3 is not admissible: 1, 2, or 0"));
}

TEST(Statement, RefusesConstantsOutsideTheBounds) {
  for (const double value : {7.0, -5.5, std::numeric_limits<double>::quiet_NaN()}) {
    auto problem = slider();
    problem.constant({value});
    EXPECT_TRUE(contains(refusal(problem), "is not admissible: a number within -5 … 5")) << value;
  }
  auto within = slider();
  within.constant({5.0}).constant({-5.0}).constant({5.0});
  EXPECT_EQ(refusal(within), "");
}

TEST(Statement, RefusesTheSameControlTwiceInTurn) {
  auto bounds = slider();
  bounds.lower().upper().upper();
  EXPECT_TRUE(contains(refusal(bounds), "nothing marks the junction between arc 2 'upper' and arc 3 'upper'"));
  auto constants = slider();
  constants.upper().constant({5.0});
  EXPECT_TRUE(contains(refusal(constants), "nothing marks the junction between arc 1 'upper' and arc 2 'constant'"));
}

TEST(Statement, RefusesNamesThatAreDerived) {
  for (const std::string name : {"u_lower", "x_start", "v_end", "lambda_x", "final_time"}) {
    Statement problem;
    problem.state("x", {.start = 0.0, .end = 1.0}).state("v", {.start = 0.0, .end = 0.0});
    problem.control("u", {.lower = -5.0, .upper = 5.0}).parameter(name, 0.0).final_time(1.0).interior();
    EXPECT_TRUE(contains(refusal(problem), "the name '" + name + "' is taken"));
  }
}

/// x' = u in minimum time.
struct Runner {
  static constexpr int states = 1, controls = 1, parameters = 0;
  template <class S>
  Vec<S, 1> dynamics(const Vec<S, 1>&, const Vec<S, 1>& u, const Vec<S, 0>&) const {
    return {u[0]};
  }
};

TEST(Statement, RefusesAMinimumTimeThatIsFixed) {
  ControlProblem problem(Runner{});
  problem.state("x", {.start = 0.0, .end = 1.0}).control("u", {.lower = -1.0, .upper = 1.0}).final_time(1.0).upper();
  EXPECT_TRUE(contains(thrown<BadInput>([&] { (void)problem.shared(); }), "final time = 1 s is not admissible"));
}

// H = λ u − 1 has no maximum without bounds.
TEST(Statement, SaysThatHamiltonianGrowsWithoutBound) {
  ControlProblem problem(Runner{});
  problem.state("x", {.start = 0.0, .end = 1.0, .costate = 1.0}).control("thrust").free_final_time(1.0).interior();
  const Solution s = solve(problem.shared());
  EXPECT_FALSE(s.solved());
  EXPECT_TRUE(contains(s.message, "no control thrust with H_u = 0: H grows without bound: give it bounds")) << s.message;
}

// As many arcs as a grid has steps can be told apart in a direct solution, no more.
TEST(Statement, SearchesNoStartForMoreArcsThanSteps) {
  ControlProblem problem(Runner{});
  problem.state("x", {.start = 0.0, .end = 1.0}).control("u", {.lower = -1.0, .upper = 1.0}).free_final_time(1.0);
  for (int i = 0; i < 41; ++i) problem.upper().lower();
  const auto stated = problem.shared();
  std::vector<double> parameters;
  for (const Parameter& parameter : stated->parameters()) parameters.push_back(parameter.value);
  EXPECT_FALSE(stated->search_start(parameters).has_value());
}

// The estimate of costates keeps a control within one bound as within two.
TEST(Statement, EstimatesCostatesWithABoundOnOneSide) {
  auto problem = slider({.lower = 0.0});
  problem.interior();
  EXPECT_TRUE(problem.shared()->start().allFinite());
}

TEST(Statement, NamesUnknownsAndParameters) {
  auto problem = slider();
  problem.upper().interior().lower();
  const auto stated = problem.shared();
  std::vector<std::string> unknowns, parameters;
  for (const Unknown& unknown : stated->unknowns()) unknowns.push_back(unknown.name);
  for (const Parameter& parameter : stated->parameters()) parameters.push_back(parameter.name);
  EXPECT_EQ(unknowns, (std::vector<std::string>{"lambda_x", "lambda_v", "duration 1", "duration 2"}));
  EXPECT_EQ(parameters,
            (std::vector<std::string>{"k", "u_lower", "u_upper", "x_start", "x_end", "v_start", "v_end", "final_time"}));
}

TEST(Statement, GuessesStatesAlongTheArcs) {
  auto problem = slider();
  problem.upper({.duration = 0.2}).interior().lower({.duration = 0.2});
  const auto stated = problem.shared();
  const Eigen::VectorXd z = stated->state_guess(1, 0.25).value();
  ASSERT_EQ(z.size(), 4);
  EXPECT_DOUBLE_EQ(z[0], 0.2 + 0.25 * 0.6);
  EXPECT_EQ(z[1], 0.0);
}

// Where the guessed motion is the true one so are the costates, but for the weight w = 1e-3 that draws them to 0: it moves them by at most
// w² |λ|/σ², with σ² the least eigenvalue of the Gram matrix of how λ(0) enters H_u over the time. From x = 0 to 1 at unit speed against
// friction k = 2, u = λ_v = k and λ_x = k² are constant, λ_v depends on λ(0) by (1 − exp(2t))/2 and exp(2t), and σ² = 0.052: 9e-5.
TEST(Statement, EstimatesCostatesFromTheGuessedMotion) {
  Statement problem;
  problem.state("x", {.start = 0.0, .end = 1.0}).state("v", {.start = 1.0, .end = 1.0}).control("u").parameter("k", 2.0);
  problem.final_time(1.0).interior();
  const auto stated = problem.shared();
  const Eigen::VectorXd y = stated->start();
  const auto at = [&](const std::string& name) { return y[stated->place_of(name)]; };
  EXPECT_NEAR(at("lambda_v"), 2.0, 9e-5);
  EXPECT_NEAR(at("lambda_x"), 4.0, 9e-5);
  EXPECT_NEAR((*stated->state_guess(0, 0.5))[3], 2.0, 9e-5);
  // A costate that is given is taken as it is, and none is estimated.
  Statement given;
  given.state("x", {.start = 0.0, .end = 1.0, .costate = 3.0})
      .state("v", {.start = 1.0, .end = 1.0})
      .control("u")
      .parameter("k", 2.0);
  given.final_time(1.0).interior();
  EXPECT_EQ(given.shared()->start(), Eigen::Vector2d(3.0, 0.0));
}

// Every kind of row at once, away from any root: derivatives against central differences, whose error at step h is h² |R'''|/6 and
// rounding and integration errors over h; at h = 1e-4 with an integration at 1e-13 about 1e-7 for derivatives of order 10.
TEST(Statement, HasAnExactJacobian) {
  Statement problem;
  problem.state("x", {.start = 0.0})
      .state("v", {.guess = 0.3})
      .control("u", {.lower = -5.0, .upper = 5.0})
      .parameter("k", 0.4);
  problem.free_final_time(1.0);
  problem.terminal_cost([](const auto& at) { return at.end[0] * at.end[1] + at.start[1] * at.start[1] * at.time; });
  problem.end_condition("ends",
                        [](const auto& at) { return at.end[0] * at.end[0] + at.start[1] * at.time - at.parameters[0]; });
  problem.constraint("wall", [](const auto& q, const auto&) { return q[0] + 0.2 * q[1] * q[1] - 1.0; });
  problem.constraint("shelf", [](const auto& q, const auto&) { return q[0] - 1.0; });
  problem.upper().interior().boundary("wall").interior().touch("shelf").interior().boundary("shelf").interior();
  Shooting shooting(problem.shared());
  shooting.set_flow_options({.tolerance = {.relative = 1e-13, .absolute = 1e-13}});
  Eigen::VectorXd y(shooting.size());
  for (Eigen::Index i = 0; i < y.size(); ++i) y[i] = 0.2 + 0.1 * std::sin(1.0 + static_cast<double>(i));
  Eigen::MatrixXd jacobian(y.size(), y.size());
  shooting.jacobian(y, jacobian);
  constexpr double h = 1e-4;
  for (Eigen::Index j = 0; j < y.size(); ++j) {
    Eigen::VectorXd up(y.size()), down(y.size()), moved = y;
    moved[j] = y[j] + h;
    shooting.residual(moved, up);
    moved[j] = y[j] - h;
    shooting.residual(moved, down);
    const Eigen::VectorXd difference = (up - down) / (2.0 * h);
    for (Eigen::Index i = 0; i < y.size(); ++i) {
      const auto& problem_ = shooting.problem();
      EXPECT_NEAR(jacobian(i, j), difference[i], 1e-6 * std::max(1.0, std::abs(difference[i])))
          << problem_.rows()[static_cast<std::size_t>(i)].name << " by "
          << problem_.unknowns()[static_cast<std::size_t>(j)].name;
    }
  }
}

// Bounds, ends and time are scene parameters: u = c (1 − 2t) with c = 6 D/T², and the switch at which it is cut moves with the bound.
TEST(Statement, BoundsEndsAndTimeAreParameters) {
  auto problem = slider();
  problem.upper().interior().lower();
  Shooting shooting(problem.shared());
  const Solution before = solve(shooting, shooting.problem().start(), {.accuracy = 1e-10});
  ASSERT_TRUE(before.solved()) << before.message;
  // Twice the length in twice the time at half the thrust is the same motion slowed down: λ_x = −u' falls to a quarter.
  std::vector<double> parameters = shooting.parameters();
  const auto set = [&](const std::string& name, double value) {
    for (std::size_t i = 0; i < parameters.size(); ++i) {
      if (shooting.problem().parameters()[i].name == name) parameters[i] = value;
    }
  };
  set("u_lower", -2.5);
  set("u_upper", 2.5);
  set("x_end", 2.0);
  set("final_time", 2.0);
  shooting.set_parameters(parameters);
  const Solution after = solve(shooting, before.y, {.accuracy = 1e-10});
  ASSERT_TRUE(after.solved()) << after.message;
  EXPECT_NEAR(after["t1"].value, 2.0 * before["t1"].value, 3e-10);
  EXPECT_NEAR(after["lambda_x"].value, 0.25 * before["lambda_x"].value, 4e-10);
  EXPECT_NEAR(after["cost"].value, 0.5 * before["cost"].value, 4e-10);
}

// Without the bounds the control would begin at 6.
TEST(Refusal, OfAControlBeyondItsBounds) {
  auto problem = slider();
  problem.interior();
  const Solution s = solve(problem.shared());
  EXPECT_EQ(s.status, Solution::Status::refused);
  EXPECT_TRUE(contains(s.message, "u below its upper bound is -1") || contains(s.message, "u above its lower bound is -1"))
      << s.message;
}

// With |u| ≤ 7 no bound is reached, and the bangs of the root have negative durations.
TEST(Refusal, OfArcsThatAreNotNeeded) {
  auto problem = slider({.lower = -7.0, .upper = 7.0});
  problem.upper().interior().lower();
  const Solution s = solve(problem.shared());
  EXPECT_EQ(s.status, Solution::Status::refused) << s.message;
}

// The highest position is 1/4 where nothing bounds it.
TEST(Refusal, OfAConstraintNotKept) {
  Statement problem;
  problem.state("x", {.start = 0.0, .end = 0.0}).state("v", {.start = 1.0, .end = -1.0}).control("u").parameter("k", 0.0);
  problem.final_time(1.0).constraint("height", [](const auto& q, const auto&) { return q[0] - 0.2; }).interior();
  const Solution s = solve(problem.shared());
  EXPECT_EQ(s.status, Solution::Status::refused);
  EXPECT_TRUE(contains(s.message, "height <= 0 is -0.05")) << s.message;
}

}  // namespace
}  // namespace costate
