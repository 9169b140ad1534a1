/// Roots without a certificate: accuracy against closed forms, failures as values, memory that is kept, and roots along a parameter.
#include "small_problems.hpp"

#include <costate/error.hpp>
#include <costate/models/disk.hpp>
#include <costate/shooting/locate.hpp>
#include <costate/shooting/solve.hpp>

#include <atomic>
#include <cstdlib>
#include <gtest/gtest.h>
#include <new>

namespace {
std::atomic<long> allocations{0};
}

// Every allocation by new, and by the containers that stand on it, is counted. Not what goes to malloc: Eigen's vectors, and CVODES' own.
void* operator new(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size > 0 ? size : 1)) return memory;
  throw std::bad_alloc();
}
// GCC does not see that the operators belong together.
#pragma GCC diagnostic ignored "-Wmismatched-new-delete"
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace costate {
namespace {

using disk::ArcKind;

std::shared_ptr<const Problem> free_disk() { return disk::make_problem({}, {disk::ArcType{}}); }
std::shared_ptr<const Problem> limited_disk() {
  disk::Scene scene;
  scene.friction = 0.0525;
  return disk::make_problem(scene, {{ArcKind::saturated, 1.0}, {}, {ArcKind::saturated, -1.0}});
}
Eigen::VectorXd rough_start(bool limited) {
  Eigen::VectorXd y(limited ? 6 : 3);
  if (limited) {
    y << 0.76, std::acos(0.77), 0.0, 1.08, 0.04, 1.08;
  } else {
    y << std::acos(0.5), 0.5, 2.0;
  }
  return y;
}

class EveryEngine : public testing::TestWithParam<Method> {
 protected:
  [[nodiscard]] static LocateOptions options(double accuracy) { return {.accuracy = accuracy, .method = GetParam()}; }
};
INSTANTIATE_TEST_SUITE_P(Locate, EveryEngine, testing::Values(Method::adams, Method::runge_kutta));

// The root by the certified solve has bounds of its own.
TEST_P(EveryEngine, FindsRootsToTheAccuracy) {
  for (const bool limited : {false, true}) {
    Shooting shooting(limited ? limited_disk() : free_disk());
    const Solution reference = solve(shooting, rough_start(limited), {.accuracy = 1e-11});
    ASSERT_TRUE(reference.solved()) << reference.message;
    for (const double accuracy : {1e-4, 1e-6, 1e-9}) {
      const Located root = locate(shooting, rough_start(limited), options(accuracy));
      ASSERT_TRUE(root.converged()) << describe(root.termination);
      for (Eigen::Index i = 0; i < root.y.size(); ++i) {
        const double bound = accuracy * std::max(1.0, std::abs(reference.y[i])) +
                             reference.unknowns[static_cast<std::size_t>(i)].error_bound;
        EXPECT_NEAR(root.y[i], reference.y[i], bound) << accuracy << " unknown " << i;
      }
      EXPECT_LE(root.error, 1.3 * accuracy) << "a quarter may be Newton's, the rest is the integration's";
      EXPECT_GT(root.error, 0.0);
    }
  }
}

TEST_P(EveryEngine, AgreesWithClosedForms) {
  small::OscillatorTransfer oscillator(1.3, 2.0, 0.4);
  Shooting shooting(std::shared_ptr<const Problem>(&oscillator, [](const Problem*) {}));
  const Located root = locate(shooting, Eigen::VectorXd::Constant(1, 0.0), options(1e-9));
  ASSERT_TRUE(root.converged());
  EXPECT_NEAR(root.y[0], oscillator.v0(), 1e-9 * std::max(1.0, std::abs(oscillator.v0())));
}

// From the second root on: the first of a size may allocate.
TEST_P(EveryEngine, AllocatesNothingOnceWarm) {
  for (const bool limited : {false, true}) {
    Shooting shooting(limited ? limited_disk() : free_disk());
    Locator locator(shooting, options(1e-9));
    const Eigen::VectorXd start = rough_start(limited);
    ASSERT_TRUE(locator.find(start).converged());
    const long before = allocations;
    const bool converged = locator.find(start).converged();
    const long after = allocations;
    EXPECT_TRUE(converged);
    EXPECT_EQ(after, before);
  }
}

TEST_P(EveryEngine, FollowsAParameter) {
  Shooting shooting(free_disk());
  std::vector<double> headings;
  for (int i = 0; i < 30; ++i) headings.push_back(1.57 - 0.015 * i);
  const std::vector<Located> roots = locate_along(shooting, rough_start(false), "heading", headings, options(1e-8));
  ASSERT_EQ(roots.size(), headings.size());
  long integrations = 0;
  for (std::size_t i = 0; i < roots.size(); ++i) {
    ASSERT_TRUE(roots[i].converged()) << headings[i];
    integrations += roots[i].statistics.integrations;
    if (i % 7 != 0) continue;
    std::vector<double> parameters = shooting.parameters();
    parameters[2] = headings[i];
    shooting.set_parameters(parameters);
    const Located alone = locate(shooting, roots[i].y, options(1e-11));
    ASSERT_TRUE(alone.converged());
    EXPECT_LE((alone.y - roots[i].y).cwiseAbs().maxCoeff(), 1e-8 * std::max(1.0, alone.y.cwiseAbs().maxCoeff()));
  }
  // Two integrations a point would be one to correct a prediction and one to confirm it.
  EXPECT_LT(integrations, 2 * std::ssize(roots));
}

// Points so far apart that a Jacobian extrapolated from those before is of little use: each is held against Newton's correction by an integration
// of its own, which doubles the error at most where it is small. Adams' errors add up to some ten times the tolerance.
TEST_P(EveryEngine, LongStepsOfAParameterLeadToRootsToo) {
  constexpr double accuracy = 1e-9;
  Shooting shooting(free_disk()), judge(free_disk());
  judge.set_flow_options({.tolerance = {1e-14, 1e-14}, .method = Method::runge_kutta});
  std::vector<double> places;
  for (int i = 0; i <= 20; ++i) places.push_back(1.0 + 0.2 * i);
  const std::vector<Located> roots = locate_along(shooting, rough_start(false), "x", places, options(accuracy));
  ASSERT_EQ(roots.size(), places.size());
  for (std::size_t i = 0; i < roots.size(); ++i) {
    ASSERT_TRUE(roots[i].converged()) << places[i];
    std::vector<double> parameters = judge.parameters();
    parameters[0] = places[i];
    judge.set_parameters(parameters);
    EXPECT_LE(judge.correction(roots[i].y), 10.0 * accuracy * std::max(1.0, roots[i].y.cwiseAbs().maxCoeff())) << places[i];
  }
}

TEST(Shooting, ReportsAreMadeWithoutAnotherIntegration) {
  Shooting shooting(limited_disk()), other(limited_disk());
  const Eigen::VectorXd y = rough_start(true);
  EXPECT_TRUE(shooting.evaluate(y, {}, Extent::equations).reports().empty());
  const Eigen::VectorXd rows = shooting.residual(shooting.evaluate(y, {}, Extent::equations));
  const long integrations = shooting.statistics().integrations;
  const Shot& later = shooting.evaluate(y);
  const Shot& at_once = other.evaluate(y);
  EXPECT_EQ(shooting.statistics().integrations, integrations);
  EXPECT_EQ(shooting.residual(later), rows);
  ASSERT_EQ(later.reports().size(), at_once.reports().size());
  for (std::size_t i = 0; i < later.reports().size(); ++i) {
    EXPECT_EQ(later.reports()[i].name, at_once.reports()[i].name);
    EXPECT_EQ(later.reports()[i].value.value, at_once.reports()[i].value.value);
  }
  ASSERT_EQ(later.guards().size(), at_once.guards().size());
  ASSERT_EQ(later.arcs().size(), 3U);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(later.arcs()[i].quadrature, at_once.arcs()[i].quadrature);
}

small::Equations equations(std::vector<Unknown> unknowns, small::Equations::RowsOf rows,
                           std::vector<Parameter> parameters = {}) {
  std::vector<Row> names(unknowns.size(), Row{"row"});
  return {std::move(unknowns), std::move(names), std::move(rows), std::move(parameters)};
}
/// The same row for every unknown, of it and a parameter p.
template <class RowOf>
small::Equations same_rows(std::size_t count, const Unknown& unknown, RowOf row_of) {
  const auto rows = [count, row_of](Shot& shot) {
    std::vector<Jet> all;
    for (std::size_t i = 0; i < count; ++i) all.push_back(row_of(shot.unknown(i), shot.parameter(0)));
    return all;
  };
  return equations(std::vector<Unknown>(count, unknown), rows, {{"p", "", 1.0}});
}
std::vector<Located> roots_along(const small::Equations& problem, double start, const std::vector<double>& values,
                                 const LocateOptions& options = {}) {
  Shooting shooting(std::shared_ptr<const Problem>(&problem, [](const Problem*) {}));
  return locate_along(shooting, Eigen::VectorXd::Constant(shooting.size(), start), "p", values, options);
}
Located root_of(const small::Equations& problem, double start, const LocateOptions& options = {}) {
  Shooting shooting(std::shared_ptr<const Problem>(&problem, [](const Problem*) {}));
  return locate(shooting, Eigen::VectorXd::Constant(1, start), options);
}

// Full steps of Newton's method on arctan diverge from |y| > 1.3917.
TEST(Locate, IsDampedWhereFullStepsDiverge) {
  const auto problem = equations({{"y"}}, [](Shot& shot) {
    const Jet& y = shot.unknown(0);
    return std::vector<Jet>{Jet::chain(y, std::atan(y.value), 1.0 / (1.0 + y.value * y.value))};
  });
  const Located root = root_of(problem, 10.0);
  ASSERT_TRUE(root.converged()) << describe(root.termination);
  EXPECT_NEAR(root.y[0], 0.0, 1e-8);
}

TEST(Locate, StaysWithinLimits) {
  double least = 1.0;
  const auto problem = equations({{.name = "y", .lower = 0.0}}, [&least](Shot& shot) {
    least = std::min(least, shot.unknown(0).value);
    return std::vector<Jet>{log(shot.unknown(0)) + 4.0};
  });
  const Located root = root_of(problem, 1.0);
  ASSERT_TRUE(root.converged()) << describe(root.termination);
  EXPECT_NEAR(root.y[0], std::exp(-4.0), 1e-8);
  EXPECT_GT(least, 0.0);
}

/// y = `root` by one linear row, with the limit y > 0: every correction is exact, so that only the limit is in its way.
small::Equations root_at(double root) {
  return equations({{.name = "y", .lower = 0.0}}, [root](Shot& shot) { return std::vector<Jet>{shot.unknown(0) - root}; });
}

// However near: a correction that is cut leaves a tenth of the way to the limit and more.
TEST(Locate, ARootAtOrBeyondALimitIsNone) {
  for (const double root : {-1.0, -1e-2, -1e-5, -5e-9, 0.0}) {
    for (const double accuracy : {1e-3, 1e-8}) {
      const auto problem = root_at(root);
      const Located found = root_of(problem, 1.0, {.accuracy = accuracy});
      EXPECT_EQ(found.termination, Termination::stalled) << root << " " << describe(found.termination);
      EXPECT_GT(found.y[0], 0.0);
      EXPECT_GE(found.error, found.y[0] - root) << "all that the linear row says is left";
      Shooting shooting(std::shared_ptr<const Problem>(&problem, [](const Problem*) {}));
      const Located corrected = Locator(shooting, {.accuracy = accuracy}).correct(Eigen::VectorXd::Constant(1, 1e-5));
      EXPECT_EQ(corrected.termination, Termination::stalled) << root;
    }
  }
  EXPECT_EQ(root_of(root_at(-0.5), -1.0).termination, Termination::stalled) << "the start is beyond the limit as well";
}

TEST(Locate, ARootNearALimitIsFound) {
  for (const double root : {1e-5, 1e-8}) {
    const Located found = root_of(root_at(root), 1.0, {.accuracy = 1e-8});
    ASSERT_TRUE(found.converged()) << root;
    EXPECT_NEAR(found.y[0], root, 1e-8);
    EXPECT_GT(found.y[0], 0.0);
  }
}

// Newton's method on 1/y = 1/r jumps beyond the limit from y > 2r, and must come back from there.
TEST(Locate, ALimitOnTheWayIsNoObstacle) {
  const auto problem = equations({{.name = "y", .lower = 0.0}},
                                 [](Shot& shot) { return std::vector<Jet>{1.0 / shot.unknown(0) - 100.0}; });
  const Located found = root_of(problem, 1.0);
  ASSERT_TRUE(found.converged()) << describe(found.termination);
  EXPECT_NEAR(found.y[0], 0.01, 1e-8);
}

TEST(Locate, FailuresAreValues) {
  const auto none = equations({{"y"}}, [](Shot& shot) { return std::vector<Jet>{shot.unknown(0) * shot.unknown(0) + 1.0}; });
  const Located nowhere = root_of(none, 0.7);
  EXPECT_FALSE(nowhere.converged());
  const auto border = equations({{"y"}}, [](Shot& shot) { return std::vector<Jet>{sqrt(shot.unknown(0), "y") + 1.0}; });
  const Located outside = root_of(border, -1.0);
  EXPECT_EQ(outside.termination, Termination::left_domain);
  EXPECT_TRUE(small::contains(outside.message, "y is -1")) << outside.message;
  const auto flat = equations({{"y"}}, [](Shot& shot) { return std::vector<Jet>{shot.unknown(0) * shot.unknown(0) + 1.0}; });
  EXPECT_EQ(root_of(flat, 0.0).termination, Termination::singular_jacobian);
  EXPECT_EQ(root_of(none, 0.7, {.max_iterations = 1}).termination, Termination::iteration_limit);
}

// √y has an infinite derivative at 0, where its correction would be −R/∞ = 0, a step that looks like that to a root.
TEST(Locate, AnInfiniteDerivativeIsNoRoot) {
  for (const std::size_t count : {1U, 2U, 9U}) {
    const auto problem = equations(std::vector<Unknown>(count, Unknown{"y"}), [count](Shot& shot) {
      std::vector<Jet> rows;
      for (std::size_t i = 0; i < count; ++i) {
        const Jet& y = shot.unknown(i);
        rows.push_back((i == 0 ? sqrt(y) : y) - 1.0);
      }
      return rows;
    });
    Shooting shooting(std::shared_ptr<const Problem>(&problem, [](const Problem*) {}));
    const auto size = static_cast<Eigen::Index>(count);
    const Located root = locate(shooting, Eigen::VectorXd::Zero(size));
    EXPECT_EQ(root.termination, Termination::singular_jacobian) << count;
    EXPECT_FALSE(std::isfinite(root.correction)) << count;
    EXPECT_FALSE(Locator(shooting).correct(Eigen::VectorXd::Zero(size)).converged()) << count;
    const Located beside = locate(shooting, Eigen::VectorXd::Constant(size, 0.5));
    ASSERT_TRUE(beside.converged()) << count;
    EXPECT_NEAR(beside.y[0], 1.0, 1e-8);
  }
}

// y = p down to the limit y > 0: by a few unknowns and by many, which have a Newton's method of their own.
TEST(Locate, APathEndsAtALimit) {
  std::vector<double> values;
  for (int i = 0; i <= 20; ++i) values.push_back(0.525 - 0.05 * i);
  const auto positive = std::count_if(values.begin(), values.end(), [](double value) { return value > 0.0; });
  for (const std::size_t count : {1U, 9U}) {
    const auto problem = same_rows(count, {.name = "y", .lower = 0.0}, [](const Jet& y, const Jet& p) { return y - p; });
    const std::vector<Located> roots = roots_along(problem, 0.5, values);
    ASSERT_EQ(std::ssize(roots), positive + 1) << count;
    for (std::size_t i = 0; i + 1 < roots.size(); ++i) EXPECT_TRUE(roots[i].converged()) << values[i];
    EXPECT_EQ(roots.back().termination, Termination::stalled) << count;
    EXPECT_GT(roots.back().y.minCoeff(), 0.0);
  }
}

// y = √p bends more and more towards the fold at 0, and nothing is integrated: whatever a root is off by is Newton's method's. Here an
// extrapolated Jacobian is a good deal worse a few points after it was last compared with the true one.
TEST(Locate, EveryRootAlongABendIsAccurate) {
  const auto problem = same_rows(1, {"y"}, [](const Jet& y, const Jet& p) { return y * y - p; });
  for (const double accuracy : {1e-3, 1e-6, 1e-8, 1e-10}) {
    for (const int count : {10, 20, 40, 80}) {
      std::vector<double> values;
      for (int i = 0; 10 * i <= 9 * count; ++i) values.push_back(1.0 - static_cast<double>(i) / count);
      const std::vector<Located> roots = roots_along(problem, 1.0, values, {.accuracy = accuracy});
      ASSERT_EQ(roots.size(), values.size());
      for (std::size_t i = 0; i < roots.size(); ++i) {
        ASSERT_TRUE(roots[i].converged());
        EXPECT_NEAR(roots[i].y[0], std::sqrt(values[i]), accuracy) << count << " points, p = " << values[i];
      }
    }
  }
}

// A polynomial has no two values at one place. A value given again is met by its root: one evaluation confirms it.
TEST(Locate, ValuesMayBeGivenAgain) {
  const std::vector<double> values{1.0, 1.1, 1.1, 1.2, 1.2, 1.2, 1.2 + 1e-15, 1.3, 1.2, 1.1};
  for (const std::size_t count : {1U, 9U}) {
    const auto problem = same_rows(count, {"y"}, [](const Jet& y, const Jet& p) { return y * y - p; });
    const std::vector<Located> roots = roots_along(problem, 1.0, values);
    ASSERT_EQ(roots.size(), values.size());
    for (std::size_t i = 0; i < roots.size(); ++i) {
      ASSERT_TRUE(roots[i].converged()) << i;
      EXPECT_NEAR(roots[i].y[0], std::sqrt(values[i]), 1e-8 * 1.2);
      if (i > 0 && values[i] == values[i - 1]) {
        EXPECT_EQ(roots[i].iterations, 1) << count << " " << i;
      }
    }
  }
}

TEST(Locate, BadOptionsAreRefused) {
  Shooting shooting(free_disk());
  const Eigen::VectorXd start = rough_start(false);
  EXPECT_THROW((void)locate(shooting, start, {.accuracy = 0.0}), BadInput);
  EXPECT_THROW((void)locate(shooting, start, {.max_iterations = 0}), BadInput);
  EXPECT_THROW((void)locate(shooting, start.head(2)), BadInput);
  const std::vector<double> values{1.5};
  EXPECT_THROW((void)locate_along(shooting, start, "colour", values), BadInput);
}

// Nine unknowns and more are solved for as multiple shooting's are.
TEST(Locate, ManyUnknowns) {
  constexpr std::size_t count = 12;
  std::vector<Unknown> unknowns(count, Unknown{"y"});
  const auto problem = equations(unknowns, [](Shot& shot) {
    std::vector<Jet> rows;
    for (std::size_t i = 0; i < count; ++i) {
      const Jet& y = shot.unknown(i);
      rows.push_back(y * y - static_cast<double>(i + 1) + 0.01 * (shot.unknown((i + 1) % count) - y));
    }
    return rows;
  });
  Shooting shooting(std::shared_ptr<const Problem>(&problem, [](const Problem*) {}));
  const Located root = locate(shooting, Eigen::VectorXd::Constant(count, 2.0), {.accuracy = 1e-10});
  ASSERT_TRUE(root.converged()) << describe(root.termination);
  Eigen::VectorXd residual(count);
  shooting.residual(root.y, residual);
  EXPECT_LE(residual.cwiseAbs().maxCoeff(), 1e-10 * 2.0 * 4.0) << "rows have slopes up to 2 √12";
}

}  // namespace
}  // namespace costate
