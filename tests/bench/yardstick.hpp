/// \file
/// The yardstick: problems of one free arc solved by what is written by hand for them alone, against which the library's times are divided.
///
/// Unknowns u = (t_f, λx, λy). The arc and its variational equations in λx and λy are one system of twelve numbers for Dop853: four of
/// the state, then each number's two derivatives. Newton's method runs on a ladder of tolerances.
#pragma once

#include "dop853.hpp"

#include <numbers>

namespace costate::bench {

/// The rolling disk's free arc (see costate/models/disk.hpp), in its simplest form: with H = 0
///
///     φ' = λφ,  λφ' = −A A_φ,  x' = A cos φ,  y' = A sin φ,  A = λx cos φ + λy sin φ,  λφ(0) = √(1 − λx²),
///
/// from φ = x = y = 0 to φ = π/2, x = a, y = b.
template <class S>
struct DiskArc {
  static constexpr std::size_t size = 12;
  S lambda_x = 0, lambda_y = 0;
  std::array<S, 2> end{1, 1};

  void operator()(const std::array<S, size>& y, std::array<S, size>& rate) const {
    using std::cos, std::sin;
    const S s = sin(y[0]), c = cos(y[0]);
    const S A = lambda_x * c + lambda_y * s, B = lambda_y * c - lambda_x * s;
    const S bend = A * A - B * B, gradient[2] = {B * c - A * s, B * s + A * c}, direction[2] = {c, s};
    rate[0] = y[1];
    rate[1] = -A * B;
    rate[2] = A * c;
    rate[3] = A * s;
    for (std::size_t j = 0; j < 2; ++j) {
      rate[4 + j] = y[6 + j];
      rate[6 + j] = bend * y[4 + j] - gradient[j];
      rate[8 + j] = gradient[0] * y[4 + j] + c * direction[j];
      rate[10 + j] = gradient[1] * y[4 + j] + s * direction[j];
    }
  }
  /// False if there is no such λφ(0).
  bool start(std::array<S, size>& y) const {
    using std::sqrt;
    const S square = S(1) - lambda_x * lambda_x;
    if (!(square > S(0))) return false;
    y = {};
    y[1] = sqrt(square);
    y[6] = -lambda_x / y[1];
    return true;
  }
  /// Rows of the end, and the places of their numbers in the state.
  static constexpr std::size_t rows[3] = {0, 2, 3};
  [[nodiscard]] std::array<S, 3> targets() const { return {std::numbers::pi_v<S> / 2, end[0], end[1]}; }
  template <std::size_t N>
  [[nodiscard]] std::array<S, 4> state_rates(const std::array<S, N>& y) const {
    using std::cos, std::sin;
    const S s = sin(y[0]), c = cos(y[0]), A = lambda_x * c + lambda_y * s;
    return {y[1], -A * (lambda_y * c - lambda_x * s), A * c, A * s};
  }
};

/// The bead of costate/models/drag.hpp: (v, λv, x, y) with K(v) = −μ v + β v³. H = 0 makes √((vλx)² + (vλy − gλv)²) = 1 − λv K, so that
///
///     cos θ = vλx/(1 − λv K),  sin θ = (vλy − gλv)/(1 − λv K),
///
/// from v = v₀, whose λv(0) is the larger root of H = 0 (the path sets out below where λv = vλy/g), to λv = 0, x = a, y = b.
template <class S>
struct BeadFlight {
  static constexpr std::size_t size = 12;
  S lambda_x = 0, lambda_y = 0;
  S mu = S(0.3L), beta = S(0.004L), speed = 2, gravity = S(9.8L);
  std::array<S, 2> end{6, -1};

