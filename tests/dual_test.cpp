/// Dual numbers against three independent ways to differentiate: Eigen's AutoDiffScalar, complex steps, and differences.
#include <costate/dual.hpp>

#include <Eigen/Core>
#include <algorithm>
#include <complex>
#include <functional>
#include <gtest/gtest.h>
#include <limits>
#include <ostream>
#include <string>
#include <unsupported/Eigen/AutoDiff>
#include <vector>

namespace costate {
namespace {

constexpr double eps = std::numeric_limits<double>::epsilon();
constexpr double infinity = std::numeric_limits<double>::infinity();

using D2 = Dual<double, 2>;
using Nested = Dual<D2, 2>;
using AutoDiff = Eigen::AutoDiffScalar<Eigen::Vector2d>;
using Complex = std::complex<double>;

template <class S>
using Function = std::function<S(const S&, const S&)>;

/// One function of two variables on every scalar it exists on, and the point it is differentiated at.
struct Case {
  std::string name;
  double x, y;
  Function<double> plain;
  Function<D2> dual;
  Function<Nested> nested;
  Function<AutoDiff> autodiff;  ///< empty where Eigen lacks the function
  Function<Complex> complex;    ///< empty where the function is not analytic
  friend std::ostream& operator<<(std::ostream& out, const Case& c) { return out << c.name << " at " << c.x << ", " << c.y; }
};

enum class Reference { both, autodiff, complex };

template <Reference reference = Reference::both, class F>
Case make(std::string name, double x, double y, F f) {
  Case c{std::move(name), x, y, f, f, f, nullptr, nullptr};
  if constexpr (reference != Reference::complex) c.autodiff = f;
  if constexpr (reference != Reference::autodiff) c.complex = f;
  return c;
}

/// The points keep sixth derivatives below this bound, which the comparison with differences relies on.
constexpr double sixth_derivative_bound = 2000.0;

// hypot has neither reference: it is checked against √(x² + y²) below.
std::vector<Case> cases() {
  using enum Reference;
  return {
      make("plus", 0.7, -1.3, []<class S>(const S& x, const S& y) -> S { return x + y; }),
      make("minus", 0.7, -1.3, []<class S>(const S& x, const S& y) -> S { return x - y; }),
      make("times", 0.7, -1.3, []<class S>(const S& x, const S& y) -> S { return x * y; }),
      make("divided", 0.7, -1.3, []<class S>(const S& x, const S& y) -> S { return x / y; }),
      make("negated", 0.7, -1.3, []<class S>(const S& x, const S& y) -> S { return -x * y; }),
      make("constants_right", 0.7, -1.3,
           []<class S>(const S& x, const S& y) -> S { return (x + 2.0) * (y - 3.0) * (x * 4.0) * (y / 5.0); }),
      make("constants_left", 0.7, 1.3,
           []<class S>(const S& x, const S& y) -> S { return (2.0 + x) * (3.0 - y) * (4.0 * x) * (5.0 / (3.0 + y)); }),
      make("sin", 0.7, -1.3, []<class S>(const S& x, const S& y) -> S { return sin(x * y); }),
      make("cos", 0.7, -1.3, []<class S>(const S& x, const S& y) -> S { return cos(x * y); }),
      make("tan", 0.4, -0.5, []<class S>(const S& x, const S& y) -> S { return tan(x * y); }),
      make("asin", 0.4, -0.5, []<class S>(const S& x, const S& y) -> S { return asin(x * y); }),
      make("acos", 0.4, -0.5, []<class S>(const S& x, const S& y) -> S { return acos(x * y); }),
      make<complex>("atan", 0.7, -1.3, []<class S>(const S& x, const S& y) -> S { return atan(x * y); }),
      make("exp", 0.7, -1.3, []<class S>(const S& x, const S& y) -> S { return exp(x * y); }),
      make("log", 1.2, 1.1, []<class S>(const S& x, const S& y) -> S { return log(x * y); }),
      make("sqrt", 1.2, 1.1, []<class S>(const S& x, const S& y) -> S { return sqrt(x * y); }),
      make("sinh", 0.7, -1.3, []<class S>(const S& x, const S& y) -> S { return sinh(x * y); }),
      make("cosh", 0.7, -1.3, []<class S>(const S& x, const S& y) -> S { return cosh(x * y); }),
      make("tanh", 0.7, -0.5, []<class S>(const S& x, const S& y) -> S { return tanh(x * y); }),
      make<autodiff>("abs_negative", 0.7, -1.3, []<class S>(const S& x, const S& y) -> S { return abs(S(x * y)); }),
      make<autodiff>("abs_positive", 0.7, 1.3, []<class S>(const S& x, const S& y) -> S { return abs(S(x * y)); }),
      make<autodiff>("atan2_second_quadrant", -0.9, 1.3, []<class S>(const S& x, const S& y) -> S { return atan2(y, x); }),
      make<autodiff>("atan2_fourth_quadrant", 0.9, -1.3, []<class S>(const S& x, const S& y) -> S { return atan2(y, x); }),
      make("pow_third", 1.2, 1.1, []<class S>(const S& x, const S& y) -> S { return pow(S(x * y), 3.0); }),
      make("pow_broken", 1.2, 1.1, []<class S>(const S& x, const S& y) -> S { return pow(S(x * y), -1.5); }),
      make<autodiff>("pow_negative_base", -1.2, 1.1, []<class S>(const S& x, const S& y) -> S { return pow(x, 3.0) * y; }),
      make<complex>("pow_both", 1.2, 1.1, []<class S>(const S& x, const S& y) -> S { return pow(x, y); }),
      make<complex>("pow_of_constant", 1.2, 1.1, []<class S>(const S& x, const S& y) -> S { return pow(1.7, S(x * y)); }),
      make("composed", 0.7, 0.4,
           []<class S>(const S& x, const S& y) -> S { return exp(-x * y) * sin(x + y) / sqrt(1.0 + x * x); }),
  };
}

std::vector<Case> cases_where(bool (*keep)(const Case&)) {
  std::vector<Case> kept = cases();
  std::erase_if(kept, [keep](const Case& c) { return !keep(c); });
  return kept;
}

class EveryFunction : public testing::TestWithParam<Case> {
 protected:
  static D2 gradient_at(const Case& c, double x, double y) { return c.dual(D2::variable(x, 0), D2::variable(y, 1)); }
  static Nested nested(const Case& c) {
    return c.nested(Nested::variable(D2::variable(c.x, 0), 0), Nested::variable(D2::variable(c.y, 1), 1));
  }
};

// A handful of correctly rounded operations on each side; their results differ by rounding alone.
constexpr double rounding(double size) { return 32 * eps * std::max(1.0, size); }

TEST_P(EveryFunction, ValueIsThatOfThePlainFunction) {
  const Case& c = GetParam();
  const double plain = c.plain(c.x, c.y);
  EXPECT_NEAR(gradient_at(c, c.x, c.y).value, plain, rounding(std::abs(plain)));
  EXPECT_EQ(primal(nested(c)), gradient_at(c, c.x, c.y).value);
}

class FunctionOfEigen : public EveryFunction {};
TEST_P(FunctionOfEigen, GradientIsThatOfAutoDiffScalar) {
  const Case& c = GetParam();
  const D2 ours = gradient_at(c, c.x, c.y);
  const AutoDiff theirs = c.autodiff(AutoDiff(c.x, 2, 0), AutoDiff(c.y, 2, 1));
  for (int i = 0; i < 2; ++i) {
    EXPECT_NEAR(ours.gradient[static_cast<std::size_t>(i)], theirs.derivatives()[i],
                rounding(std::abs(theirs.derivatives()[i])));
  }
}

class AnalyticFunction : public EveryFunction {};
TEST_P(AnalyticFunction, GradientIsThatOfComplexSteps) {
  const Case& c = GetParam();
  constexpr double h = 1e-100;  // nothing is subtracted, so the step may be as small as we like
  const D2 ours = gradient_at(c, c.x, c.y);
  const double by_x = c.complex({c.x, h}, {c.y, 0.0}).imag() / h;
  const double by_y = c.complex({c.x, 0.0}, {c.y, h}).imag() / h;
  EXPECT_NEAR(ours.gradient[0], by_x, rounding(std::abs(by_x)));
  EXPECT_NEAR(ours.gradient[1], by_y, rounding(std::abs(by_y)));
}

TEST_P(EveryFunction, NestedDualCarriesTheSameGradientTwice) {
  const Case& c = GetParam();
  const D2 first = gradient_at(c, c.x, c.y);
  const Nested second = nested(c);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_NEAR(second.value.gradient[i], first.gradient[i], rounding(std::abs(first.gradient[i])));
    EXPECT_NEAR(second.gradient[i].value, first.gradient[i], rounding(std::abs(first.gradient[i])));
  }
}

TEST_P(EveryFunction, HessianIsSymmetric) {
  const Nested f = nested(GetParam());
  EXPECT_NEAR(f.gradient[0].gradient[1], f.gradient[1].gradient[0], rounding(std::abs(f.gradient[0].gradient[1])));
}

// Extrapolated central differences (4 D_h − D_2h)/3 of a gradient g have the truncation error h⁴/30 |g⁽⁵⁾|; each of the
// values of g is rounded by a few ε|g|, of which division by h makes ε|g|/h.
TEST_P(EveryFunction, HessianIsThatOfCentralDifferences) {
  const Case& c = GetParam();
  constexpr double h = 5e-4;
  const Nested f = nested(c);
  for (std::size_t i = 0; i < 2; ++i) {
    for (std::size_t j = 0; j < 2; ++j) {
      const auto difference = [&](double step) {
        const double dx = j == 0 ? step : 0.0;
        const double dy = j == 1 ? step : 0.0;
        return (gradient_at(c, c.x + dx, c.y + dy).gradient[i] - gradient_at(c, c.x - dx, c.y - dy).gradient[i]) /
               (2.0 * step);
      };
      const double extrapolated = (4.0 * difference(h) - difference(2.0 * h)) / 3.0;
      const double size = std::max(1.0, std::abs(f.gradient[i].value));
      EXPECT_NEAR(f.gradient[i].gradient[j], extrapolated, 8 * eps * size / h + h * h * h * h / 30 * sixth_derivative_bound)
          << i << j;
    }
  }
}

constexpr auto name = [](const testing::TestParamInfo<Case>& test) { return test.param.name; };
INSTANTIATE_TEST_SUITE_P(Dual, EveryFunction, testing::ValuesIn(cases()), name);
INSTANTIATE_TEST_SUITE_P(Dual, FunctionOfEigen,
                         testing::ValuesIn(cases_where([](const Case& c) { return c.autodiff != nullptr; })), name);
INSTANTIATE_TEST_SUITE_P(Dual, AnalyticFunction,
                         testing::ValuesIn(cases_where([](const Case& c) { return c.complex != nullptr; })), name);

/// The variable x with first and second derivative carried along.
using Twice = Dual<Dual<double, 1>, 1>;
Twice twice(double x) { return Twice::variable(Dual<double, 1>::variable(x, 0), 0); }
double first(const Twice& f) { return f.gradient[0].value; }
double second(const Twice& f) { return f.gradient[0].gradient[0]; }

TEST(Dual, PythagorasHasNoDerivatives) {
  for (double x = -4.0; x <= 4.0; x += 0.37) {
    const Twice one = sin(twice(x)) * sin(twice(x)) + cos(twice(x)) * cos(twice(x));
    EXPECT_NEAR(primal(one), 1.0, 4 * eps);
    EXPECT_NEAR(first(one), 0.0, 4 * eps);
    EXPECT_NEAR(second(one), 0.0, 8 * eps);
  }
}

TEST(Dual, InverseFunctionsUndoEachOther) {
  for (double x = 0.1; x < 1.0; x += 0.13) {
    const std::vector<Twice> identities{log(exp(twice(x))),
                                        exp(log(twice(x))),
                                        asin(sin(twice(x))),
                                        acos(cos(twice(x))),
                                        tan(atan(twice(x))),
                                        pow(sqrt(twice(x)), 2.0),
                                        pow(pow(twice(x), 3.0), 1.0 / 3.0)};
    for (const Twice& f : identities) {
      // The inner function's second derivative reaches x⁻² ≤ 100 before it cancels.
      EXPECT_NEAR(primal(f), x, 16 * eps);
      EXPECT_NEAR(first(f), 1.0, 64 * eps);
      EXPECT_NEAR(second(f), 0.0, 1600 * eps);
    }
  }
}

TEST(Dual, HypotIsTheRootOfTheSumOfSquares) {
  const auto x = Nested::variable(D2::variable(-1.5, 0), 0);
  const auto y = Nested::variable(D2::variable(0.8, 1), 1);
  const Nested ours = hypot(x, y);
  const Nested plain = sqrt(x * x + y * y);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_NEAR(ours.gradient[i].value, plain.gradient[i].value, 8 * eps);
    for (std::size_t j = 0; j < 2; ++j) EXPECT_NEAR(ours.gradient[i].gradient[j], plain.gradient[i].gradient[j], 8 * eps);
  }
  EXPECT_TRUE(isfinite(hypot(D2::variable(1e300, 0), D2::variable(1e300, 1)).value)) << "squares must not overflow";
}

