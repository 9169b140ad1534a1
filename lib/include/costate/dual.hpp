/// \file
/// Dual numbers: exact derivatives of any function written on a generic scalar.
///
/// A dual number carries a value and its gradient in N directions. Arithmetic follows the rules of calculus, so evaluating
/// f on Dual<double, N> gives f and N directional derivatives to rounding error, with no differences taken. The type nests:
/// Dual<Dual<double, N>, M> gives second derivatives, which is how the Jacobian of a Hamiltonian's gradient is found.
///
/// Reference: Griewank & Walther, Evaluating Derivatives, 2nd ed., SIAM 2008, ch. 3 and 13.
#pragma once

#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>

namespace costate {

// A model calls sin(x) unqualified on whatever scalar it is given; these make the call work for double as well.
using std::abs;
using std::acos;
using std::asin;
using std::atan;
using std::atan2;
using std::cos;
using std::cosh;
using std::exp;
using std::hypot;
using std::isfinite;
using std::log;
using std::max;
using std::min;
using std::pow;
using std::sin;
using std::sinh;
using std::sqrt;
using std::tan;
using std::tanh;

/// Value and gradient: x = value, ∂x/∂ε_i = gradient[i], i = 0 … N − 1. T is double or another Dual.
template <class T, int N>
struct Dual {
  T value{};
  std::array<T, static_cast<std::size_t>(N)> gradient{};

  constexpr Dual() = default;
  constexpr Dual(const T& constant) : value(constant) {}  // NOLINT: constants mix freely with variables
  constexpr Dual(double constant)                         // NOLINT: likewise
    requires(!std::same_as<T, double>)
      : value(constant) {}

  /// The independent variable of the given direction: its derivative there is 1 and 0 elsewhere.
  static constexpr Dual variable(const T& value, int direction) {
    Dual x(value);
    x.gradient[static_cast<std::size_t>(direction)] = T(1.0);
    return x;
  }

  constexpr Dual& operator+=(const Dual& b) { return *this = *this + b; }
  constexpr Dual& operator-=(const Dual& b) { return *this = *this - b; }
  constexpr Dual& operator*=(const Dual& b) { return *this = *this * b; }
  constexpr Dual& operator/=(const Dual& b) { return *this = *this / b; }

  friend constexpr Dual operator+(const Dual& a) { return a; }
  friend constexpr Dual operator-(const Dual& a) {
    return combine(-a.value, a, a, [](const T& da, const T&) { return -da; });
  }
  friend constexpr Dual operator+(const Dual& a, const Dual& b) {
    return combine(a.value + b.value, a, b, [](const T& da, const T& db) { return da + db; });
  }
  friend constexpr Dual operator-(const Dual& a, const Dual& b) {
    return combine(a.value - b.value, a, b, [](const T& da, const T& db) { return da - db; });
  }
  friend constexpr Dual operator*(const Dual& a, const Dual& b) {
    return combine(a.value * b.value, a, b, [&](const T& da, const T& db) { return da * b.value + a.value * db; });
  }
  friend constexpr Dual operator/(const Dual& a, const Dual& b) {
    const T inverse = T(1.0) / b.value;
    const T quotient = a.value * inverse;
    return combine(quotient, a, b, [&](const T& da, const T& db) { return (da - quotient * db) * inverse; });
  }

  // A constant factor or summand costs no product-rule terms.
  friend constexpr Dual operator+(const Dual& a, const T& c) {
    Dual r = a;
    r.value = a.value + c;
    return r;
  }
  friend constexpr Dual operator+(const T& c, const Dual& a) { return a + c; }
  friend constexpr Dual operator-(const Dual& a, const T& c) { return a + (-c); }
  friend constexpr Dual operator-(const T& c, const Dual& a) { return (-a) + c; }
  friend constexpr Dual operator*(const Dual& a, const T& c) {
    return combine(a.value * c, a, a, [&](const T& da, const T&) { return da * c; });
  }
  friend constexpr Dual operator*(const T& c, const Dual& a) { return a * c; }
  friend constexpr Dual operator/(const Dual& a, const T& c) { return a * (T(1.0) / c); }
  friend constexpr Dual operator/(const T& c, const Dual& a) { return Dual(c) / a; }

  // Comparisons look at the value alone: a branch is taken as the undifferentiated program would take it.
  friend constexpr bool operator<(const Dual& a, const Dual& b) { return a.value < b.value; }
  friend constexpr bool operator>(const Dual& a, const Dual& b) { return b < a; }
  friend constexpr bool operator<=(const Dual& a, const Dual& b) { return a.value <= b.value; }
  friend constexpr bool operator>=(const Dual& a, const Dual& b) { return b <= a; }
  friend constexpr bool operator==(const Dual& a, const Dual& b) { return a.value == b.value; }

