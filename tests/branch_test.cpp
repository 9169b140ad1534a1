/// Branches: through folds, on values asked for, through changes of structure, and how they end.
#include "small_problems.hpp"

#include <costate/error.hpp>
#include <costate/shooting/branch.hpp>

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <numbers>

namespace costate {
namespace {

using closed::vector;
using small::contains;
using small::thrown;

std::shared_ptr<const Problem> equation(small::Equations::RowsOf rows_of, double p,
                                        std::vector<Unknown> unknowns = {{"y"}}) {
  std::vector<Row> rows;
  for (const Unknown& unknown : unknowns) rows.push_back({"row of " + unknown.name});
  return std::make_shared<small::Equations>(std::move(unknowns), std::move(rows), std::move(rows_of),
                                            std::vector<Parameter>{{"p", "1", p}});
}

/// y² + p² = 1: folds at p = ±1.
std::shared_ptr<const Problem> circle(double p) {
  return equation(
      [](Shot& shot) {
        const Jet &y = shot.unknown(0), &q = shot.parameter(0);
        return std::vector{y * y + q * q - 1.0};
      },
      p);
}

/// Bratu's problem y'' = −L e^y, y(0) = y(1) = 0, as a plain two-point problem. With y = 2 ln(cosh θ / cosh(θ (1 − 2t))):
/// L = 8 θ²/cosh²θ and y'(0) = 4 θ tanh θ; the fold is where θ tanh θ = 1.
struct BratuField {
  static constexpr int states = 2, parameters = 1, quadratures = 0;
  template <class S>
  Rates<S, 2, 0> rates(const S&, const Vec<S, 2>& z, const Vec<S, 1>& p) const {
    return {{z[1], -p[0] * exp(z[0])}, {}};
  }
};
class Bratu final : public Problem {
 public:
  explicit Bratu(double L) {
    unknowns_ = {{"slope"}};
    rows_ = {{"y(1) = 0"}};
    parameters_ = {{"L", "1", L}};
    structure_ = {"whole"};
  }
  void shoot(Shot& shot) const override {
    const ArcEnd end = shot.arc(
        {.field = &field_, .t0 = 0.0, .t1 = 1.0, .state = {0.0, shot.unknown(0)}, .parameter = {shot.parameter(0)}});
    shot.row(0, end.state[0]);
    shot.report("end_slope", "1", end.state[1]);
  }
  [[nodiscard]] std::vector<Column> columns() const override { return {}; }
  [[nodiscard]] std::vector<double> observe(const ArcPoint&, const std::vector<double>&) const override { return {}; }
  [[nodiscard]] std::vector<PathCheck> check(const ArcPoint&, const std::vector<double>&) const override { return {}; }

