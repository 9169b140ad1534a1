/// Numbers defined by an equation: the guarded Newton, and exact derivatives at any nesting.
#include <costate/implicit.hpp>

#include <gtest/gtest.h>

namespace costate {
namespace {

/// u³ + a u = b, a > 0: one real root.
struct Cubic {
  template <class S>
  S operator()(const S& u, const std::array<S, 2>& c) const {
    return u * u * u + c[0] * u - c[1];
  }
};

/// Kepler: u − e sin u = m.
struct Kepler {
  template <class S>
  S operator()(const S& u, const std::array<S, 2>& c) const {
    return u - c[0] * sin(u) - c[1];
  }
};

TEST(GuardedRoot, MeetsTheEquationToRounding) {
  for (const double a : {0.01, 1.0, 30.0}) {
    for (const double b : {-50.0, -1e-3, 2.0, 1e4}) {
      const double u = guarded_root(Cubic{}, std::array{a, b}, -100.0, 100.0);
      // The terms cancel to rounding of the largest.
      EXPECT_NEAR(u * u * u + a * u, b, 4e-16 * (std::abs(u * u * u) + std::abs(a * u) + std::abs(b))) << a << ' ' << b;
    }
  }
}

TEST(GuardedRoot, KeepsToTheBracketWhereNewtonWouldLeaveIt) {
  // From the middle of the bracket Newton's step on arctan overshoots by far.
  const auto steep = [](const auto& u, const auto& c) { return atan(1e4 * (u - c[0])); };
  EXPECT_NEAR(guarded_root(steep, std::array{0.123}, -1000.0, 5.0), 0.123, 1e-12);
}

TEST(GuardedRoot, RootAtAnEndIsFound) {
  const auto line = [](const auto& u, const auto& c) { return u - c[0]; };
  EXPECT_EQ(guarded_root(line, std::array{2.0}, 2.0, 3.0), 2.0);
  EXPECT_EQ(guarded_root(line, std::array{3.0}, 2.0, 3.0), 3.0);
}

TEST(GuardedRoot, WithoutAChangeOfSignIsLeftDomain) {
  const auto square = [](const auto& u, const auto& c) { return u * u + c[0]; };
  EXPECT_THROW((void)guarded_root(square, std::array{1.0}, -1.0, 2.0), LeftDomain);
  EXPECT_THROW((void)guarded_root(square, std::array{std::nan("")}, -1.0, 2.0), LeftDomain);
}

// u_a = −u/(3u² + a), u_b = 1/(3u² + a) by the implicit function theorem.
TEST(ImplicitRoot, FirstDerivatives) {
  using D = Dual<double, 2>;
  const D u = implicit_root(Cubic{}, std::array{D::variable(0.7, 0), D::variable(2.0, 1)}, -10.0, 10.0);
  const double slope = 3.0 * u.value * u.value + 0.7;
  EXPECT_NEAR(u.gradient[0], -u.value / slope, 1e-15);
  EXPECT_NEAR(u.gradient[1], 1.0 / slope, 1e-15);
}

// u_bb = −6u u_b²/(3u² + a) and u_ab = −(u_b + 6u u_a u_b)/(3u² + a).
TEST(ImplicitRoot, SecondDerivativesOfNestedNumbers) {
  using D = Dual<double, 2>;
  using DD = Dual<D, 2>;
  const std::array<DD, 2> c{DD::variable(D::variable(0.7, 0), 0), DD::variable(D::variable(2.0, 1), 1)};
  const DD u = implicit_root(Cubic{}, c, -10.0, 10.0);
  const double value = primal(u), slope = 3.0 * value * value + 0.7, ua = -value / slope, ub = 1.0 / slope;
  EXPECT_NEAR(u.value.gradient[0], ua, 1e-15);
  EXPECT_NEAR(u.gradient[1].value, ub, 1e-15);
  EXPECT_NEAR(u.gradient[1].gradient[1], -6.0 * value * ub * ub / slope, 1e-14);
  EXPECT_NEAR(u.gradient[0].gradient[1], -(ub + 6.0 * value * ua * ub) / slope, 1e-14);
  EXPECT_NEAR(u.gradient[1].gradient[0], u.gradient[0].gradient[1], 1e-15) << "mixed derivatives are equal";
}

TEST(ImplicitRoot, ThirdDerivativesAgainstDifferencesOfTheSecond) {
  using D1 = Dual<double, 1>;
  using D2 = Dual<D1, 1>;
  using D3 = Dual<D2, 1>;
  const auto second = [](double m) {
    const D2 x = D2::variable(D1::variable(m, 0), 0);
    return implicit_root(Kepler{}, std::array{D2(0.6), x}, -4.0, 4.0).gradient[0].gradient[0];
  };
  const double m = 0.9, h = 1e-4;
  const D3 x = D3::variable(D2::variable(D1::variable(m, 0), 0), 0);
  const D3 u = implicit_root(Kepler{}, std::array{D3(0.6), x}, -4.0, 4.0);
  // Five-point formula: h⁴ times a fifth derivative of order 10³, and rounding over h.
  const double difference = (second(m - 2 * h) - 8 * second(m - h) + 8 * second(m + h) - second(m + 2 * h)) / (12 * h);
  EXPECT_NEAR(u.gradient[0].gradient[0].gradient[0], difference, 1e-10);
}

}  // namespace
}  // namespace costate
