#include "basin_problems.hpp"
#include "small_problems.hpp"

#include <costate/error.hpp>
#include <costate/shooting/search.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace costate {
namespace {

using small::contains;
using small::Equations;
using small::thrown;

/// y'' = −g(y) as a first-order system, y(0) = y(T) = 0; the unknown is the slope y'(0).
template <class Force>
class DirichletProblem final : public Problem {
 public:
  DirichletProblem(double length, double guess, double scale) : length_(length) {
    unknowns_ = {{.name = "slope", .scale = scale, .guess = guess}};
    rows_ = {{"end value"}};
    structure_ = {"arc"};
  }
  void shoot(Shot& shot) const override {
    const ArcEnd end = shot.arc({.field = &field_, .t0 = 0.0, .t1 = length_, .state = {0.0, shot.unknown(0)}});
    shot.row(0, end.state[0]);
    shot.report("cost", "", shot.unknown(0) * shot.unknown(0));
  }
  [[nodiscard]] std::vector<Column> columns() const override { return {{"y", ""}}; }
  [[nodiscard]] std::vector<double> observe(const ArcPoint& point, const std::vector<double>&) const override {
    return {point.state[0]};
  }
  [[nodiscard]] std::vector<PathCheck> check(const ArcPoint&, const std::vector<double>&) const override { return {}; }