 private:
  FieldOf<BratuField> field_;
};

TEST(Branch, PassesTheFoldOfBratusProblemAndTracesBothSides) {
  const auto problem = std::make_shared<Bratu>(0.5);
  const Branch branch = trace(problem, {0.5}, vector({0.26}), "L", 4.0, {.landings = {1.0}});
  EXPECT_FALSE(branch.reached);
  EXPECT_TRUE(contains(branch.message, "comes back")) << branch.message;
  ASSERT_EQ(branch.events.size(), 1u);
  EXPECT_EQ(branch.events[0].kind, EventKind::fold);
  EXPECT_NEAR(branch.events[0].point.parameter, 3.51383071912516, 1e-10);
  EXPECT_LE(std::abs(branch.events[0].point.parameter - 3.51383071912516), branch.events[0].error_bound + 4e-15 * 3.6);
  std::vector<double> slopes;
  for (const BranchPoint& point : branch.points) {
    // θ from y'(0) = 4 θ tanh θ; then L = 8 θ²/cosh²θ.
    double theta = std::sqrt(0.25 * point.y[0]);
    for (int i = 0; i < 50; ++i) {
      const double f = 4.0 * theta * std::tanh(theta) - point.y[0];
      theta -= f / (4.0 * std::tanh(theta) + 4.0 * theta / std::pow(std::cosh(theta), 2));
    }
    const double L = 8.0 * std::pow(theta / std::cosh(theta), 2);
    // Corrections end at 1e-9 and converge quadratically; the integration's error, 1e-11 a step, grows by less than 10².
    EXPECT_NEAR(point.parameter, L, 2e-9);
    if (point.requested) slopes.push_back(point.y[0]);
  }
  ASSERT_EQ(slopes.size(), 2u) << "L = 1 is passed twice";
  EXPECT_NEAR(slopes[0], 0.5493527287752708, 1e-9);
  EXPECT_NEAR(slopes[1], 10.84689901938945, 1e-8);
  EXPECT_EQ(branch.points.back().parameter, 0.5);
  EXPECT_LE(static_cast<double>(branch.cost.newton_iterations), 6.0 * static_cast<double>(branch.points.size()));
}

TEST(Branch, GoesAroundACircle) {
  const Branch branch = trace(circle(0.0), {0.0}, vector({1.0}), "p", 2.0, {.landings = {0.6}});
  ASSERT_EQ(branch.events.size(), 1u);
  EXPECT_NEAR(branch.events[0].point.parameter, 1.0, 1e-15);
  for (const BranchPoint& point : branch.points) {
    EXPECT_NEAR(point.y[0] * point.y[0] + point.parameter * point.parameter, 1.0, 1e-14);
    // dy/dp = −p/y
    // The tangent is that of a point within the last correction, 1e-9; y moves by y″ = −1/y³ times that.
    EXPECT_NEAR(point.unknowns[0].derivative * point.y[0], -point.parameter, 2e-9 / std::pow(point.y[0], 2));
  }
  std::vector<double> landed;
  for (const BranchPoint& point : branch.points) {
    if (point.requested) landed.push_back(point.y[0]);
  }
  ASSERT_EQ(landed.size(), 2u);
  EXPECT_NEAR(landed[0], 0.8, 1e-15);
  EXPECT_NEAR(landed[1], -0.8, 1e-15);
  EXPECT_EQ(branch.points.back().parameter, 0.0);
}

TEST(Branch, MayEndAtTheFirstFold) {
  const Branch branch = trace(circle(0.0), {0.0}, vector({1.0}), "p", 2.0, {.through_folds = false});
  EXPECT_FALSE(branch.reached);
  EXPECT_TRUE(contains(branch.message, "fold")) << branch.message;
  for (const BranchPoint& point : branch.points) EXPECT_GT(point.y[0], 0.0);
  EXPECT_EQ(branch.events.size(), 1u);
}

TEST(Branch, RestartsFromAnyPointInBothDirections) {
  const Branch branch = trace(circle(0.0), {0.0}, vector({1.0}), "p", 2.0);
  const std::size_t beyond = branch.points.size() - 3;
  ASSERT_LT(branch.points[beyond].y[0], 0.0);
  const Branch on = restart(branch, beyond, -0.5);
  EXPECT_TRUE(on.reached) << on.message;
  EXPECT_NEAR(on.points.back().y[0], -std::sqrt(0.75), 1e-15);
  EXPECT_TRUE(on.events.empty());
  const Branch back = restart(branch, beyond, 0.0, {}, {}, true);
  EXPECT_TRUE(contains(back.message, "comes back") || back.reached) << back.message;
  ASSERT_EQ(back.events.size(), 1u) << "the fold again, from the other side";
  EXPECT_NEAR(back.events[0].point.parameter, 1.0, 1e-15);
}

TEST(Branch, DerivativesOfReportsFollowTheBranch) {
  const auto problem = equation(
      [](Shot& shot) {
        const Jet &y = shot.unknown(0), &p = shot.parameter(0);
        shot.report("product", "1", y * p * p);
        return std::vector{y * y * y - p};
      },
      1.0);
  const Branch branch = trace(problem, {1.0}, vector({1.0}), "p", 8.0, {.landings = {3.0}});
  ASSERT_TRUE(branch.reached) << branch.message;
  EXPECT_EQ(branch.points.back().parameter, 8.0);
  for (const BranchPoint& point : branch.points) {
    // y = p^{1/3}, y p² = p^{7/3}
    EXPECT_NEAR(point.unknowns[0].derivative, std::pow(point.parameter, -2.0 / 3.0) / 3.0, 1e-8);
    EXPECT_NEAR(point.reports[0].value, std::pow(point.parameter, 7.0 / 3.0), 1e-12 * 128.0);
    EXPECT_NEAR(point.reports[0].derivative, 7.0 / 3.0 * std::pow(point.parameter, 4.0 / 3.0), 1e-8 * 40.0);
  }
}

/// min y² over y ≥ p − 1 as a problem of two structures: free (y = 0) for p < 1, bound (y = p − 1, multiplier m = 2y) beyond.
std::shared_ptr<const Problem> free_structure(double p) {
  return equation(
      [](Shot& shot) {
        const Jet& y = shot.unknown(0);
        shot.guard(EventKind::arc_birth, "room above the bound", y - shot.parameter(0) + 1.0);
        return std::vector{y + y * y * y};
      },
      p);
}
std::shared_ptr<const Problem> bound_structure(double p) {
  return equation(
      [](Shot& shot) {
        const Jet &y = shot.unknown(0), &m = shot.unknown(1);
        shot.guard(EventKind::arc_death, "multiplier", m);
        return std::vector{y - shot.parameter(0) + 1.0, m - 2.0 * y};
      },
      p, {{"y"}, {"m"}});
}
std::vector<Successor> switch_structure(const Junction& at) {
  if (at.y.size() == 1) return {{bound_structure(0.0), vector({at.y[0], 0.1}), "multiplier", 0.01}};
  return {{free_structure(0.0), vector({0.0}), "room above the bound", 0.01}};
}

TEST(Branch, ChangesTheStructureWhereAGuardVanishes) {
  // 1.002 lies between the event and the first point of the new structure.
  const Branch branch = trace(free_structure(0.0), {0.0}, vector({0.0}), "p", 3.0, {.landings = {1.002, 2.0}},
                              switch_structure);
  ASSERT_TRUE(branch.reached) << branch.message;
  ASSERT_EQ(branch.events.size(), 1u);
  EXPECT_EQ(branch.events[0].kind, EventKind::arc_birth);
  EXPECT_EQ(branch.events[0].name, "room above the bound");
  EXPECT_NEAR(branch.events[0].point.parameter, 1.0, 1e-14);
  ASSERT_EQ(branch.stretches.size(), 2u);
  int landings = 0;
  double last = -1.0;
  for (std::size_t i = 0; i < branch.points.size(); ++i) {
    const BranchPoint& point = branch.points[i];
    EXPECT_GT(point.parameter, last);
    last = point.parameter;
    EXPECT_EQ(point.stretch, point.parameter < 1.0 ? 0u : 1u);
    EXPECT_EQ(i < branch.events[0].position, point.parameter < 1.0);
    EXPECT_NEAR(point.y[0], std::max(0.0, point.parameter - 1.0), 1e-14);
    landings += point.requested ? 1 : 0;
  }
  EXPECT_EQ(landings, 3) << "1.002, 2 and 3";
}

TEST(Branch, ChangesTheStructureOnTheWayBackToo) {
  const Branch branch = trace(bound_structure(3.0), {3.0}, vector({2.0, 4.0}), "p", 0.0, {}, switch_structure);
  ASSERT_TRUE(branch.reached) << branch.message;
  ASSERT_EQ(branch.events.size(), 1u);
  EXPECT_EQ(branch.events[0].kind, EventKind::arc_death);
  EXPECT_NEAR(branch.events[0].point.parameter, 1.0, 1e-14);
  EXPECT_NEAR(branch.points.back().y[0], 0.0, 1e-14);
}

TEST(Branch, EndsWhereNoStructureIsKnown) {
  for (const Restructure& none : {Restructure{}, Restructure{[](const Junction&) { return std::vector<Successor>{}; }}}) {
    const Branch branch = trace(free_structure(0.0), {0.0}, vector({0.0}), "p", 3.0, {}, none);
    EXPECT_FALSE(branch.reached);
    ASSERT_EQ(branch.events.size(), 1u);
    EXPECT_NEAR(branch.events[0].point.parameter, 1.0, 1e-14);
    EXPECT_TRUE(branch.events[0].after.empty());
    EXPECT_TRUE(contains(branch.message, "room above the bound vanishes")) << branch.message;
    EXPECT_FALSE(branch.points.empty()) << "what was found is kept";
    EXPECT_EQ(branch.events[0].kind, EventKind::limit);
    EXPECT_LE(branch.points.back().parameter, 1.0);
    EXPECT_NEAR(branch.points.back().parameter, 1.0, 1e-6) << "the limit is approached";
  }
}

TEST(Branch, WrongSuccessorsAreRefused) {
  const auto wrong = [](const Junction&) {
    return std::vector<Successor>{{bound_structure(0.0), vector({0.0, 0.1}), "no such guard", 0.01},
                                  {bound_structure(0.0), vector({0.0, 0.1}), "multiplier", -0.01}};
  };
  const Branch branch = trace(free_structure(0.0), {0.0}, vector({0.0}), "p", 3.0, {}, wrong);
  EXPECT_FALSE(branch.reached);
  ASSERT_EQ(branch.events.size(), 1u);
  EXPECT_EQ(branch.events[0].kind, EventKind::limit);
  EXPECT_EQ(branch.stretches.size(), 1u);
}

TEST(Branch, WrongStartsAreSaid) {
  const Branch nothing = trace(circle(2.0), {2.0}, vector({0.5}), "p", 3.0);
  EXPECT_TRUE(nothing.points.empty());
  EXPECT_TRUE(contains(nothing.message, "no solution at the start")) << nothing.message;
  const Branch outside = trace(free_structure(2.0), {2.0}, vector({0.0}), "p", 3.0);
  EXPECT_TRUE(outside.points.empty());
  EXPECT_TRUE(contains(outside.message, "room above the bound is -1")) << outside.message;
}

TEST(Branch, TheBorderOfTheDomainEndsIt) {
  const auto problem =
      equation([](Shot& shot) { return std::vector{shot.unknown(0) - sqrt(3.0 - shot.parameter(0), "room left")}; }, 1.0);
  const Branch branch = trace(problem, {1.0}, vector({1.4}), "p", 4.0);
  EXPECT_FALSE(branch.reached);
  EXPECT_NEAR(branch.points.back().parameter, 3.0, 1e-6);
  EXPECT_TRUE(contains(branch.message, "room left")) << branch.message;
}

TEST(Branch, BudgetsEndIt) {
  const Branch branch = trace(circle(0.0), {0.0}, vector({1.0}), "p", 2.0, {.max_points = 4});
  EXPECT_EQ(branch.points.size(), 4u);
  EXPECT_TRUE(contains(branch.message, "given up after 4 points")) << branch.message;
}

TEST(Branch, BadInputIsNamed) {
  const auto refused = [](const std::string& name, double to, const TraceOptions& options = {}) {
    return thrown<BadInput>([&] { (void)trace(circle(0.0), {0.0}, vector({1.0}), name, to, options); });
  };
  EXPECT_TRUE(contains(refused("q", 1.0), "no parameter q; it has p"));
  EXPECT_TRUE(contains(refused("p", 0.0), "nothing to follow"));
  EXPECT_TRUE(contains(refused("p", std::nan("")), "finite"));
  EXPECT_TRUE(contains(refused("p", 1.0, {.landings = {1.5}}), "1.5"));
  EXPECT_FALSE(thrown<BadInput>([] { (void)trace(circle(0.0), {0.0}, vector({1.0, 2.0}), "p", 1.0); }).empty());
  EXPECT_FALSE(thrown<BadInput>([] { (void)trace(circle(0.0), {0.0, 1.0}, vector({1.0}), "p", 1.0); }).empty());
  EXPECT_FALSE(thrown<BadInput>([] { (void)restart(Branch{}, 0, 1.0); }).empty());
}

/// Bratu's problem with a guard on what is integrated: y'(1) > −2.
class GuardedBratu final : public Problem {
 public:
  GuardedBratu() {
    unknowns_ = {{"slope"}};
    rows_ = {{"y(1) = 0"}};
    parameters_ = {{"L", "1", 0.5}};
    structure_ = {"whole"};
  }
  void shoot(Shot& shot) const override {
    const ArcEnd end = shot.arc(
        {.field = &field_, .t0 = 0.0, .t1 = 1.0, .state = {0.0, shot.unknown(0)}, .parameter = {shot.parameter(0)}});
    shot.row(0, end.state[0]);
    shot.guard(EventKind::arc_birth, "slope left", end.state[1] + 2.0);
  }
  [[nodiscard]] std::vector<Column> columns() const override { return {}; }
  [[nodiscard]] std::vector<double> observe(const ArcPoint&, const std::vector<double>&) const override { return {}; }
  [[nodiscard]] std::vector<PathCheck> check(const ArcPoint&, const std::vector<double>&) const override { return {}; }