TEST(Dual, PowersAtZeroAreExact) {
  const Twice x = twice(0.0);
  EXPECT_EQ(primal(pow(x, 0.0)), 1.0);
  EXPECT_EQ(first(pow(x, 0.0)), 0.0);
  EXPECT_EQ(second(pow(x, 0.0)), 0.0);
  EXPECT_EQ(primal(pow(x, 1.0)), 0.0);
  EXPECT_EQ(first(pow(x, 1.0)), 1.0);
  EXPECT_EQ(second(pow(x, 1.0)), 0.0);
  EXPECT_EQ(primal(pow(x, 2.0)), 0.0);
  EXPECT_EQ(first(pow(x, 2.0)), 0.0);
  EXPECT_EQ(second(pow(x, 2.0)), 2.0);
}

TEST(Dual, AbsoluteValueAtZeroTakesTheRightDerivative) {
  EXPECT_EQ(first(abs(twice(0.0))), 1.0);
  EXPECT_EQ(first(abs(twice(-0.5))), -1.0);
  EXPECT_EQ(second(abs(twice(-0.5))), 0.0);
}

TEST(Dual, ComparisonsLookAtValuesOnly) {
  const auto steep = 1.0 + Dual<double, 1>::variable(0.0, 0) * 100.0;
  const Dual<double, 1> flat(1.0);
  EXPECT_TRUE(steep == flat);
  EXPECT_FALSE(steep != flat);
  EXPECT_FALSE(steep < flat || steep > flat);
  EXPECT_TRUE(steep <= flat && steep >= flat);
  EXPECT_TRUE(steep < 2.0 && 0.5 < steep && steep == 1.0 && steep > 0);
  const Twice x = twice(0.5);
  EXPECT_TRUE(x < 1.0 && x > 0 && x <= 0.5 && 0.25 < x);
}

