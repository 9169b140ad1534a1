/// \file
/// The motion over a short stretch of τ. Private to the direct method.
#pragma once

#include <costate/dual.hpp>

namespace costate::curvature {

/// What a cell adds, seen from ln v = 0 at its start.
template <class S>
struct Step {
  S theta, log_v, x, y, t;
};

/// One step of the classical Runge–Kutta method with η linear in τ.
template <class S>
Step<S> step(const S& theta, const S& from, const S& to, const S& length, double mu, double beta) {
  const auto rates = [&](const Step<S>& at, const S& eta) {
    const S cosine = cos(at.theta), sine = sin(at.theta), v = exp(at.log_v), v2 = v * v;
    return Step<S>{eta - cosine, eta * (beta * eta * eta - mu) - sine, v2 * cosine, v2 * sine, v};
  };
  const auto move = [](const Step<S>& at, const Step<S>& rate, const S& by) {
    return Step<S>{at.theta + by * rate.theta, at.log_v + by * rate.log_v, at.x + by * rate.x, at.y + by * rate.y,
                   at.t + by * rate.t};
  };
  const S half = 0.5 * length, middle = 0.5 * (from + to);
  Step<S> at{theta, S(0.0), S(0.0), S(0.0), S(0.0)};
  const Step<S> k1 = rates(at, from), k2 = rates(move(at, k1, half), middle), k3 = rates(move(at, k2, half), middle),
                k4 = rates(move(at, k3, length), to);
  const S sixth = length * (1.0 / 6.0), third = length * (1.0 / 3.0);
  return move(move(move(move(at, k1, sixth), k2, third), k3, third), k4, sixth);
}

}  // namespace costate::curvature
