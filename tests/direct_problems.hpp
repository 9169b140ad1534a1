// Optimal-control problems stated without a guess.
#pragma once

#include <costate/control_problem.hpp>

namespace costate {

/// x' = v, v' = u, L = u²/2.
struct DoubleIntegrator {
  static constexpr int states = 2, controls = 1, parameters = 0;
  template <class S>
  Vec<S, 2> dynamics(const Vec<S, 2>& q, const Vec<S, 1>& u, const Vec<S, 0>&) const {
    return {q[1], u[0]};
  }
  template <class S>
  S cost(const Vec<S, 2>&, const Vec<S, 1>& u, const Vec<S, 0>&) const {
    return 0.5 * u[0] * u[0];
  }
};

/// The same in minimum time, with the position cyclic.
struct TimeOptimal {
  static constexpr int states = 2, cyclic = 1, controls = 1, parameters = 0;
  template <class S>
  Vec<S, 2> dynamics(const Vec<S, 2>& q, const Vec<S, 1>& u, const Vec<S, 0>&) const {
    return {q[1], u[0]};
  }
};

/// x' = u, L = x².
struct Turnpike {
  static constexpr int states = 1, controls = 1, parameters = 0;
  template <class S>
  Vec<S, 1> dynamics(const Vec<S, 1>&, const Vec<S, 1>& u, const Vec<S, 0>&) const {
    return {u[0]};
  }
  template <class S>
  S cost(const Vec<S, 1>& q, const Vec<S, 1>&, const Vec<S, 0>&) const {
    return q[0] * q[0];
  }
};

/// (x, y, vx, vy)' = (vx, vy, a cos u, a sin u).
struct Thrust {
  static constexpr int states = 4, cyclic = 2, controls = 1, parameters = 1;
  template <class S>
  Vec<S, 4> dynamics(const Vec<S, 4>& q, const Vec<S, 1>& u, const Vec<S, 1>& a) const {
    return {q[2], q[3], a[0] * cos(u[0]), a[0] * sin(u[0])};
  }
};

/// The rocket of Goddard. r' = v, v' = (u T − D)/m − 1/r², m' = −b T u, D = 310 v² exp(−500 (r − 1)).
struct Goddard {
  static constexpr int states = 3, controls = 1, parameters = 0;
  template <class S>
  Vec<S, 3> dynamics(const Vec<S, 3>& q, const Vec<S, 1>& u, const Vec<S, 0>&) const {
    const auto& [r, v, m] = q;
    const S thrust = 3.5 * u[0], drag = 310.0 * v * v * exp(-500.0 * (r - 1.0));
    return {v, (thrust - drag) / m - 1.0 / (r * r), -2.0 * thrust};
  }
  template <class S>
  S cost(const Vec<S, 3>&, const Vec<S, 1>&, const Vec<S, 0>&) const {
    return S(0.0);
  }
};

/// x' = y, y' = −x + (1 − x²) y + u, L = (x² + y² + u²)/2.
struct VanDerPol {
  static constexpr int states = 2, controls = 1, parameters = 0;
  template <class S>
  Vec<S, 2> dynamics(const Vec<S, 2>& q, const Vec<S, 1>& u, const Vec<S, 0>&) const {
    return {q[1], -q[0] + (1.0 - q[0] * q[0]) * q[1] + u[0]};
  }
  template <class S>
  S cost(const Vec<S, 2>& q, const Vec<S, 1>& u, const Vec<S, 0>&) const {
    return 0.5 * (q[0] * q[0] + q[1] * q[1] + u[0] * u[0]);
  }
};

/// Planar flight around a centre, with thrust T/(1 − 0.0749 t) in the direction u from the horizontal: (t, r, v_r, v_θ).
struct OrbitRaising {
  static constexpr int states = 4, controls = 1, parameters = 0;
  template <class S>
  Vec<S, 4> dynamics(const Vec<S, 4>& q, const Vec<S, 1>& u, const Vec<S, 0>&) const {
    const auto& [t, r, vr, vt] = q;
    const S a = 0.1405 / (1.0 - 0.0749 * t);
    return {S(1.0), vr, vt * vt / r - 1.0 / (r * r) + a * sin(u[0]), -(vr * vt) / r + a * cos(u[0])};
  }
  template <class S>
  S cost(const Vec<S, 4>&, const Vec<S, 1>&, const Vec<S, 0>&) const {
    return S(0.0);
  }
};

/// θ'' = −sin θ + u in minimum time.
struct FastPendulum {
  static constexpr int states = 2, controls = 1, parameters = 0;
  template <class S>
  Vec<S, 2> dynamics(const Vec<S, 2>& q, const Vec<S, 1>& u, const Vec<S, 0>&) const {
    return {q[1], -sin(q[0]) + u[0]};
  }
};

/// Dubins' car: (x, y, θ)' = (cos θ, sin θ, u).
struct Car {
  static constexpr int states = 3, controls = 1, parameters = 0;
  template <class S>
  Vec<S, 3> dynamics(const Vec<S, 3>& q, const Vec<S, 1>& u, const Vec<S, 0>&) const {
    return {cos(q[2]), sin(q[2]), u[0]};
  }
};

}  // namespace costate