TEST(Dual, BranchesOnNestedDualsKeepTheDerivativesOfTheirSide) {
  const auto clipped = [](const Twice& x) -> Twice { return x > 0.0 ? x * x * x : -x; };
  EXPECT_EQ(second(clipped(twice(2.0))), 12.0);
  EXPECT_EQ(first(clipped(twice(-2.0))), -1.0);
  EXPECT_EQ(second(clipped(twice(-2.0))), 0.0);

  const Twice x = twice(2.0);
  EXPECT_EQ(second(max(x * x, Twice(3.0))), 2.0);
  EXPECT_EQ(second(max(x * x, Twice(5.0))), 0.0);
  EXPECT_EQ(second(min(x * x, x * x * x)), 2.0);
  EXPECT_EQ(primal(min(x, Twice(1.0))), 1.0);
}

TEST(Dual, TiesInMinAndMaxGoToTheFirstAsInTheStandardLibrary) {
  const auto x = Dual<double, 2>::variable(1.0, 0);
  const auto y = Dual<double, 2>::variable(1.0, 1);
  EXPECT_EQ(min(x, y).gradient[0], 1.0);
  EXPECT_EQ(max(x, y).gradient[0], 1.0);
}

TEST(Dual, MixesWithPlainNumbersAtEveryDepth) {
  using Thrice = Dual<Twice, 1>;
  const auto check = []<class S>(const S& x) {
    EXPECT_EQ(primal(x + 1), 4.0);
    EXPECT_EQ(primal(1 - x), -2.0);
    EXPECT_EQ(primal(2 * x), 6.0);
    EXPECT_EQ(primal(x / 2), 1.5);
    EXPECT_EQ(primal(6.0 / x), 2.0);
    EXPECT_EQ(primal(x - 1.0), 2.0);
    EXPECT_EQ(primal(pow(x, 2)), 9.0);
    EXPECT_EQ(primal(+x), 3.0);
    S sum = 1.0;
    sum += x;
    sum *= 2.0;
    sum -= 1;
    sum /= x;
    EXPECT_NEAR(primal(sum), 7.0 / 3.0, 8 * eps);
  };
  check(Dual<double, 3>::variable(3.0, 1));
  check(twice(3.0));
  check(Thrice::variable(twice(3.0), 0));
  const Thrice x = Thrice::variable(twice(3.0), 0);
  EXPECT_EQ((x * x * x).gradient[0].gradient[0].gradient[0], 6.0) << "third derivative of x³";
}

