/// Two-point problems as a user states them: what they turn into, what is solved, and what is refused.
#include "bvp_problems.hpp"
#include "small_problems.hpp"

#include <costate/error.hpp>
#include <costate/shooting/branch.hpp>
#include <costate/shooting/solve.hpp>

#include <cmath>
#include <gtest/gtest.h>

namespace costate {
namespace {

using small::contains;
using small::thrown;

constexpr double pi = std::numbers::pi;

/// y'' = −k² y, or with the sign of k² turned, y'' = k² y.
template <int sign>
struct Linear {
  static constexpr int states = 2, parameters = 1;
  template <class S>
  Vec<S, 2> rates(const S&, const Vec<S, 2>& y, const Vec<S, 1>& p) const {
    return {y[1], -static_cast<double>(sign) * p[0] * p[0] * y[0]};
  }
};
using Oscillator = Linear<1>;
using Growth = Linear<-1>;

TwoPoint oscillator(double k = 1.0) {
  TwoPoint problem(Oscillator{}, 0.0, 1.0);
  problem.state("y", {.start = 0.0, .end = 1.0}).state("y'").parameter("k", k);
  return problem;
}

/// The value is within its claimed bound of the reference, and the bound within what was asked.
void expect_known(const Solution& s, const std::string& name, double value, double accuracy) {
  const Quantity& quantity = s[name];
  EXPECT_LE(std::abs(quantity.value - value), quantity.error_bound) << name;
  EXPECT_LE(quantity.error_bound, accuracy * std::max(1.0, std::abs(value))) << name;
}

Solution solved(const TwoPoint& problem, double accuracy) {
  Solution s = solve(problem.shared(), {.accuracy = accuracy});
  EXPECT_TRUE(s.solved()) << s.message;
  return s;
}

template <class List>
std::vector<std::string> names(const List& list) {
  std::vector<std::string> all;
  for (const auto& entry : list) all.push_back(entry.name);
  return all;
}

using Names = std::vector<std::string>;

TEST(TwoPoint, StatesUnknownsRowsAndParametersByName) {
  TwoPoint problem(Oscillator{}, 0.0, 0.5);
  problem.then(Growth{}, 1.5)
      .state("y", {.start = 2.0, .scale = 3.0})
      .state("v", {.end = 4.0, .scale = 5.0, .unit = "m/s"})
      .unknown_parameter("k", {.guess = 0.7, .scale = 2.0, .lower = 0.1, .upper = 9.0})
      .row_at(
          "inner", 0.25, [](const auto& at) { return at.state[0] - at.t; }, 6.0);
  const auto made = problem.shared();
  EXPECT_EQ(names(made->unknowns()), (Names{"v(0)", "k"}));
  EXPECT_EQ(names(made->rows()), (Names{"v(1.5)", "inner"}));
  EXPECT_EQ(names(made->parameters()), (Names{"y(0)", "v(1.5)"}));
  EXPECT_EQ(made->structure(), (Names{"0 … 0.25", "0.25 … 0.5", "0.5 … 1.5"}));
  EXPECT_EQ(names(made->columns()), (Names{"t", "y", "v"}));
  EXPECT_EQ(made->unknowns()[0].scale, 5.0);
  EXPECT_EQ(made->unknowns()[1].scale, 2.0);
  EXPECT_EQ(made->unknowns()[1].lower, 0.1);
  EXPECT_EQ(made->unknowns()[1].upper, 9.0);
  EXPECT_EQ(made->rows()[0].scale, 5.0);
  EXPECT_EQ(made->rows()[1].scale, 6.0);
  EXPECT_EQ(made->parameters()[1].unit, "m/s");
  EXPECT_EQ(made->parameters()[1].value, 4.0);
  // v is not known at the start: the value at the end stands in. y is not known at the end.
  EXPECT_EQ(made->start(), closed::vector({4.0, 0.7}));
  EXPECT_EQ(*made->state_guess(2, 0.5), closed::vector({2.0, 4.0}));
}

TEST(TwoPoint, GuessesAreLinearBetweenTheEndsOrTheUsersOwn) {
  TwoPoint problem(Oscillator{}, -1.0, 3.0);
  problem.state("y", {.start = 1.0, .end = 5.0}).state("y'", {.guess = -2.0}).parameter("k", 1.0);
  EXPECT_EQ(*problem.shared()->state_guess(0, 0.25), closed::vector({2.0, -2.0}));
  problem.guess([](double t) { return std::vector{t, t * t}; });
  const auto own = problem.shared();
  EXPECT_EQ(*own->state_guess(0, 0.75), closed::vector({2.0, 4.0}));
  EXPECT_EQ(own->start(), closed::vector({1.0}));
}

class Accuracy : public testing::TestWithParam<double> {};

TEST_P(Accuracy, IsKeptWithValuesFixedAtBothEnds) {
  const double k = 1.7;
  const Solution s = solved(oscillator(k), GetParam());
  expect_known(s, "y'(0)", k / std::sin(k), GetParam());
  expect_known(s, "y'(1)", k / std::tan(k), GetParam());
  EXPECT_EQ(s["y(0)"].value, 0.0);
  expect_known(s, "y(1)", 1.0, GetParam());
  const std::vector<double> middle = s.at(0.5);
  ASSERT_EQ(middle.size(), 3U);
  EXPECT_EQ(middle[0], 0.5);
  EXPECT_NEAR(middle[1], std::sin(0.5 * k) / std::sin(k), GetParam());
}

/// The least k > 0 with y'' = −k² y, y(0) = y(1) = 0 is π.
TEST_P(Accuracy, IsKeptByAnEigenvalue) {
  TwoPoint problem(Oscillator{}, 0.0, 1.0);
  problem.state("y", {.start = 0.0, .end = 0.0}).state("y'", {.start = 1.0}).unknown_parameter("k", {.guess = 2.5});
  const Solution s = solved(problem, GetParam());
  expect_known(s, "k", pi, GetParam());
  expect_known(s, "y'(1)", -1.0, GetParam());
}

/// y = A cos t + B sin t with y(0) + y(1) = 1 and y'(0) + 2y'(1) = ½: no row is met at one end alone. With c = cos 1 and s = sin 1,
/// (1 + c) A + s B = 1 and −2s A + (1 + 2c) B = ½.
TEST_P(Accuracy, IsKeptWithRowsOnBothEnds) {
  TwoPoint problem(Oscillator{}, 0.0, 1.0);
  problem.state("y")
      .state("y'")
      .parameter("k", 1.0)
      .row("sum", [](const auto& at) { return at.start[0] + at.end[0] - at.parameter[0]; })
      .row("difference", [](const auto& at) { return at.start[1] + 2.0 * at.end[1] - 0.5; });
  const Solution solution = solved(problem, GetParam());
  const double c = std::cos(1.0), s = std::sin(1.0);
  const double determinant = (1.0 + c) * (1.0 + 2.0 * c) + 2.0 * s * s;
  expect_known(solution, "y(0)", (1.0 + 2.0 * c - 0.5 * s) / determinant, GetParam());
  expect_known(solution, "y'(0)", (0.5 * (1.0 + c) + 2.0 * s) / determinant, GetParam());
}

/// sin t reaches ½ at π/6.
TEST_P(Accuracy, IsKeptWithAFreeEnd) {
  TwoPoint problem(Oscillator{}, 0.0, 0.4);
  problem.state("y", {.start = 0.0, .end = 0.5}).state("y'", {.start = 1.0}).parameter("k", 1.0).free_end("T");
  const Solution s = solved(problem, GetParam());
  expect_known(s, "T", pi / 6.0, GetParam());
  expect_known(s, "y'(T)", std::sqrt(0.75), GetParam());
}

/// y = B sin kt, with y(T) = 1/k, kT = π/2 and y'(T) + y'(0) = T: three rows that read values of every kind.
TEST_P(Accuracy, IsKeptWhereRowsReadEverything) {
  TwoPoint problem(Oscillator{}, 0.0, 1.0);
  problem.state("y", {.start = 0.0})
      .state("y'", {.guess = 1.0})
      .unknown_parameter("k", {.guess = 1.2})
      .free_end("T")
      .row("amplitude", [](const auto& at) { return at.end[0] * at.parameter[0] - 1.0; })
      .row("quarter", [](const auto& at) { return at.parameter[0] * (at.b - at.a) - 0.5 * pi; })
      .row("end slope", [](const auto& at) { return at.end[1] + at.start[1] - at.b + at.start[0] + at.a; });
  const Solution s = solved(problem, GetParam());
  // kT = π/2 makes y(T) = B and y'(T) = 0, so with y'(0) = B k: B = 1/k, T = B k = 1, k = π/2.
  expect_known(s, "T", 1.0, GetParam());
  expect_known(s, "k", 0.5 * pi, GetParam());
  expect_known(s, "y'(0)", 1.0, GetParam());
  expect_known(s, "y(T)", 2.0 / pi, GetParam());
}

/// y'' = −y up to 1, y'' = y from there to 2: y = B sin t, then B (sin 1 cosh(t − 1) + cos 1 sinh(t − 1)).
TEST_P(Accuracy, IsKeptWithARightHandSideThatChanges) {
  TwoPoint problem(Oscillator{}, 0.0, 1.0);
  problem.then(Growth{}, 2.0).state("y", {.start = 0.0, .end = 1.0}).state("y'").parameter("k", 1.0);
  const Solution s = solved(problem, GetParam());
  const double b = 1.0 / (std::sin(1.0) * std::cosh(1.0) + std::cos(1.0) * std::sinh(1.0));
  expect_known(s, "y'(0)", b, GetParam());
  expect_known(s, "y(1)", b * std::sin(1.0), GetParam());
  expect_known(s, "y'(1)", b * std::cos(1.0), GetParam());
  EXPECT_NEAR(s.at(1.5)[1], b * (std::sin(1.0) * std::cosh(0.5) + std::cos(1.0) * std::sinh(0.5)), GetParam());
}

/// y = A cos t + B sin t with y(½) = 1 and y'(¾) = ¾, on [−1, 1]: neither end is fixed.
TEST_P(Accuracy, IsKeptWithRowsAtInteriorPoints) {
  TwoPoint problem(Oscillator{}, -1.0, 1.0);
  problem.state("y")
      .state("y'")
      .parameter("k", 1.0)
      .row_at("slope", 0.75, [](const auto& at) { return at.state[1] - at.t; })
      .row_at("value", 0.5, [](const auto& at) { return at.state[0] - at.parameter[0]; });
  const Solution s = solved(problem, GetParam());
  const double determinant = std::cos(0.5) * std::cos(0.75) + std::sin(0.5) * std::sin(0.75);
  const double a = (std::cos(0.75) - 0.75 * std::sin(0.5)) / determinant;
  const double b = (0.75 * std::cos(0.5) + std::sin(0.75)) / determinant;
  expect_known(s, "y(-1)", a * std::cos(1.0) - b * std::sin(1.0), GetParam());
  expect_known(s, "y'(1)", b * std::cos(1.0) - a * std::sin(1.0), GetParam());
  expect_known(s, "y'(0.75)", 0.75, GetParam());
  // The trajectory's clock starts with 0 at a.
  EXPECT_EQ(s.at(1.0)[0], 0.0);
  EXPECT_NEAR(s.at(1.0)[1], a, GetParam());
}

INSTANTIATE_TEST_SUITE_P(TwoPoint, Accuracy, testing::Values(1e-5, 1e-8, 1e-11));

/// y'(0) = y(1) k/sin k: by y(1) it changes with k/sin k, by k with y(1)(sin k − k cos k)/sin² k.
TEST(TwoPoint, SolutionsCanBeContinuedInParametersAndInFixedValues) {
  const double k = 1.3;
  const TwoPoint problem = oscillator(k);
  const Solution s = solved(problem, 1e-10);
  Shooting shooting(problem.shared());
  shooting.set_flow_options({.tolerance = {.relative = 1e-12, .absolute = 1e-12}});
  const auto slope = [&](const std::string& parameter) {
    for (const BranchReport& report : derivatives(shooting, s.y, parameter)) {
      if (report.name == "y'(1)") return report.derivative;
    }
    return std::numeric_limits<double>::quiet_NaN();
  };
  // y'(1) = y(1) k/tan k, with an integration of 1e-12 and a condition of order 1.
  const double sine = std::sin(k);
  EXPECT_NEAR(slope("y(1)"), k / std::tan(k), 1e-9);
  EXPECT_NEAR(slope("k"), 1.0 / std::tan(k) - k / (sine * sine), 1e-9);
  const Branch branch = trace(problem.shared(), {k, 0.0, 1.0}, s.y, "k", 2.0);
  ASSERT_TRUE(branch.reached) << branch.message;
  EXPECT_NEAR(branch.points.back().y[0], 2.0 / std::sin(2.0), 1e-9);
}

/// Rows are differentiated four inputs at a time: all six of these moved ones must come through.
TEST(TwoPoint, RowsAreDifferentiatedInEveryInput) {
  TwoPoint problem(Oscillator{}, 0.0, 1.0);
  problem.state("y", {.guess = 0.3}).state("y'", {.guess = 0.4}).unknown_parameter("k", {.guess = 1.1}).free_end("T");
  const auto g = [](const auto& at) {
    return exp(at.start[0]) * sin(at.start[1] + at.end[0]) + at.end[1] * at.parameter[0] / at.b;
  };
  for (const char* name : {"1", "2", "3", "4"}) problem.row(name, g);
  Shooting shooting(problem.shared());
  shooting.set_flow_options({.tolerance = {.relative = 1e-13, .absolute = 1e-13}});
  const Eigen::VectorXd y = shooting.problem().start();
  // y(T) and y'(T) in closed form, on duals of all four unknowns.
  using D = Dual<double, 4>;
  const auto x = [&](int i) { return D::variable(y[i], i); };
  const D y0 = x(0), v0 = x(1), k = x(2), end = x(3);
  const D y1 = y0 * cos(k * end) + v0 / k * sin(k * end), v1 = v0 * cos(k * end) - k * y0 * sin(k * end);
  const D known = exp(y0) * sin(v0 + y1) + v1 * k / end;
  const Shot& shot = shooting.evaluate(y);
  EXPECT_NEAR(shot.rows()[2].value, known.value, 1e-11);
  for (int i = 0; i < 4; ++i) {
    EXPECT_NEAR(shot.rows()[2].derivative(i), known.gradient[static_cast<std::size_t>(i)], 1e-11) << i;
  }
}

TEST(TwoPoint, ARowOutsideItsDomainIsAFailureNotAThrow) {
  TwoPoint problem(Oscillator{}, 0.0, 1.0);
  problem.state("y", {.start = 0.0}).state("y'").parameter("k", 1.0).row("root", [](const auto& at) {
    return sqrt(at.start[1] - 1e9) - 1.0;
  });
  const Solution s = solve(problem.shared());
  EXPECT_EQ(s.status, Solution::Status::failed);
  EXPECT_TRUE(contains(s.message, "the row 'root' is not finite")) << s.message;
}

/// What is said of an ill-posed statement names what is wrong with it.
TEST(TwoPoint, RefusesIllPosedStatements) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  const auto expect = [](const TwoPoint& problem, std::initializer_list<const char*> parts) {
    const std::string text = thrown<BadInput>([&] { (void)problem.shared(); });
    for (const char* part : parts) EXPECT_TRUE(contains(text, part)) << "'" << part << "' is not in '" << text << "'";
  };
  const auto bare = [](double a = 0.0, double b = 1.0) { return TwoPoint(Oscillator{}, a, b); };
  const auto stated = [&](const TwoPointState& y, const TwoPointState& v = {}) {
    return bare().state("y", y).state("y'", v).parameter("k", 1.0);
  };
  const auto one = [](const auto& at) { return at.start[0] - 1.0; };
  expect(bare(1.0, 1.0), {"point 1 = 1", "above the one before it, 1"});
  expect(bare(1.0, 0.0), {"point 1 = 0", "above"});
  expect(bare(nan), {"point = nan", "finite"});
  expect(oscillator().then(Growth{}, 0.5), {"point 2 = 0.5", "above the one before it, 1"});
  expect(bare().state("y").parameter("k", 1.0), {"2 states", "described are 1 (y)"});
  expect(bare().state("y").state("y'"), {"1 parameters", "described are 0 (none)"});
  expect(oscillator().parameter("mass", 1.0), {"1 parameters", "2 (k, mass)"});
  expect(stated({.start = 0.0}), {"1 unknowns (y'(0))", "0 conditions (none)"});
  expect(stated({.start = 0.0, .end = 1.0}, {.end = 2.0}), {"1 unknowns (y'(0))", "2 conditions (y(1), y'(1))"});
  expect(stated({.start = 0.0}, {.start = 0.0}), {"no unknowns"});
  expect(stated({.start = nan, .end = 1.0}), {"y(0) = nan"});
  expect(stated({.start = 0.0, .end = nan}), {"y(1) = nan"});
  expect(stated({.start = 0.0, .end = 1.0}, {.guess = nan}), {"guess of y' = nan"});
  expect(stated({.start = 0.0, .end = 1.0}, {.scale = 0.0}), {"scale of y' = 0", "positive"});
  expect(oscillator(nan), {"k = nan"});
  expect(bare()
             .state("y", {.start = 0.0, .end = 0.0})
             .state("y'", {.start = 1.0})
             .unknown_parameter("k", {.guess = 5.0, .upper = 4.0}),
         {"guess of k = 5", "-inf and 4"});
  expect(bare().state("y", {.start = 0.0, .end = 1.0}).state("y").parameter("k", 1.0), {"'y' is used twice"});
  expect(bare().state("y", {.start = 0.0, .end = 1.0}).state("k").parameter("k", 1.0), {"'k' is used twice"});
  expect(bare().state("y", {.start = 0.0, .end = 1.0}).state("").parameter("k", 1.0), {"a name is ''"});
  expect(oscillator().row_at("inner", 1.0, [](const auto& at) { return at.state[0]; }),
         {"point 1 of row 'inner'", "0 and 1"});
  expect(stated({.start = 0.0}).row("far", [](const auto& at) { return at.start[2]; }),
         {"row 'far'", "value 2", "there are 2"});
  expect(stated({.start = 0.0}).row("far", [](const auto& at) { return at.parameter[1]; }),
         {"row 'far'", "value 1", "there are 1"});
  expect(stated({.start = 0.0}).row("flat", one, -1.0), {"scale of row 'flat' = -1"});
  expect(oscillator().guess([](double) { return std::vector{0.0}; }), {"the guess has 1 values", "2 states"});
  expect(oscillator().guess([](double) { return std::vector{0.0, nan}; }), {"guess of y'(0) = nan"});
  expect(oscillator().free_end("T", 0.0), {"scale of T = 0"});
  EXPECT_TRUE(contains(thrown<BadInput>([&] { oscillator().then(bvp::Problem33{}, 2.0); }),
                       "up to 2 has 6 states, the first one 2"));
}

}  // namespace
}  // namespace costate
