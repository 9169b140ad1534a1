/// The test set of Cash and Mazzia: statements against closed forms, solutions against closed forms, first integrals, symmetries and an
/// independent collocation. What a solve claims of its error must be true.
#include "bvp_reference.hpp"

#include <costate/shooting/solve.hpp>

#include <cmath>
#include <gtest/gtest.h>

namespace costate {
namespace {

using namespace bvp;

template <class... P>
struct List {};

/// y'' of the closed form against the right-hand side, at points in and outside of layers. Both are sums of terms that cancel; rounding
/// of each is some units of the largest term, which the value of y'' at any point of the interval, and its factors 1/ε, bound.
template <class P>
void expect_statement(double epsilon) {
  using D = Dual<double, 1>;
  using DD = Dual<D, 1>;
  double largest = 1.0 / epsilon;
  std::vector<std::array<double, 3>> both;
  for (int i = 0; i <= 40; ++i) {
    const double x = P::a + (P::b - P::a) * i / 40.0;
    const DD y = P::exact(DD::variable(D::variable(x, 0), 0), DD(epsilon));
    const double second = P::second(x, y.value.value, y.value.gradient[0], epsilon);
    largest = std::max({largest, std::abs(second), std::abs(y.value.gradient[0]) / epsilon});
    both.push_back({x, y.gradient[0].gradient[0], second});
  }
  // Arguments of exponentials reach 2/ε, and an exponential magnifies the rounding of its argument by the argument.
  const double tolerance = 8.0 * std::numeric_limits<double>::epsilon() * largest * std::max(4.0, 2.0 / epsilon);
  for (const auto& [x, known, stated] : both) EXPECT_NEAR(known, stated, tolerance) << P::number << " at x = " << x;
}

template <class... P>
void expect_statements(List<P...>) {
  for (const double epsilon : {0.5, 0.1, 0.02}) (expect_statement<P>(epsilon), ...);
}

TEST(TestSet, ClosedFormsSolveTheEquations) {
  expect_statements(
      List<Problem1, Problem2, Problem3, Problem4, Problem5, Problem6, Problem7, Problem8, Problem9, Problem10, Problem11,
           Problem12, Problem13, Problem14, Problem16, Problem17, Problem18, Problem20, Problem21>{});
  for (const double theta : {1.0, 3.0, 4.5, 6.0}) expect_statement<Problem34>(theta);
}

/// Halving uniform cells of problem 1, whose layer they resolve, leaves 2⁻⁶ of the error of y'(0). The ratio is 64 up to the next order,
/// (h/√ε)² = 1/16 of it.
TEST(Collocation, HasOrderSix) {
  using F = System<Problem1>;
  const double epsilon = 0.01;
  const auto error = [&](int cells) {
    collocation::Grid grid{{}, collocation::Matrix::Zero(2, cells + 1)};
    for (int i = 0; i <= cells; ++i) grid.x.push_back(static_cast<long double>(i) / cells);
    collocation::Collocation<F>({epsilon}, F::ends(epsilon)).solve(grid);
    const long double r = std::sqrt(static_cast<long double>(epsilon)), e = std::exp(-2.0L / r);
    return static_cast<double>(std::abs(grid.y(1, 0) + (1.0L + e) / (1.0L - e) / r));
  };
  const double ratio = error(40) / error(80);
  EXPECT_NEAR(ratio, 64.0, 64.0 / 16.0);
}

/// The path of parameters to the one that is solved for: as long as the collocation needs it.
using Path = std::vector<double>;

/// A solve from nothing but the statement reaches the accuracy, and what it claims is true.
template <class P>
void expect_solved(const Path& whole_path, const SolveOptions& options) {
  const Path path = COSTATE_FEWER ? Path{whole_path.front()} : whole_path;
  const Solution s = solve(statement<P>(path.back()).shared(), options);
  const std::string name = fmt::format("problem {} at {}, accuracy {}", P::number, path.back(), options.accuracy);
  ASSERT_TRUE(s.solved()) << name << ": " << s.message;
  const Known reference = known<P>(path);
  // A reference is of use if it is known as well as what it judges.
  ASSERT_LE(reference.error, 0.1 * options.accuracy) << name;
  const Comparison c = compare<P>(s, reference);
  EXPECT_LE(c.excess, 1.0) << name << ": error " << c.error << ", bound " << c.bound;
  EXPECT_LE(c.bound, options.accuracy) << name;
}

template <class... P>
void expect_all_solved(List<P...>, const Path& path, const SolveOptions& options) {
  (expect_solved<P>(path, options), ...);
}

using Linear = List<Problem1, Problem2, Problem3, Problem4, Problem5, Problem6, Problem7, Problem8, Problem9, Problem10,
                    Problem11, Problem12, Problem13, Problem14, Problem15, Problem18>;

class Accuracy : public testing::TestWithParam<double> {};

TEST_P(Accuracy, IsKeptByLinearProblemsWithWideLayers) { expect_all_solved(Linear{}, {0.1}, {.accuracy = GetParam()}); }
TEST_P(Accuracy, IsKeptByLinearProblemsWithThinLayers) { expect_all_solved(Linear{}, {0.01}, {.accuracy = GetParam()}); }
TEST_P(Accuracy, IsKeptByOscillations) {
  for (const double waves : {3.0, 11.0, 101.0}) expect_solved<Problem16>({1.0 / waves}, {.accuracy = GetParam()});
}
TEST_P(Accuracy, IsKeptByACornerInTheMiddle) {
  for (const double epsilon : {0.1, 1e-3, 1e-4}) expect_solved<Problem17>({epsilon}, {.accuracy = GetParam()});
}
TEST_P(Accuracy, IsKeptByNonlinearProblems) {
  expect_all_solved(List<Problem19, Problem20, Problem21, Problem22, Problem24, Problem25, Problem26, Problem27, Problem28,
                         Problem29, Problem30>{},
                    {0.1}, {.accuracy = GetParam()});
}
TEST_P(Accuracy, IsKeptByBratu) {
  for (const double theta : {1.0, 3.0, 4.5}) expect_solved<Problem34>({theta}, {.accuracy = GetParam()});
}
TEST_P(Accuracy, IsKeptByTheElasticBeam) { expect_solved<Problem31>({0.1, 0.05}, {.accuracy = GetParam()}); }
TEST_P(Accuracy, IsKeptByTheChannel) {
  expect_solved<Problem32>({1.0}, {.accuracy = GetParam()});
  expect_solved<Problem32>({1.0, 10.0}, {.accuracy = GetParam()});
}
TEST_P(Accuracy, IsKeptByRotatingDiscs) { expect_solved<Problem33>({0.1}, {.accuracy = GetParam()}); }

INSTANTIATE_TEST_SUITE_P(TestSet, Accuracy, testing::Values(1e-6, 1e-8));

/// Layers so thin that shooting over the whole interval magnifies errors beyond all doubles: e^(1/ε), e^(2/√ε), e^(1/2ε).
TEST(TestSet, GrowthBeyondDoublesIsSolvedInSegments) {
  const SolveOptions options{.accuracy = 1e-8};
  expect_all_solved(List<Problem2, Problem6, Problem7, Problem10>{}, {1e-3}, options);
  expect_all_solved(List<Problem1, Problem11, Problem12, Problem13, Problem14>{}, {1e-4}, options);
  expect_all_solved(List<Problem25, Problem30>{}, {0.1, 0.03, 0.01, 3e-3}, options);
  expect_all_solved(List<Problem19, Problem21, Problem22>{}, {0.1, 0.03, 0.01, 3e-3}, options);
  expect_solved<Problem31>({0.1, 0.05, 0.02, 0.01}, options);
  expect_solved<Problem33>({0.1, 0.03, 0.01, 3e-3, 1e-3}, options);
}

/// Layers that decay forward at the rate 1/ε are stiff.
TEST(TestSet, StiffLayersAreSolvedByBackwardDifferences) {
  const SolveOptions options{.accuracy = 1e-8, .method = Method::bdf};
  for (const double epsilon : {1e-3, 1e-4}) {
    expect_all_solved(List<Problem3, Problem4, Problem8, Problem18>{}, {epsilon}, options);
  }
}

/// The same where another method is asked for: neither could take the steps that stability asks for, and both end in time to say so.
TEST(TestSet, StiffLayersLeadToBackwardDifferencesFromEitherEngine) {
  for (const Method method : {Method::adams, Method::runge_kutta}) {
    expect_all_solved(List<Problem8>{}, {1e-6}, SolveOptions{.accuracy = 1e-6, .method = method});
  }
}

/// Where the statement alone leads nowhere, a homotopy from a mild parameter does.
TEST(TestSet, HardNonlinearProblemsAreSolvedByHomotopy) {
  const auto from = [](double value) { return SolveOptions{.accuracy = 1e-7, .homotopy = Homotopy{"epsilon", value}}; };
  expect_solved<Problem20>({0.01}, from(0.1));
  expect_solved<Problem26>({0.1, 0.03, 0.01, 3e-3}, from(0.1));
  expect_solved<Problem32>({1.0, 10.0, 100.0}, from(1.0));
  expect_solved<Problem32>({1.0, 10.0, 100.0, 1000.0}, from(1.0));
}

/// Bratu's problem has two solutions for one λ. From 0 the lower is found, from a guess of the user's own the upper.
TEST(TestSet, AGuessChoosesBetweenTheSolutionsOfBratu) {
  const double theta = 6.0, accuracy = 1e-8;
  TwoPoint problem = statement<Problem34>(theta);
  const Solution lower = solve(problem.shared(), {.accuracy = accuracy});
  problem.guess([](double t) { return std::vector{8.0 * t * (1.0 - t), 8.0 - 16.0 * t}; });
  const Solution upper = solve(problem.shared(), {.accuracy = accuracy});
  ASSERT_TRUE(lower.solved() && upper.solved()) << lower.message << upper.message;
  const double slope = exact<Problem34>(0.0, theta)[1];
  EXPECT_LE(std::abs(upper["y'(0)"].value - slope), upper["y'(0)"].error_bound);
  // The lower one is that of the smaller θ with the same λ; λ rises with θ up to its greatest value.
  const auto lambda = [](double t) { return 0.5 * t * t / (std::cosh(0.25 * t) * std::cosh(0.25 * t)); };
  double low = 0.0, high = 4.7;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (lambda(middle) < lambda(theta) ? low : high) = middle;
  }
  EXPECT_LE(std::abs(lower["y'(0)"].value - exact<Problem34>(0.0, low)[1]), lower["y'(0)"].error_bound);
}

/// The solution between discs that rotate against each other is odd about the middle.
TEST(TestSet, RotatingDiscsKeepTheirSymmetry) {
  const Solution s = solve(statement<Problem33>(0.1).shared(), {.accuracy = 1e-9});
  ASSERT_TRUE(s.solved()) << s.message;
  for (const auto& [name, sign] : {std::pair{"g'", 1.0}, {"f''", -1.0}, {"f'''", 1.0}}) {
    const Quantity start = s[fmt::format("{}(0)", name)], end = s[fmt::format("{}(1)", name)];
    EXPECT_LE(std::abs(start.value - sign * end.value), start.error_bound + end.error_bound) << name;
    EXPECT_GT(std::abs(start.value), 1e-3) << name;
  }
}

/// y'' + 3ε y/(ε + x²)² = 0 has the even solution (ε − x²)/√(ε + x²), which vanishes at both ends of problem 17 if ε = b². There the
/// solution is not unique.
TEST(TestSet, AConjugatePointIsNotSolved) {
  const double epsilon = Problem17::b * Problem17::b;
  using D = Dual<Dual<double, 1>, 1>;
  for (const double x : {-0.08, 0.0, 0.03}) {
    const D at = D::variable(Dual<double, 1>::variable(x, 0), 0);
    const D even = (epsilon - at * at) / sqrt(epsilon + at * at);
    EXPECT_NEAR(even.gradient[0].gradient[0], Problem17::second(x, even.value.value, 0.0, epsilon), 1e-12);
  }
  EXPECT_FALSE(solve(statement<Problem17>(epsilon).shared()).solved());
}

/// Troesch: y'² − 2 cosh μy is constant, so that 1 = ∫ dy/√(s² + 4 sinh²(μy/2)) with s = y'(0). With 2 sinh(μy/2) = s sinh w this is
/// μ = ∫ dw/√(1 + s² sinh² w/4) from 0 to arsinh(2 sinh(μ/2)/s), a smooth function of s that falls.
long double troesch_slope(long double mu) {
  const auto length = [&](long double s) {
    const long double end = std::asinh(2.0L * std::sinh(0.5L * mu) / s);
    constexpr int cells = 4000;
    const long double h = end / cells, offset = std::sqrt(0.15L);
    long double sum = 0.0L;
    for (int i = 0; i < cells; ++i) {
      for (const auto& [at, weight] : {std::pair{-offset, 5.0L / 18}, {0.0L, 4.0L / 9}, {offset, 5.0L / 18}}) {
        const long double sh = 0.5L * s * std::sinh(h * (static_cast<long double>(i) + 0.5L + at));
        sum += weight * h / std::sqrt(1.0L + sh * sh);
      }
    }
    return sum;
  };
  long double low = std::log(1e-6L), high = std::log(2.0L);  // of s
  for (int i = 0; i < 70; ++i) {
    const long double middle = 0.5L * (low + high);
    (length(std::exp(middle)) > mu ? low : high) = middle;
  }
  return std::exp(low);
}

TEST_P(Accuracy, IsKeptByTroesch) {
  // Given in the literature to these digits.
  EXPECT_NEAR(static_cast<double>(troesch_slope(5.0L)), 0.0457504614063187, 1e-16);
  for (const double mu : {1.0, 3.0, 5.0, 7.0, 9.0}) {
    const Solution s = solve(statement<Problem23>(mu).shared(), {.accuracy = GetParam()});
    ASSERT_TRUE(s.solved()) << mu << ": " << s.message;
    const auto slope = static_cast<double>(troesch_slope(mu));
    const double end = std::hypot(slope, 2.0 * std::sinh(0.5 * mu));
    EXPECT_LE(std::abs(s["y'(0)"].value - slope), s["y'(0)"].error_bound) << mu;
    EXPECT_LE(std::abs(s["y'(1)"].value - end), s["y'(1)"].error_bound) << mu;
    EXPECT_LE(s["y'(0)"].error_bound, GetParam()) << mu;
    EXPECT_LE(s["y'(1)"].error_bound, GetParam() * end) << mu;
  }
}

}  // namespace
}  // namespace costate
