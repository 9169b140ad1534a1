/// \file
/// The linear problems 1–18 of the test set of Cash and Mazzia, ε y'' = g(x, y, y'; ε) with y given at both ends: boundary layers at
/// either end (1, 2, 4, 8, 18), interior layers and turning points (3, 5–7, 9–11, 15), oscillations (16), and their solutions.
///
/// J. R. Cash & F. Mazzia, A test set for boundary value problem solvers (Bari, 2014), after P. W. Hemker, A Numerical Study of
/// Stiff Two-Point Boundary Problems (Amsterdam, 1977). The statements are checked against the solutions in two_point_test.
#pragma once

#include <costate/two_point.hpp>

#include <array>
#include <numbers>

namespace costate {

/// d/dx erf x = 2/√π exp(−x²).
using std::erf;
template <class T, int N>
Dual<T, N> erf(const Dual<T, N>& x) {
  return chain<T, N>(x, erf(x.value), T(std::numbers::inv_sqrtpi * 2.0) * exp(-(x.value * x.value)));
}

namespace bvp {

constexpr double pi = std::numbers::pi;

/// ε y'' = y.
struct Problem1 {
  static constexpr int number = 1;
  static constexpr double a = 0.0, b = 1.0;
  template <class S>
  static S second(const S&, const S& y, const S&, const S& e) {
    return y / e;
  }
  template <class S>
  static S exact(const S& x, const S& e) {
    const S r = sqrt(e);
    return (exp(-x / r) - exp((x - 2.0) / r)) / (1.0 - exp(-2.0 / r));
  }
};

/// ε y'' = y'.
struct Problem2 {
  static constexpr int number = 2;
  static constexpr double a = 0.0, b = 1.0;
  template <class S>
  static S second(const S&, const S&, const S& dy, const S& e) {
    return dy / e;
  }
  template <class S>
  static S exact(const S& x, const S& e) {
    return (1.0 - exp((x - 1.0) / e)) / (1.0 - exp(-1.0 / e));
  }
};

/// ε y'' + (2 + cos πx) y' − y = −(1 + επ²) cos πx − (2 + cos πx) π sin πx.
struct Problem3 {
  static constexpr int number = 3;
  static constexpr double a = -1.0, b = 1.0;
  template <class S>
  static S second(const S& x, const S& y, const S& dy, const S& e) {
    const S c = cos(pi * x), s = sin(pi * x);
    return (y - (2.0 + c) * dy - (1.0 + pi * pi * e) * c - (2.0 + c) * pi * s) / e;
  }
  template <class S>
  static S exact(const S& x, const S&) {
    return cos(pi * x);
  }
};

/// ε y'' + y' − (1 + ε) y = 0.
struct Problem4 {
  static constexpr int number = 4;
  static constexpr double a = -1.0, b = 1.0;
  template <class S>
  static S second(const S&, const S& y, const S& dy, const S& e) {
    return ((1.0 + e) * y - dy) / e;
  }
  template <class S>
  static S exact(const S& x, const S& e) {
    return exp(x - 1.0) + exp(-(1.0 + e) * (1.0 + x) / e);
  }
};

/// ε y'' − x y' − y = −(1 + επ²) cos πx + πx sin πx.
struct Problem5 {
  static constexpr int number = 5;
  static constexpr double a = -1.0, b = 1.0;
  template <class S>
  static S second(const S& x, const S& y, const S& dy, const S& e) {
    return (x * dy + y - (1.0 + pi * pi * e) * cos(pi * x) + pi * x * sin(pi * x)) / e;
  }
  template <class S>
  static S exact(const S& x, const S&) {
    return cos(pi * x);
  }
};

/// ε y'' + x y' = −επ² cos πx − πx sin πx.
struct Problem6 {
  static constexpr int number = 6;
  static constexpr double a = -1.0, b = 1.0;
  template <class S>
  static S second(const S& x, const S&, const S& dy, const S& e) {
    return (-x * dy - pi * pi * e * cos(pi * x) - pi * x * sin(pi * x)) / e;
  }
  template <class S>
  static S exact(const S& x, const S& e) {
    return cos(pi * x) + erf(x / sqrt(2.0 * e)) / erf(1.0 / sqrt(2.0 * e));
  }
};

/// ε y'' + x y' − y = −(1 + επ²) cos πx − πx sin πx.
struct Problem7 {
  static constexpr int number = 7;
  static constexpr double a = -1.0, b = 1.0;
  template <class S>
  static S second(const S& x, const S& y, const S& dy, const S& e) {
    return (y - x * dy - (1.0 + pi * pi * e) * cos(pi * x) - pi * x * sin(pi * x)) / e;
  }
  template <class S>
  static S exact(const S& x, const S& e) {
    const auto corner = [&](const S& at) {
      return at * erf(at / sqrt(2.0 * e)) + sqrt(2.0 * e / pi) * exp(-(at * at) / (2.0 * e));
    };
    return cos(pi * x) + x + corner(x) / corner(S(1.0));
  }
};

/// ε y'' + y' = 0, y from 1 to 2.
struct Problem8 {
  static constexpr int number = 8;
  static constexpr double a = 0.0, b = 1.0;
  template <class S>
  static S second(const S&, const S&, const S& dy, const S& e) {
    return -dy / e;
  }
  template <class S>
  static S exact(const S& x, const S& e) {
    return (2.0 - exp(-1.0 / e) - exp(-x / e)) / (1.0 - exp(-1.0 / e));
  }
};

/// (ε + x²) y'' + 4x y' + 2y = 0.
struct Problem9 {
  static constexpr int number = 9;
  static constexpr double a = -1.0, b = 1.0;
  template <class S>
  static S second(const S& x, const S& y, const S& dy, const S& e) {
    return -(4.0 * x * dy + 2.0 * y) / (e + x * x);
  }
  template <class S>
  static S exact(const S& x, const S& e) {
    return 1.0 / (e + x * x);
  }
};

/// ε y'' + x y' = 0.
struct Problem10 {
  static constexpr int number = 10;
  static constexpr double a = -1.0, b = 1.0;
  template <class S>
  static S second(const S& x, const S&, const S& dy, const S& e) {
    return -x * dy / e;
  }
  template <class S>
  static S exact(const S& x, const S& e) {
    return 1.0 + erf(x / sqrt(2.0 * e)) / erf(1.0 / sqrt(2.0 * e));
  }
};

/// ε y'' − y = −(1 + επ²) cos πx: problems 11–14 differ in which ends carry a layer, of height `left` and `right`.
template <int Number, int left, int right>
struct Layers {
  static constexpr int number = Number;
  static constexpr double a = -1.0, b = 1.0;
  template <class S>
  static S second(const S& x, const S& y, const S&, const S& e) {
    return (y - (1.0 + pi * pi * e) * cos(pi * x)) / e;
  }
  /// cos πx + left·sinh((1 − x)/√ε)/sinh(2/√ε) + right·sinh((1 + x)/√ε)/sinh(2/√ε), in decaying exponentials.
  template <class S>
  static S exact(const S& x, const S& e) {
    const S r = sqrt(e);
    const auto layer = [&](const S& distance) {
      return (exp(-distance / r) - exp((distance - 4.0) / r)) / (1.0 - exp(-4.0 / r));
    };
    return cos(pi * x) + static_cast<double>(left) * layer(1.0 + x) + static_cast<double>(right) * layer(1.0 - x);
  }
};
using Problem11 = Layers<11, 0, 0>;
using Problem12 = Layers<12, 0, 1>;
using Problem13 = Layers<13, 1, 0>;
using Problem14 = Layers<14, 1, 1>;

/// ε y'' = x y: Airy functions of x ε^(−1/3).
struct Problem15 {
  static constexpr int number = 15;
  static constexpr double a = -1.0, b = 1.0;
  template <class S>
  static S second(const S& x, const S& y, const S&, const S& e) {
    return x * y / e;
  }
  static std::array<double, 2> ends(double) { return {1.0, 1.0}; }
};

/// ε² y'' + (π/2)² y = 0, for 1/ε an odd number.
struct Problem16 {
  static constexpr int number = 16;
  static constexpr double a = 0.0, b = 1.0;
  template <class S>
  static S second(const S&, const S& y, const S&, const S& e) {
    return -(0.25 * pi * pi) * y / (e * e);
  }
  template <class S>
  static S exact(const S& x, const S& e) {
    return sin(0.5 * pi * x / e);
  }
};

/// y'' + 3ε y/(ε + x²)² = 0.
struct Problem17 {
  static constexpr int number = 17;
  static constexpr double a = -0.1, b = 0.1;
  template <class S>
  static S second(const S& x, const S& y, const S&, const S& e) {
    const S q = e + x * x;
    return -3.0 * e * y / (q * q);
  }
  template <class S>
  static S exact(const S& x, const S& e) {
    return x / sqrt(e + x * x);
  }
};

/// ε y'' + y' = 0, y from 1 to exp(−1/ε).
struct Problem18 {
  static constexpr int number = 18;
  static constexpr double a = 0.0, b = 1.0;
  template <class S>
  static S second(const S&, const S&, const S& dy, const S& e) {
    return -dy / e;
  }
  template <class S>
  static S exact(const S& x, const S& e) {
    return exp(-x / e);
  }
};

}  // namespace bvp
}  // namespace costate