  void operator()(const std::array<S, size>& y, std::array<S, size>& rate) const {
    const S v = y[0], l = y[1], bv2 = beta * v * v;
    const S K = v * (bv2 - mu), K1 = S(3) * bv2 - mu, K2 = S(6) * beta * v;
    const S r = S(1) / (S(1) - l * K), c = v * lambda_x * r, s = (v * lambda_y - gravity * l) * r;
    rate[0] = K - gravity * s;
    rate[1] = -(lambda_x * c + lambda_y * s) - l * K1;
    rate[2] = v * c;
    rate[3] = v * s;
    const S r_v = r * l * K1, r_l = r * K;
    const S c_v = lambda_x * r + c * r_v, c_l = c * r_l, s_v = lambda_y * r + s * r_v, s_l = s * r_l - gravity * r;
    const S vr = v * r, l_v = -(lambda_x * c_v + lambda_y * s_v) - l * K2, l_l = -(lambda_x * c_l + lambda_y * s_l) - K1;
    const S direct[2] = {vr * lambda_x + c, vr * lambda_y + s};
    for (std::size_t j = 0; j < 2; ++j) {
      const S dv = y[4 + j], dl = y[6 + j], own_x = j == 0 ? vr : S(0), own_y = j == 0 ? S(0) : vr;
      const S dc = c_v * dv + c_l * dl + own_x, ds = s_v * dv + s_l * dl + own_y;
      rate[4 + j] = K1 * dv - gravity * ds;
      rate[6 + j] = l_v * dv + l_l * dl - direct[j];
      rate[8 + j] = dv * c + v * dc;
      rate[10 + j] = dv * s + v * ds;
    }
  }
  bool start(std::array<S, size>& y) const {
    using std::sqrt;
    const S K = speed * (beta * speed * speed - mu);
    const S a = gravity * gravity - K * K, b = K - gravity * speed * lambda_y;
    const S c = speed * speed * (lambda_x * lambda_x + lambda_y * lambda_y) - S(1);
    const S square = b * b - a * c;
    if (!(square > S(0))) return false;
    const S root = sqrt(square), l = (root - b) / a;
    y = {};
    y[0] = speed;
    y[1] = l;
    // a l² + 2 b l + c = 0, differentiated.
    y[6] = -speed * speed * lambda_x / root;
    y[7] = (gravity * l - speed * lambda_y) * speed / root;
    return true;
  }
  static constexpr std::size_t rows[3] = {1, 2, 3};
  [[nodiscard]] std::array<S, 3> targets() const { return {S(0), end[0], end[1]}; }
  template <std::size_t N>
  [[nodiscard]] std::array<S, 4> state_rates(const std::array<S, N>& y) const {
    const S v = y[0], l = y[1], K = v * (beta * v * v - mu), r = S(1) / (S(1) - l * K);
    const S c = v * lambda_x * r, s = (v * lambda_y - gravity * l) * r;
    return {K - gravity * s, -(lambda_x * c + lambda_y * s) - l * (S(3) * beta * v * v - mu), v * c, v * s};
  }
};

/// What a solve has cost and where it ended.
template <class S, std::size_t N>
struct Root {
  bool found = false;
  std::array<S, N> unknowns{};
  int iterations = 0;
  long steps = 0, evaluations = 0;
};

/// x of A x = b, by Cramer's rule.
template <class S>
std::array<S, 3> solve3(const std::array<std::array<S, 3>, 3>& A, const std::array<S, 3>& b) {
  const auto cross = [](const std::array<S, 3>& u, const std::array<S, 3>& v) {
    return std::array<S, 3>{u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
  };
  // Rows of A; A⁻¹ has the columns r₂×r₃, r₃×r₁, r₁×r₂ over the determinant.
  const auto p = cross(A[1], A[2]), q = cross(A[2], A[0]), w = cross(A[0], A[1]);
  const S inverse = S(1) / (A[0][0] * p[0] + A[0][1] * p[1] + A[0][2] * p[2]);
  std::array<S, 3> x;
  for (std::size_t i = 0; i < 3; ++i) x[i] = inverse * (b[0] * p[i] + b[1] * q[i] + b[2] * w[i]);
  return x;
}

/// The tolerances of a Newton iteration whose corrections shrink quadratically: the next correction is expected to be about δ², what is
/// left after it δ⁴, and an integration need not be more exact than that.
template <class S>
struct Ladder {
  S finest = S(1e-9L);  ///< of the last integration
  S loosest = S(0.1L);  ///< of the first
  S share = S(100.0L);  ///< tolerance over δ⁴: the method's errors are some orders below its tolerances
  S enough = S(1.0L);   ///< Newton's method ends where δ² < enough · finest
  bool chord = true;    ///< the last correction may be by the Jacobian of the point before, from the state alone
  [[nodiscard]] S next(S correction) const {
    const S square = correction * correction;
    return std::clamp(share * square * square, finest, loosest);
  }
};

/// Newton's method on one arc, from `start`. `integrate(arc, duration, y, tolerance, alone)` takes y to the end, or only the state's four
/// numbers if `alone`, and returns whether it could.
template <class Arc, class S, class Integrate>
Root<S, 3> newton(Arc arc, const std::array<S, 3>& start, const Ladder<S>& ladder, const Integrate& integrate) {
  Root<S, 3> root{.unknowns = start};
  auto& u = root.unknowns;
  S tolerance = ladder.loosest, size = 0;
  std::array<std::array<S, 3>, 3> jacobian{};
  for (root.iterations = 1; root.iterations <= 20; ++root.iterations) {
    arc.lambda_x = u[1];
    arc.lambda_y = u[2];
    std::array<S, Arc::size> y;
    if (!arc.start(y)) return root;
    // A correction by the Jacobian of the last point leaves about δ³.
    const bool chord = ladder.chord && root.iterations > 1 && size * size * size < ladder.enough * ladder.finest;
    if (chord) tolerance = ladder.finest;
    if (!integrate(arc, u[0], y, tolerance, chord)) return root;
    const auto targets = arc.targets();
    std::array<S, 3> residual;
    for (std::size_t i = 0; i < 3; ++i) residual[i] = y[Arc::rows[i]] - targets[i];
    if (!chord) {
      const auto rates = arc.state_rates(y);
      for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t place = Arc::rows[i];
        jacobian[i] = {rates[place], y[4 + 2 * place], y[5 + 2 * place]};
      }
    }
    const auto correction = solve3(jacobian, residual);
    size = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      u[i] -= correction[i];
      size = std::max(size, std::abs(correction[i]));
    }
    if (!(size < S(1e3))) return root;
    root.found = chord || (tolerance == ladder.finest && size * size < ladder.enough * ladder.finest);
    if (root.found) return root;
    tolerance = ladder.next(size);
  }
  return root;
}

/// The yardstick of one arc.
template <class Arc, class S>
Root<S, 3> solve_by_hand(const Arc& arc, const std::array<S, 3>& start, const Ladder<S>& ladder) {
  Dop853<Arc::size, S> whole;
  Dop853<4, S> state_alone;
  Root<S, 3> root = newton(arc, start, ladder,
                           [&](const Arc& at, S duration, std::array<S, Arc::size>& y, S tolerance, bool alone) {
                             if (!alone) return whole.integrate(at, duration, y, tolerance);
                             std::array<S, 4> state{y[0], y[1], y[2], y[3]};
                             const auto rates = [at](const std::array<S, 4>& z, std::array<S, 4>& rate) {
                               rate = at.state_rates(z);
                             };
                             state_alone.begin_like(whole);
                             const bool arrived = state_alone.integrate(rates, duration, state, tolerance);
                             std::copy(state.begin(), state.end(), y.begin());
                             return arrived;
                           });
  root.steps = whole.steps + state_alone.steps;
  root.evaluations = whole.evaluations + state_alone.evaluations;
  return root;
}

}  // namespace costate::bench