  template <class Rule>
  static constexpr Dual combine(const T& value, const Dual& a, const Dual& b, Rule rule) {
    Dual r(value);
    for (std::size_t i = 0; i < r.gradient.size(); ++i) r.gradient[i] = rule(a.gradient[i], b.gradient[i]);
    return r;
  }
};

// Mixing a nested dual with a plain number: the inner scalar's own overloads do not see double.
#define COSTATE_DUAL_WITH_DOUBLE(op)                                      \
  template <class T, int N>                                               \
    requires(!std::same_as<T, double>)                                    \
  constexpr Dual<T, N> operator op(const Dual<T, N>& a, double c) {       \
    return a op T(c);                                                     \
  }                                                                       \
  template <class T, int N>                                               \
    requires(!std::same_as<T, double>)                                    \
  constexpr Dual<T, N> operator op(double c, const Dual<T, N>& a) {       \
    return T(c) op a;                                                     \
  }
COSTATE_DUAL_WITH_DOUBLE(+)
COSTATE_DUAL_WITH_DOUBLE(-)
COSTATE_DUAL_WITH_DOUBLE(*)
COSTATE_DUAL_WITH_DOUBLE(/)
#undef COSTATE_DUAL_WITH_DOUBLE

/// The undifferentiated number inside any nesting of duals.
constexpr double primal(double x) { return x; }
template <class T, int N>
constexpr double primal(const Dual<T, N>& x) {
  return primal(x.value);
}

/// Chain rule for a function of one variable: f(x) with f′(x) given.
template <class T, int N>
constexpr Dual<T, N> chain(const Dual<T, N>& x, const T& f, const T& derivative) {
  return Dual<T, N>::combine(f, x, x, [&](const T& dx, const T&) { return derivative * dx; });
}
/// Chain rule for a function of two variables.
template <class T, int N>
constexpr Dual<T, N> chain(const Dual<T, N>& x, const Dual<T, N>& y, const T& f, const T& fx, const T& fy) {
  return Dual<T, N>::combine(f, x, y, [&](const T& dx, const T& dy) { return fx * dx + fy * dy; });
}

template <class T, int N>
Dual<T, N> sin(const Dual<T, N>& x) {
  return chain<T, N>(x, sin(x.value), cos(x.value));
}
template <class T, int N>
Dual<T, N> cos(const Dual<T, N>& x) {
  return chain<T, N>(x, cos(x.value), -sin(x.value));
}
template <class T, int N>
Dual<T, N> tan(const Dual<T, N>& x) {
  const T t = tan(x.value);
  return chain<T, N>(x, t, 1.0 + t * t);
}
template <class T, int N>
Dual<T, N> asin(const Dual<T, N>& x) {
  return chain<T, N>(x, asin(x.value), 1.0 / sqrt(1.0 - x.value * x.value));
}
template <class T, int N>
Dual<T, N> acos(const Dual<T, N>& x) {
  return chain<T, N>(x, acos(x.value), -1.0 / sqrt(1.0 - x.value * x.value));
}
template <class T, int N>
Dual<T, N> atan(const Dual<T, N>& x) {
  return chain<T, N>(x, atan(x.value), 1.0 / (1.0 + x.value * x.value));
}
template <class T, int N>
Dual<T, N> exp(const Dual<T, N>& x) {
  const T e = exp(x.value);
  return chain<T, N>(x, e, e);
}
template <class T, int N>
Dual<T, N> log(const Dual<T, N>& x) {
  return chain<T, N>(x, log(x.value), 1.0 / x.value);
}
template <class T, int N>
Dual<T, N> sqrt(const Dual<T, N>& x) {
  const T root = sqrt(x.value);
  return chain<T, N>(x, root, 0.5 / root);
}
template <class T, int N>
Dual<T, N> sinh(const Dual<T, N>& x) {
  return chain<T, N>(x, sinh(x.value), cosh(x.value));
}
template <class T, int N>
Dual<T, N> cosh(const Dual<T, N>& x) {
  return chain<T, N>(x, cosh(x.value), sinh(x.value));
}
template <class T, int N>
Dual<T, N> tanh(const Dual<T, N>& x) {
  const T t = tanh(x.value);
  return chain<T, N>(x, t, 1.0 - t * t);
}
/// |x|; at 0 the derivative from the right.
template <class T, int N>
Dual<T, N> abs(const Dual<T, N>& x) {
  return primal(x) < 0.0 ? -x : x;
}
template <class T, int N>
Dual<T, N> atan2(const Dual<T, N>& y, const Dual<T, N>& x) {
  const T square = x.value * x.value + y.value * y.value;
  return chain<T, N>(y, x, atan2(y.value, x.value), x.value / square, -y.value / square);
}
template <class T, int N>
Dual<T, N> hypot(const Dual<T, N>& x, const Dual<T, N>& y) {
  const T h = hypot(x.value, y.value);
  return chain<T, N>(x, y, h, x.value / h, y.value / h);
}
/// x^c for a constant exponent; x⁰ = 1 and x¹ have exact derivatives also at x = 0.
template <class T, int N>
Dual<T, N> pow(const Dual<T, N>& x, double c) {
  if (c == 0.0) return Dual<T, N>(1.0);
  return chain<T, N>(x, pow(x.value, c), c * pow(x.value, c - 1.0));
}
/// x^y for x > 0.
template <class T, int N>
Dual<T, N> pow(const Dual<T, N>& x, const Dual<T, N>& y) {
  const T f = pow(x.value, y.value);
  return chain<T, N>(x, y, f, y.value * pow(x.value, y.value - 1.0), f * log(x.value));
}
template <class T, int N>
Dual<T, N> pow(double base, const Dual<T, N>& y) {
  const T f = pow(base, y.value);
  return chain<T, N>(y, f, f * std::log(base));
}
template <class T, int N>
Dual<T, N> min(const Dual<T, N>& a, const Dual<T, N>& b) {
  return b < a ? b : a;
}
template <class T, int N>
Dual<T, N> max(const Dual<T, N>& a, const Dual<T, N>& b) {
  return a < b ? b : a;
}
template <class T, int N>
Dual<T, N> min(const Dual<T, N>& a, double b) {
  return min(a, Dual<T, N>(b));
}
template <class T, int N>
Dual<T, N> max(const Dual<T, N>& a, double b) {
  return max(a, Dual<T, N>(b));
}
template <class T, int N>
bool isfinite(const Dual<T, N>& x) {
  bool finite = isfinite(x.value);
  for (const T& g : x.gradient) finite = finite && isfinite(g);
  return finite;
}

}  // namespace costate