// The shape of a Hamiltonian's derivatives: the outer directions differ from the inner ones in number.
TEST(Dual, NestingDepthsMayDifferInSize) {
  using Inner = Dual<double, 1>;
  using Outer = Dual<Inner, 3>;
  std::array<Outer, 3> q{};
  for (int i = 0; i < 3; ++i) {
    Inner value(1.0 + i);
    if (i == 2) value = Inner::variable(3.0, 0);
    q[static_cast<std::size_t>(i)] = Outer::variable(value, i);
  }
  const Outer h = q[0] * q[1] * q[2] * q[2];
  EXPECT_EQ(h.gradient[0].value, 18.0);
  EXPECT_EQ(h.gradient[0].gradient[0], 12.0);
  EXPECT_EQ(h.gradient[2].value, 12.0);
  EXPECT_EQ(h.gradient[2].gradient[0], 4.0);
}

TEST(Dual, FiniteOnlyIfEveryPartIs) {
  EXPECT_TRUE(isfinite(D2::variable(1.0, 0)));
  EXPECT_FALSE(isfinite(D2(infinity)));
  EXPECT_FALSE(isfinite(sqrt(D2::variable(0.0, 0)))) << "the value is 0, the slope is not finite";
  EXPECT_FALSE(isfinite(sqrt(D2::variable(-1.0, 0))));
}

TEST(Dual, EvaluatesAtCompileTime) {
  constexpr auto x = Dual<double, 1>::variable(3.0, 0);
  static_assert((x * x + 1.0).gradient[0] == 6.0);
  static_assert(primal(Twice(2.0)) == 2.0);
}

}  // namespace
}  // namespace costate
