/// Jets: the chain rule through every function against dual numbers, and sparse gradients that merge by column.
#include <costate/error.hpp>
#include <costate/jet.hpp>

#include <gtest/gtest.h>
#include <limits>
#include <string>

namespace costate {
namespace {

constexpr double eps = std::numeric_limits<double>::epsilon();

std::vector<int> columns(const Jet& a) {
  std::vector<int> present;
  for (const Jet::Entry& entry : a.gradient()) present.push_back(entry.column);
  return present;
}

using D3 = Dual<double, 3>;

/// The same expression on Jet (columns 4, 7, 9 of some problem) and on Dual: both are exact, so they agree to rounding.
template <class F>
void expect_like_dual(F f) {
  const double x = 0.7, y = 1.9, z = 0.3;
  const D3 dual = f(D3::variable(x, 0), D3::variable(y, 1), D3::variable(z, 2));
  const Jet jet = f(Jet::variable(x, 4), Jet::variable(y, 7), Jet::variable(z, 9));
  EXPECT_NEAR(jet.value, dual.value, 4 * eps * std::max(1.0, std::abs(dual.value)));
  const int column[] = {4, 7, 9};
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(jet.derivative(column[i]), dual.gradient[i], 16 * eps * std::max(1.0, std::abs(dual.gradient[i]))) << i;
  }
}

TEST(Jet, FollowsTheChainRule) {
  expect_like_dual([](auto x, auto y, auto z) { return x + y - z; });
  expect_like_dual([](auto x, auto y, auto z) { return -x * y * z; });
  expect_like_dual([](auto x, auto y, auto z) { return x / y / z; });
  expect_like_dual([](auto x, auto y, auto z) { return sin(x * y) + cos(y - z); });
  expect_like_dual([](auto x, auto y, auto z) { return exp(x / y) * log(z); });
  expect_like_dual([](auto x, auto y, auto z) { return sqrt(x * x + y * y) / z; });
  expect_like_dual([](auto x, auto y, auto) { return 2.0 * x - y / 3.0 + 1; });
  expect_like_dual([](auto x, auto y, auto z) {
    auto sum = x;
    sum += y * z;
    sum -= z;
    return 1.0 / sum;
  });
}

TEST(Jet, ConstantHasNoColumns) {
  const Jet c = 3.0;
  EXPECT_EQ(c.value, 3.0);
  EXPECT_TRUE(c.gradient().empty());
  EXPECT_TRUE((c * c + sin(c)).gradient().empty());
}

TEST(Jet, VariableHasItsColumnAndRate) {
  EXPECT_EQ(Jet::variable(3.0, 2).derivative(2), 1.0);
  EXPECT_EQ(Jet::variable(3.0, 2, -0.5).derivative(2), -0.5);
  EXPECT_EQ((2.0 * Jet::variable(3.0, 2, -0.5)).derivative(2), -1.0);
}

TEST(Jet, AbsentColumnsAreZero) {
  const Jet a = Jet::variable(1.0, 3) * Jet::variable(2.0, 8);
  for (const int absent : {-1, 0, 2, 4, 7, 9, 1000}) EXPECT_EQ(a.derivative(absent), 0.0) << absent;
  EXPECT_EQ(Jet().derivative(0), 0.0);
}

TEST(Jet, GradientsMergeInAscendingOrderWithoutRepeats) {
  const Jet odd(1.0, {{1, 10.0}, {3, 30.0}, {5, 50.0}});
  const Jet low(1.0, {{0, 1.0}, {1, 2.0}, {3, 3.0}});
  const Jet high(1.0, {{5, 7.0}, {6, 8.0}});
  EXPECT_EQ(columns(odd + low), (std::vector{0, 1, 3, 5}));
  EXPECT_EQ(columns(low + odd), (std::vector{0, 1, 3, 5}));
  EXPECT_EQ(columns(low * high), (std::vector{0, 1, 3, 5, 6}));
  EXPECT_EQ(columns(high - odd), (std::vector{1, 3, 5, 6}));
  EXPECT_EQ(columns(odd + 1.0), columns(odd));
  EXPECT_EQ((odd + low).derivative(1), 12.0);
  EXPECT_EQ((odd - low).derivative(3), 27.0);
  EXPECT_EQ((odd - high).derivative(6), -8.0);
  EXPECT_EQ((low - odd).derivative(5), -50.0);
}

// Beyond the columns a jet has room for.
TEST(Jet, LongGradientsAreCopiedMovedAndMerged) {
  Jet even(1.0), odd(2.0);
  for (int column = 0; column < 24; ++column) (column % 2 == 0 ? even : odd) += Jet::variable(0.0, column, column + 1.0);
  const Jet sum = even + odd;
  Jet copy = sum;
  copy = sum;
  Jet moved = std::move(copy);
  copy = Jet::variable(1.0, 3);  // to be used again after a move
  moved += copy;
  EXPECT_EQ(copy.derivative(3), 1.0);
  EXPECT_EQ(columns(moved).size(), 24U);
  for (int column = 0; column < 24; ++column) {
    EXPECT_EQ(sum.derivative(column), column + 1.0);
    EXPECT_EQ(moved.derivative(column), column + 1.0 + (column == 3 ? 1.0 : 0.0));
  }
  Jets many;
  for (int i = 0; i < 12; ++i) many.push_back(i * sum);
  many = Jets(many.begin() + 1, many.end());
  ASSERT_EQ(many.size(), 11U);
  EXPECT_EQ(many.back().derivative(23), 11.0 * 24.0);
}

TEST(Jet, ChainScalesEachArgument) {
  const Jet a(2.0, {{0, 1.0}, {1, 2.0}});
  const Jet b(3.0, {{1, 5.0}, {2, 7.0}});
  const Jet f = Jet::chain(a, b, 11.0, 10.0, 100.0);
  EXPECT_EQ(f.value, 11.0);
  EXPECT_EQ(f.derivative(0), 10.0);
  EXPECT_EQ(f.derivative(1), 520.0);
  EXPECT_EQ(f.derivative(2), 700.0);
  EXPECT_EQ(Jet::chain(a, 4.0, -1.0).derivative(1), -2.0);
}

TEST(Jet, ArgumentMayBeItsOwnResult) {
  Jet a = Jet::variable(3.0, 0);
  a += a;
  EXPECT_EQ(a.value, 6.0);
  EXPECT_EQ(a.derivative(0), 2.0);
  a -= a;
  EXPECT_EQ(a.value, 0.0);
  EXPECT_EQ(a.derivative(0), 0.0);
}

TEST(Jet, SquareRootOfANegativeNumberSaysWhatWasNegative) {
  try {
    sqrt(Jet::variable(-0.25, 0), "discriminant of the boundary speed");
    FAIL() << "no exception";
  } catch (const LeftDomain& failure) {
    const std::string message = failure.what();
    EXPECT_NE(message.find("discriminant of the boundary speed"), std::string::npos) << message;
    EXPECT_NE(message.find("-0.25"), std::string::npos) << message;
  }
  EXPECT_THROW(sqrt(Jet(std::numeric_limits<double>::quiet_NaN())), LeftDomain);
  EXPECT_EQ(sqrt(Jet(0.0)).value, 0.0);
}

}  // namespace
}  // namespace costate
