/// \file
/// Quadrature and roots of one variable, for what needs no flow. Private to the models library.
#pragma once

#include <costate/dual.hpp>

#include <cmath>
#include <numbers>

namespace costate {

/// An integral and what the last refinement changed in it.
template <class S>
struct Integral {
  S value{};
  double change = 0.0;
};

/// ∫₀¹ f(q) dq by the double exponential rule q = 1/(1 + e^{−π sinh t}) (Takahasi & Mori, Publ. RIMS 9 (1974) 721–741),
/// refined until the value rests. f(q, 1 − q) may have integrable singularities at both ends; it is given both distances
/// with all their digits. S is a double or a dual number.
template <class S = double, class F>
Integral<S> integrate(const F& f) {
  constexpr double end = 3.9;  // q = 1e-33: what lies beyond is less than rounding also for f ~ 1/√q
  constexpr int finest = 9;
  const auto term = [&](double t) {
    const double e = std::exp(-std::numbers::pi * std::sinh(t));
    const double q = 1.0 / (1.0 + e), rest = e / (1.0 + e);
    return S(f(q, rest)) * (std::numbers::pi * std::cosh(t) * q * rest);
  };
  Integral<S> result;
  S sum = term(0.0);
  double h = 0.5;
  for (int i = 1; i * h < end; ++i) sum += term(i * h) + term(-i * h);
  result.value = sum * h;
  for (int level = 0; level < finest; ++level) {
    for (int i = 0; (i + 0.5) * h < end; ++i) sum += term((i + 0.5) * h) + term(-(i + 0.5) * h);
    h *= 0.5;
    const S before = result.value;
    result.value = sum * h;
    result.change = std::abs(primal(result.value) - primal(before));
    if (result.change <= 1e-14 * std::abs(primal(result.value))) break;
  }
  return result;
}

/// The root of f between a and b, where f has different signs, to the last digit: inverse quadratic interpolation where it
/// is safe, bisection elsewhere (Chandrupatla, Adv. Eng. Software 28 (1997) 145–149).
template <class F>
double bracketed_root(const F& f, double a, double b) {
  double fa = f(a), fb = f(b), c = a, fc = fa;
  if (fa == 0.0) return a;
  double part = 0.5;
  for (int i = 0; i < 200 && fb != 0.0; ++i) {
    const double x = a + part * (b - a), fx = f(x);
    if ((fx > 0.0) == (fa > 0.0)) {
      c = a;
      fc = fa;
    } else {
      c = b;
      fc = fb;
      b = a;
      fb = fa;
    }
    a = x;
    fa = fx;
    if (fa == 0.0) break;
    const double least = 2e-16 * std::abs(std::abs(fa) < std::abs(fb) ? a : b) / std::abs(b - a);
    if (!(least < 0.5)) break;
    const double xi = (a - b) / (c - b), phi = (fa - fb) / (fc - fb);
    part = phi * phi < xi && (1.0 - phi) * (1.0 - phi) < 1.0 - xi
               ? fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb)
               : 0.5;
    part = std::min(std::max(part, least), 1.0 - least);
  }
  return std::abs(fa) < std::abs(fb) ? a : b;
}

}  // namespace costate
