/// \file
/// Nonlinear problems of the test set of Cash and Mazzia, 19–34: second-order ones as g of y'' = g(x, y, y'; ε), systems as
/// right-hand sides. Solutions in closed form where there are any.
///
/// J. R. Cash & F. Mazzia, A test set for boundary value problem solvers (Bari, 2014); 24, 31 and 33 after U. Ascher, R. Mattheij &
/// R. Russell, Numerical Solution of Boundary Value Problems for Ordinary Differential Equations (SIAM, 1995), ch. 1.
#pragma once

#include "bvp_linear.hpp"

namespace costate::bvp {

/// ε y'' + exp(y) y' − (π/2) sin(πx/2) exp(2y) = 0.
struct Problem19 {
  static constexpr int number = 19;
  static constexpr double a = 0.0, b = 1.0;
  template <class S>
  static S second(const S& x, const S& y, const S& dy, const S& e) {
    const S growth = exp(y);
    return growth * (0.5 * pi * sin(0.5 * pi * x) * growth - dy) / e;
  }
  static std::array<double, 2> ends(double) { return {0.0, 0.0}; }
};

/// ε y'' + y'² = 1: a corner at 0.745.
struct Problem20 {
  static constexpr int number = 20;
  static constexpr double a = 0.0, b = 1.0;
  template <class S>
  static S second(const S&, const S&, const S& dy, const S& e) {
    return (1.0 - dy * dy) / e;
  }
  /// 1 + ε ln cosh((x − 0.745)/ε), with the exponentials that decay.
  template <class S>
  static S exact(const S& x, const S& e) {
    const S z = abs(x - 0.745);
    return 1.0 + z + e * log(0.5 + 0.5 * exp(-2.0 * z / e));
  }
};

/// ε y'' = y + y² − exp(−2x/√ε).
struct Problem21 {
  static constexpr int number = 21;
  static constexpr double a = 0.0, b = 1.0;
  template <class S>
  static S second(const S& x, const S& y, const S&, const S& e) {
    return (y + y * y - exp(-2.0 * x / sqrt(e))) / e;
  }
  template <class S>
  static S exact(const S& x, const S& e) {
    return exp(-x / sqrt(e));
  }
};

/// ε y'' + y' + y² = 0.
struct Problem22 {
  static constexpr int number = 22;
  static constexpr double a = 0.0, b = 1.0;
  template <class S>
  static S second(const S&, const S& y, const S& dy, const S& e) {
    return -(dy + y * y) / e;
  }
  static std::array<double, 2> ends(double) { return {0.0, 0.5}; }
};

/// Troesch: y'' = μ sinh μy. Here the parameter is μ.
struct Problem23 {
  static constexpr int number = 23;
  static constexpr double a = 0.0, b = 1.0;
  template <class S>
  static S second(const S&, const S& y, const S&, const S& mu) {
    return mu * sinh(mu * y);
  }
  static std::array<double, 2> ends(double) { return {0.0, 1.0}; }
};

/// Shock wave in a nozzle of area A = 1 + x²: ε A u u'' − ((1 + γ)/2 − ε A') u u' + u'/u + (A'/A)(1 − (γ − 1)/2 u²) = 0, γ = 1.4.
struct Problem24 {
  static constexpr int number = 24;
  static constexpr double a = 0.0, b = 1.0;
  template <class S>
  static S second(const S& x, const S& u, const S& du, const S& e) {
    constexpr double gamma = 1.4;
    const S area = 1.0 + x * x, slope = 2.0 * x;
    const S sum = (0.5 * (1.0 + gamma) - e * slope) * u * du - du / u - slope / area * (1.0 - 0.5 * (gamma - 1.0) * u * u);
    return sum / (e * area * u);
  }
  static std::array<double, 2> ends(double) { return {0.9129, 0.375}; }
};

/// ε y'' + y y' − y = 0: problems 25–30 differ in the values at the ends, `left`/6 and `right`/6.
template <int Number, int left, int right>
struct Lagerstrom {
  static constexpr int number = Number;
  static constexpr double a = 0.0, b = 1.0;
  template <class S>
  static S second(const S&, const S& y, const S& dy, const S& e) {
    return y * (1.0 - dy) / e;
  }
  static std::array<double, 2> ends(double) { return {left / 6.0, right / 6.0}; }
};
using Problem25 = Lagerstrom<25, -2, 2>;
using Problem26 = Lagerstrom<26, 6, -2>;
using Problem27 = Lagerstrom<27, 6, 2>;
using Problem28 = Lagerstrom<28, 6, 9>;
using Problem29 = Lagerstrom<29, 0, 9>;
using Problem30 = Lagerstrom<30, -7, 9>;

/// Bratu: y'' + λ exp y = 0, λ = θ²/(2 cosh²(θ/4)), y = −2 ln(cosh(θ(x − ½)/2)/cosh(θ/4)). Here the parameter is θ; θ < 4.7987
/// is the lower branch.
struct Problem34 {
  static constexpr int number = 34;
  static constexpr double a = 0.0, b = 1.0;
  template <class S>
  static S second(const S&, const S& y, const S&, const S& theta) {
    const S c = cosh(0.25 * theta);
    return -(0.5 * theta * theta / (c * c)) * exp(y);
  }
  template <class S>
  static S exact(const S& x, const S& theta) {
    return -2.0 * log(cosh(0.5 * theta * (x - 0.5)) / cosh(0.25 * theta));
  }
};

using Ends = std::pair<std::optional<double>, std::optional<double>>;
constexpr std::nullopt_t open = std::nullopt;

/// Elastic beam: y' = sin θ, θ' = M, ε M' = −Q, ε Q' = (y − 1) cos θ − M (sec θ + ε Q tan θ).
struct Problem31 {
  static constexpr int number = 31, states = 4, parameters = 1;
  static constexpr double a = 0.0, b = 1.0;
  static constexpr std::array names{"y", "theta", "M", "Q"};
  template <class S>
  Vec<S, 4> rates(const S&, const Vec<S, 4>& z, const Vec<S, 1>& p) const {
    const auto& [y, theta, moment, shear] = z;
    const S& e = p[0];
    const S tension = 1.0 / cos(theta) + e * shear * tan(theta);
    return {sin(theta), moment, -shear / e, ((y - 1.0) * cos(theta) - moment * tension) / e};
  }
  static std::array<Ends, 4> ends(double) { return {Ends{0.0, 0.0}, {open, open}, {0.0, 0.0}, {open, open}}; }
};

/// Flow in a channel with porous walls: y'''' = R (y' y'' − y y'''). Here the parameter is R.
struct Problem32 {
  static constexpr int number = 32, states = 4, parameters = 1;
  static constexpr double a = 0.0, b = 1.0;
  static constexpr std::array names{"y", "y'", "y''", "y'''"};
  template <class S>
  Vec<S, 4> rates(const S&, const Vec<S, 4>& y, const Vec<S, 1>& p) const {
    return {y[1], y[2], y[3], p[0] * (y[1] * y[2] - y[0] * y[3])};
  }
  static std::array<Ends, 4> ends(double) { return {Ends{0.0, 1.0}, {0.0, 0.0}, {open, open}, {open, open}}; }
  static std::array<double, 4> scales(double) { return {1.0, 1.0, 10.0, 10.0}; }
};

/// Flow between discs that rotate against each other: ε f'''' + f f''' + g g' = 0, ε g'' + f g' − f' g = 0. The solution is odd about
/// the middle: f(1 − x) = −f(x), g(1 − x) = −g(x).
struct Problem33 {
  static constexpr int number = 33, states = 6, parameters = 1;
  static constexpr double a = 0.0, b = 1.0;
  static constexpr std::array names{"g", "g'", "f", "f'", "f''", "f'''"};
  template <class S>
  Vec<S, 6> rates(const S&, const Vec<S, 6>& y, const Vec<S, 1>& p) const {
    const auto& [g, dg, f, df, ddf, dddf] = y;
    return {dg, (df * g - f * dg) / p[0], df, ddf, dddf, -(f * dddf + g * dg) / p[0]};
  }
  static std::array<Ends, 6> ends(double) {
    return {Ends{-1.0, 1.0}, {open, open}, {0.0, 0.0}, {0.0, 0.0}, {open, open}, {open, open}};
  }
};

}  // namespace costate::bvp
