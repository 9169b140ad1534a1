/// \file
/// Numbers defined by an equation: u with F(u; c) = 0, and its exact derivatives with respect to c.
#pragma once

#include <costate/dual.hpp>
#include <costate/error.hpp>
#include <costate/vec.hpp>

#include <array>
#include <cmath>
#include <limits>
#include <string>

namespace costate {

/// How deep a scalar nests: 0 for double, 1 for Dual<double, N>, 2 for Dual<Dual<double, N>, M>, …
template <class S>
inline constexpr int nesting = 0;
template <class T, int N>
inline constexpr int nesting<Dual<T, N>> = 1 + nesting<T>;

/// The undifferentiated numbers of a vector.
template <class S, std::size_t n>
std::array<double, n> primal(const std::array<S, n>& c) {
  std::array<double, n> r{};
  for (std::size_t i = 0; i < n; ++i) r[i] = primal(c[i]);
  return r;
}

/// A root of F(u; c) between `lower` and `upper`, where F must have different signs or a zero: Newton's method, replaced by
/// bisection where a step would leave the bracket or shrink it too slowly. `f(u, c)` is generic on the scalar.
/// \throws LeftDomain if F has the same sign at both ends or is not a number there.
template <std::size_t n, class F>
double guarded_root(const F& f, const std::array<double, n>& c, double lower, double upper) {
  using D = Dual<double, 1>;
  const auto at = [&](double u) { return f(D::variable(u, 0), lift<D>(c)); };
  const double left = at(lower).value, right = at(upper).value;
  if (left == 0.0) return lower;
  if (right == 0.0) return upper;
  if (!(left * right < 0.0)) {
    throw LeftDomain("no root between " + std::to_string(lower) + " and " + std::to_string(upper) + ": no change of sign");
  }
  double u = 0.5 * (lower + upper);
  double step = upper - lower;
  while (true) {
    const D value = at(u);
    if (value.value == 0.0) return u;
    ((value.value < 0.0) == (left < 0.0) ? lower : upper) = u;
    const double newton = u - value.value / value.gradient[0];
    const double middle = 0.5 * (lower + upper);
    // Each step at least halves the one before, or the bracket is halved.
    const bool trusted = newton > lower && newton < upper && std::abs(newton - u) < 0.5 * std::abs(step);
    const double next = trusted ? newton : middle;
    step = next - u;
    if (std::abs(step) <= std::numeric_limits<double>::epsilon() * std::abs(next) || next == lower || next == upper) return next;
    u = next;
  }
}

/// The same on a generic scalar: the root of the undifferentiated equation by guarded_root, then its derivatives. In
/// u ← u − F(u; c)/F_u, with F_u a plain number taken at the root, each step makes one more order of derivatives exact (the
/// implicit function theorem): as many steps as the scalar nests. A root with F_u = 0 has no derivative: the result is not finite.
template <class S, std::size_t n, class F>
S implicit_root(const F& f, const std::array<S, n>& c, double lower, double upper) {
  using D = Dual<double, 1>;
  const std::array<double, n> numbers = primal(c);
  const double root = guarded_root(f, numbers, lower, upper);
  S u(root);
  if constexpr (nesting<S> > 0) {
    const double slope = f(D::variable(root, 0), lift<D>(numbers)).gradient[0];
    for (int order = 0; order < nesting<S>; ++order) u = u - f(u, c) / slope;
  }
  return u;
}

}  // namespace costate
