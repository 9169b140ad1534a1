/// \file
/// An integrator that shares nothing with the library: what a solution claims is integrated again with it.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <stdexcept>

namespace costate::test {

/// y(t1) of y' = f(t, y), y(t0) = y, by the pair of Dormand & Prince, orders 5 and 4 (J. Comput. Appl. Math. 6 (1980) 19–26), with
/// the error of a step below `tolerance`·(1 + |yᵢ|). `f` maps (t, array) to array. \throws std::runtime_error if the step vanishes.
template <std::size_t N, class F>
std::array<double, N> runge_kutta(const F& f, double t0, double t1, std::array<double, N> y, double tolerance) {
  using State = std::array<double, N>;
  constexpr double c[7] = {0.0, 1.0 / 5, 3.0 / 10, 4.0 / 5, 8.0 / 9, 1.0, 1.0};
  constexpr double a[7][6] = {{},
                              {1.0 / 5},
                              {3.0 / 40, 9.0 / 40},
                              {44.0 / 45, -56.0 / 15, 32.0 / 9},
                              {19372.0 / 6561, -25360.0 / 2187, 64448.0 / 6561, -212.0 / 729},
                              {9017.0 / 3168, -355.0 / 33, 46732.0 / 5247, 49.0 / 176, -5103.0 / 18656},
                              {35.0 / 384, 0.0, 500.0 / 1113, 125.0 / 192, -2187.0 / 6784, 11.0 / 84}};
  constexpr double e[7] = {71.0 / 57600, 0.0, -71.0 / 16695, 71.0 / 1920, -17253.0 / 339200, 22.0 / 525, -1.0 / 40};
  double t = t0, h = (t1 - t0) / 64.0;
  while (t != t1) {
    if (std::abs(h) >= std::abs(t1 - t)) h = t1 - t;
    std::array<State, 7> k;
    State next = y;
    for (std::size_t s = 0; s < 7; ++s) {
      next = y;
      for (std::size_t j = 0; j < s; ++j) {
        for (std::size_t i = 0; i < N; ++i) next[i] += h * a[s][j] * k[j][i];
      }
      k[s] = f(t + c[s] * h, next);
    }
    double error = 0.0;
    for (std::size_t i = 0; i < N; ++i) {
      double sum = 0.0;
      for (std::size_t s = 0; s < 7; ++s) sum += e[s] * k[s][i];
      error = std::max(error, std::abs(h * sum) / (tolerance * (1.0 + std::abs(y[i]))));
    }
    if (!std::isfinite(error)) error = 1e10;
    if (error <= 1.0) {
      t = h == t1 - t ? t1 : t + h;
      y = next;
    }
    h *= std::clamp(0.9 * std::pow(std::max(error, 1e-10), -0.2), 0.2, 5.0);
    if (std::abs(h) < 1e-15 * std::abs(t1 - t0)) throw std::runtime_error("the step of the independent integration vanished");
  }
  return y;
}

}  // namespace costate::test