 private:
  FieldOf<BratuField> field_;
};

// A value to land on that lies within what the integration knows of an event's place must neither be lost nor met for ever.
TEST(Branch, LandsOnValuesAsCloseToAnEventAsItIsKnown) {
  const auto problem = std::make_shared<GuardedBratu>();
  // By symmetry y'(1) = −y'(0) = −4 θ tanh θ = −2.
  double theta = 0.8;
  for (int i = 0; i < 50; ++i) {
    theta -= (2.0 * theta * std::tanh(theta) - 1.0) / (2.0 * std::tanh(theta) + 2.0 * theta / std::pow(std::cosh(theta), 2));
  }
  const double place = 8.0 * std::pow(theta / std::cosh(theta), 2);
  for (const double tolerance : {1e-8, 1e-11}) {
    for (const double offset : {-10.0, -1.0, -0.3, -0.03, 0.0, 0.03, 0.3, 1.0}) {
      const double landing = place + offset * tolerance;
      const Branch branch = trace(problem, {0.5}, vector({0.26}), "L", 3.0, {.tolerance = tolerance, .landings = {landing}});
      ASSERT_EQ(branch.events.size(), 1u) << branch.message;
      EXPECT_NEAR(branch.events[0].point.parameter, place, branch.events[0].error_bound + 4e-15) << tolerance;
      const auto landed = std::count_if(branch.points.begin(), branch.points.end(),
                                        [&](const BranchPoint& p) { return p.parameter == landing; });
      // Beyond the event there is nothing.
      EXPECT_LE(landed, 1);
      if (landing >= place - branch.events[0].error_bound) continue;
      EXPECT_EQ(landed, 1) << tolerance << ' ' << offset;
    }
  }
}

// Solutions side by side, y = f(p) + k·gap: a step that is too long would end on another one.
TEST(Branch, StaysOnItsOwnOfManyParallelBranches) {
  for (const double gap : {0.3, 0.1}) {
    const double k = 5.0;
    const auto problem = equation(
        [=](Shot& shot) {
          const Jet y = shot.unknown(0) - 0.3 * sin(k * shot.parameter(0));
          return std::vector{sin(std::numbers::pi / gap * y)};
        },
        0.0);
    const Branch branch = trace(problem, {0.0}, vector({0.0}), "p", 3.0);
    ASSERT_TRUE(branch.reached) << branch.message;
    EXPECT_TRUE(branch.events.empty());
    for (const BranchPoint& point : branch.points) EXPECT_NEAR(point.y[0], 0.3 * std::sin(k * point.parameter), 1e-8) << gap;
  }
}

}  // namespace
}  // namespace costate