 private:
  double length_;
  FieldOf<Force> field_;
};

/// Bratu's equation with L = 1.
struct Bratu {
  static constexpr int states = 2, parameters = 0, quadratures = 0;
  template <class S>
  Rates<S, 2, 0> rates(const S&, const Vec<S, 2>& z, const Vec<S, 0>&) const {
    return {{z[1], -exp(z[0])}, {}};
  }
};

struct Pendulum {
  static constexpr int states = 2, parameters = 0, quadratures = 0;
  template <class S>
  Rates<S, 2, 0> rates(const S&, const Vec<S, 2>& z, const Vec<S, 0>&) const {
    return {{z[1], -sin(z[0])}, {}};
  }
};

/// The zero of a function that changes its sign between a and b.
template <class F>
double bisect(F f, double a, double b) {
  for (int i = 0; i < 200; ++i) {
    const double middle = 0.5 * (a + b);
    ((f(a) > 0.0) == (f(middle) > 0.0) ? a : b) = middle;
  }
  return 0.5 * (a + b);
}

TEST(Search, FindsBothSolutionsOfBratusEquation) {
  // y = −2 ln(cosh((x − ½)θ/2)/cosh(θ/4)) with θ = √2 cosh(θ/4), which has two solutions; y'(0) = θ tanh(θ/4).
  const auto defect = [](double theta) { return theta - std::numbers::sqrt2 * std::cosh(0.25 * theta); };
  const Search search = find_extremals(std::make_shared<DirichletProblem<Bratu>>(1.0, 5.0, 5.0), {.starts = 40});
  ASSERT_EQ(search.extremals.size(), 2U) << search.summary();
  double low = 1.0;
  for (const Extremal& extremal : search.extremals) {
    const double theta = bisect(defect, low, 3.0 * low + 10.0);
    low = 4.0;  // between the two: the defect has its maximum at 4 asinh(2√2) = 7.05 and is positive from the first on
    EXPECT_NEAR(extremal.solution.y[0], theta * std::tanh(0.25 * theta), 1e-8 * std::max(1.0, theta));
  }
  EXPECT_EQ(search.starts, 40);
  EXPECT_EQ(search.converged + search.rejected + search.failed, 40);
  EXPECT_GT(search.success_rate(), 0.5);
  EXPECT_EQ(search.unseen(), 0.0) << search.summary();
}

TEST(Search, FindsAllSwingsOfThePendulum) {
  // From 0 to 0 in the time T in n half swings of modulus k, T = 2n K(k), y'(0) = ±2k: for T = 10 there are n = 1, 2, 3 and
  // rest.
  constexpr double T = 10.0;
  std::vector<double> slopes{0.0};
  for (int n = 1; 2.0 * n * std::comp_ellint_1(0.0) < T; ++n) {
    const double k = bisect([&](double m) { return std::comp_ellint_1(m) - T / (2.0 * n); }, 0.0, 1.0 - 1e-12);
    slopes.insert(slopes.end(), {2.0 * k, -2.0 * k});
  }
  ASSERT_EQ(slopes.size(), 7U);
  std::sort(slopes.begin(), slopes.end());
  const Search search = find_extremals(std::make_shared<DirichletProblem<Pendulum>>(T, 0.0, 1.0),
                                       {.starts = 200, .box = {{-2.0, 2.0}}});
  std::vector<double> found;
  for (const Extremal& extremal : search.extremals) found.push_back(extremal.solution.y[0]);
  std::sort(found.begin(), found.end());
  ASSERT_EQ(found.size(), slopes.size()) << search.summary();
  for (std::size_t i = 0; i < found.size(); ++i) EXPECT_NEAR(found[i], slopes[i], 2e-8);
  EXPECT_TRUE(std::is_sorted(search.extremals.begin(), search.extremals.end(),
                             [](const Extremal& a, const Extremal& b) { return a.cost < b.cost; }));
}

std::shared_ptr<const Problem> equations(std::vector<Unknown> unknowns, std::vector<Row> rows, Equations::RowsOf rows_of) {
  return std::make_shared<Equations>(std::move(unknowns), std::move(rows), std::move(rows_of));
}

TEST(Search, TellsRootsApartThatAreCloserThanTheirLooseErrors) {
  // (y − 1)(y − 1 − 10⁻⁶) = 0, a pair that is about to merge in a fold: known to 10⁻⁹ the roots are two.
  const auto problem = equations({{.name = "y", .guess = 1.0}}, {{"product", 1e-6}}, [](Shot& shot) {
    return std::vector<Jet>{(shot.unknown(0) - 1.0) * (shot.unknown(0) - 1.000001)};
  });
  const Search search = find_extremals(problem, {.starts = 30, .accuracy = 1e-9});
  ASSERT_EQ(search.extremals.size(), 2U) << search.summary();
}

/// x² + y = 11, x + y² = 7 has four real roots; the rows are mixed by a matrix ((1, mixing), (0, 1)).
std::shared_ptr<const Problem> crossing_parabolas(double mixing) {
  return equations({{"x"}, {"y"}}, {{"first"}, {"second"}}, [mixing](Shot& shot) {
    const Jet& x = shot.unknown(0);
    const Jet& y = shot.unknown(1);
    const Jet first = x * x + y - 11.0, second = x + y * y - 7.0;
    return std::vector<Jet>{first + mixing * second, second};
  });
}

TEST(Search, DoesNotDependOnHowRowsAreMixed) {
  const SearchOptions options{.starts = 60, .box = {{-5.0, 5.0}, {-5.0, 5.0}}};
  const Search plain = find_extremals(crossing_parabolas(0.0), options),
               mixed = find_extremals(crossing_parabolas(1e3), options);
  ASSERT_EQ(plain.extremals.size(), 4U) << plain.summary();
  ASSERT_EQ(mixed.extremals.size(), 4U) << mixed.summary();
  for (const Extremal& one : plain.extremals) {
    const Eigen::VectorXd& z = one.solution.y;
    EXPECT_NEAR(z[0] * z[0] + z[1], 11.0, 1e-7);
    EXPECT_NEAR(z[0] + z[1] * z[1], 7.0, 1e-7);
    const auto same = [&](const Extremal& other) { return other.hits == one.hits && (other.solution.y - z).norm() < 4e-8; };
    EXPECT_EQ(std::count_if(mixed.extremals.begin(), mixed.extremals.end(), same), 1) << plain.summary() << mixed.summary();
  }
}

TEST(Search, ListsRefusedRootsApart) {
  // The fastest of the transfers meets 1.5 m/s, more than is allowed.
  const Search search = find_extremals(std::make_shared<small::LeastEffortTransfer>(1.0, 1.4), {.starts = 10});
  EXPECT_TRUE(search.extremals.empty());
  ASSERT_EQ(search.refused.size(), 1U) << search.summary();
  EXPECT_EQ(search.refused[0].hits, 10);
  EXPECT_EQ(search.rejected, 10);
  EXPECT_EQ(search.success_rate(), 0.0);
  EXPECT_TRUE(contains(search.refused[0].verdict, "speed below its limit is -0.1")) << search.refused[0].verdict;
  EXPECT_TRUE(contains(search.summary(), "refused, cost 1, hits 10")) << search.summary();
}

TEST(Search, SaysWhyThereIsNone) {
  const auto problem = equations({{.name = "y"}}, {{"sum of squares"}},
                                 [](Shot& shot) { return std::vector<Jet>{shot.unknown(0) * shot.unknown(0) + 1.0}; });
  const Search search = find_extremals(problem, {.starts = 25});
  EXPECT_TRUE(search.extremals.empty());
  EXPECT_TRUE(search.refused.empty());
  EXPECT_EQ(search.failed, 25);
  EXPECT_EQ(search.unseen(), 1.0);
  int counted = 0;
  for (const Search::Failure& failure : search.failures) counted += failure.count;
  EXPECT_EQ(counted, 25);
  ASSERT_FALSE(search.failures.empty());
  EXPECT_TRUE(contains(search.summary(), search.failures[0].reason)) << search.summary();
}

TEST(Search, KeepsToDomainsAndBox) {
  // y² = 4 has the roots ±2; one is outside the domain, and no start gets there.
  const auto square = [](Shot& shot) { return std::vector<Jet>{shot.unknown(0) * shot.unknown(0) - 4.0}; };
  const Search positive = find_extremals(equations({{.name = "y", .scale = 2.0, .lower = 0.0}}, {{"square"}}, square),
                                         {.starts = 20});
  ASSERT_EQ(positive.extremals.size(), 1U) << positive.summary();
  EXPECT_NEAR(positive.extremals[0].solution.y[0], 2.0, 1e-8);
  EXPECT_TRUE(positive.refused.empty()) << positive.summary();
  // From starts below −1 the nearer root.
  const Search negative = find_extremals(equations({{.name = "y"}}, {{"square"}}, square),
                                         {.starts = 20, .box = {{-9.0, -1.0}}});
  ASSERT_EQ(negative.extremals.size(), 1U) << negative.summary();
  EXPECT_NEAR(negative.extremals[0].solution.y[0], -2.0, 1e-8);
}

TEST(Search, StopsWhenItHasEnough) {
  const auto problem = std::make_shared<DirichletProblem<Pendulum>>(10.0, 0.0, 1.0);
  const Search two = find_extremals(problem, {.starts = 200, .enough = 2});
  EXPECT_EQ(two.extremals.size(), 2U);
  EXPECT_LT(two.starts, 200);
  const Search no_time = find_extremals(problem, {.starts = 200, .max_seconds = 1e-9});
  EXPECT_LT(no_time.starts, 2);
}

TEST(Search, IsTheSameForTheSameSeed) {
  const auto problem = std::make_shared<DirichletProblem<Pendulum>>(10.0, 0.0, 1.0);
  const auto hits = [&](unsigned seed) {
    std::vector<int> list;
    for (const Extremal& extremal : find_extremals(problem, {.seed = seed, .starts = 30}).extremals)
      list.push_back(extremal.hits);
    return list;
  };
  EXPECT_EQ(hits(1), hits(1));
  EXPECT_NE(hits(1), hits(2));
}

TEST(Search, FindsBothExtremalsOfTheDragProblem) {
  const Search search = find_extremals(std::make_shared<basin::DragTransfer>(),
                                       {.starts = 80, .box = {{0.5, 6.0}, {-1.0, 1.0}, {-1.0, 1.0}, {-1.0, 1.0}}});
  ASSERT_EQ(search.extremals.size(), 2U) << search.summary();
  EXPECT_NEAR(search.extremals[0].cost, basin::DragTransfer::final_time, 2e-8);
  EXPECT_NEAR(search.extremals[1].cost, basin::DragTransfer::dive_time, 2e-8);
  ASSERT_FALSE(search.refused.empty());
  for (const Extremal& root : search.refused) EXPECT_TRUE(contains(root.verdict, "speed is -")) << root.verdict;
}

TEST(Search, RefusesOptionsOutOfRange) {
  const auto problem = std::make_shared<DirichletProblem<Pendulum>>(10.0, 0.0, 1.0);
  const auto said = [&](const SearchOptions& options) {
    return thrown<BadInput>([&] { (void)find_extremals(problem, options); });
  };
  EXPECT_TRUE(contains(said({.starts = 0}), "starts = 0"));
  EXPECT_TRUE(contains(said({.enough = 0}), "enough = 0"));
  EXPECT_TRUE(contains(said({.accuracy = 1.0}), "accuracy = 1"));
  EXPECT_TRUE(contains(said({.max_seconds = 0.0}), "max_seconds = 0"));
  EXPECT_TRUE(contains(said({.max_steps = 0}), "max_steps = 0"));
  EXPECT_TRUE(contains(said({.box = {{0.0, 1.0}, {0.0, 1.0}}}), "box has 2 intervals"));
  EXPECT_TRUE(contains(said({.box = {{1.0, 0.0}}}), "slope = 1 … 0"));
  EXPECT_TRUE(contains(said({.starts = 3, .cost = "price"}), "price"));
}

/// y'' = 900 y, growth e³⁰ over a unit of time.
struct Growth {
  static constexpr int states = 2, parameters = 0, quadratures = 0;
  template <class S>
  Rates<S, 2, 0> rates(const S&, const Vec<S, 2>& z, const Vec<S, 0>&) const {
    return {{z[1], 900.0 * z[0]}, {}};
  }
};

/// From y = 1 to y = 1 in the time 1. The accuracy is out of reach as long as the arc is whole.
class GrowingProblem final : public Problem {
 public:
  GrowingProblem() {
    unknowns_ = {{.name = "slope", .scale = 30.0}};
    rows_ = {{"end value"}};
    structure_ = {"arc"};
  }
  void shoot(Shot& shot) const override {
    const ArcEnd end = shot.arc({.field = &field_, .t0 = 0.0, .t1 = 1.0, .state = {1.0, shot.unknown(0)}});
    shot.row(0, end.state[0] - 1.0);
    shot.report("end_slope", "", end.state[1]);
  }
  [[nodiscard]] std::vector<Column> columns() const override { return {{"y", ""}}; }
  [[nodiscard]] std::vector<double> observe(const ArcPoint& point, const std::vector<double>&) const override {
    return {point.state[0]};
  }
  [[nodiscard]] std::vector<PathCheck> check(const ArcPoint&, const std::vector<double>&) const override { return {}; }

