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

TEST(TwoPoint, HasUnknownsRowsAndParametersInTheOrderOfTheStatement) {
  const auto problem = oscillator().unknown_parameter("L").shared;
  (void)problem;
}

}  // namespace
}  // namespace costate