 private:
  FieldOf<Growth> field_;
};

TEST(Search, FollowsStartsOnWholeArcsWhateverWasSolvedBefore) {
  const auto problem = std::make_shared<GrowingProblem>();
  const Search search = find_extremals(problem, {.starts = 6, .box = {{-31.0, -29.0}}});
  ASSERT_EQ(search.extremals.size(), 1U) << search.summary();
  const Solution& found = search.extremals[0].solution;
  ASSERT_GT(found.nodes, 0) << "the solve was to cut the arc";
  EXPECT_EQ(search.converged, 6) << search.summary();
  EXPECT_NEAR(found.y[0], 30.0 * (1.0 - std::cosh(30.0)) / std::sinh(30.0), 30.0 * 1e-8);
}

TEST(RandomStarts, FindsWhatOneStartDoesNot) {
  // y³ − 2y + 2 has a minimum of 0.91 at √(2/3), from whose neighbourhood no descent leads out. The one root by Cardano's
  // formula.
  const auto problem = equations({{.name = "y", .guess = 1.0}}, {{"cubic"}}, [](Shot& shot) {
    const Jet& y = shot.unknown(0);
    return std::vector<Jet>{y * y * y - 2.0 * y + 2.0};
  });
  const double root = std::cbrt(-1.0 + std::sqrt(19.0 / 27.0)) + std::cbrt(-1.0 - std::sqrt(19.0 / 27.0));
  const Solution result = solve(problem);
  ASSERT_TRUE(result.solved()) << result.message;
  EXPECT_GT(result.starts, 1);
  EXPECT_EQ(result.arrived, 1);
  EXPECT_NEAR(result.y[0], root, 2e-8);
  EXPECT_EQ(solve(problem).starts, result.starts) << "the same seed makes the same starts";
  EXPECT_FALSE(solve(problem, problem->start()).solved())
      << "a start that is given is the only one unless others are asked for";
}

TEST(RandomStarts, TakesTheStartThatIsGiven) {
  const auto problem = std::make_shared<DirichletProblem<Bratu>>(1.0, 5.0, 5.0);
  for (const double slope : {0.5, 10.8}) {
    const Solution result = solve(problem, Eigen::VectorXd::Constant(1, slope), {.random = RandomStarts{}});
    ASSERT_TRUE(result.solved());
    EXPECT_EQ(result.starts, 1);
    EXPECT_NEAR(result.y[0], slope, 0.06);
  }
}

TEST(RandomStarts, SaysSoWhereThereIsNoSolution) {
  const auto problem = equations({{.name = "y"}}, {{"sum of squares"}},
                                 [](Shot& shot) { return std::vector<Jet>{shot.unknown(0) * shot.unknown(0) + 1.0}; });
  const Solution none = solve(problem, Eigen::VectorXd::Constant(1, 3.0), {.random = RandomStarts{.count = 20}});
  EXPECT_EQ(none.status, Solution::Status::failed);
  EXPECT_EQ(none.starts, 21);
  EXPECT_EQ(none.arrived, 0);
  EXPECT_TRUE(contains(none.message, "of 21 starts 0 led to a root")) << none.message;

  const auto limited = std::make_shared<small::LeastEffortTransfer>(1.0, 1.4);
  const Solution refused = solve(limited, {.random = RandomStarts{.count = 5}});
  EXPECT_EQ(refused.status, Solution::Status::refused);
  EXPECT_EQ(refused.arrived, 6);
  EXPECT_TRUE(contains(refused.message, "speed below its limit")) << refused.message;
}

TEST(RandomStarts, RefusesOptionsOutOfRange) {
  const auto problem = equations({{.name = "y", .guess = 3.0}}, {{"sum of squares"}},
                                 [](Shot& shot) { return std::vector<Jet>{shot.unknown(0) * shot.unknown(0) + 1.0}; });
  const auto said = [&](const RandomStarts& random) {
    return thrown<BadInput>([&] { (void)solve(problem, {.random = random}); });
  };
  EXPECT_TRUE(contains(said({.count = -1}), "count = -1"));
  EXPECT_TRUE(contains(said({.radius = 0.0}), "radius = 0"));
  EXPECT_TRUE(contains(said({.max_steps = 0}), "max_steps = 0"));
  EXPECT_TRUE(contains(said({.max_total_steps = 0}), "max_total_steps = 0"));
}

}  // namespace
}  // namespace costate
