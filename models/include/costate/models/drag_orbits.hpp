/// \file
/// The extremals of the bead with drag, reduced to quadratures.
///
/// Everything here is in units with g = 1. On an extremal λx, λy and H = 0 are constants, and H = N − 1 + λv K(v) with
/// N = |(vλx, vλy − λv)|. Squared, H = 0 is a quadratic for λv at given v, whose discriminant is a polynomial in s = v²,
///
///     (N v')² = D(s) = (1 − λy m)² − λx² (s − m²) = c₀ + c₁ s + c₂ s² + c₃ s³ + c₄ s⁴,   m = v K(v) = −μ s + β s²,
///
/// so λv = (A + N v') / (1 − K²) with A = v λy − K: the larger root while the bead gains speed, the smaller while it loses
/// it. With dη = dv/(h N v') for a variable η that suits the orbit, nothing is left to integrate but
///
///     dt = N h dη,   dx = v² λx h dη,   dy = v (v λy − λv) h dη.
///
/// A steady motion (v' = λv' = 0) is a double root of D and a saddle of the flow in (v, λv): a long way is travelled close
/// to it, for a time that grows with the logarithm of the distance. Integrated in time an extremal then loses all its
/// digits; here that logarithm is an unknown. Three families of orbits cover what occurs, by how D behaves between the ends:
/// D has a simple root where the speed is largest (TurningOrbit); D is small but has none (PassingOrbit); D is not small
/// (MonotoneOrbit).
///
/// Each orbit has a place at which it is nearest to a steady motion, η = 0, and is described from either side of it: the
/// variable of integration is u = side·η + ℓ with side = −1 before that place and +1 after, and ℓ the logarithm of the
/// distance, so that u is of order one at the ends of the path however long it stays near the steady motion; where the
/// sides meet u = ℓ (`middle`).
#pragma once

#include <costate/field.hpp>

namespace costate::drag {

/// K(v) = −μ v + β v³.
template <class S>
struct Friction {
  S mu, beta;
  S force(const S& v) const { return v * (beta * v * v - mu); }
  S slope(const S& v) const { return 3.0 * beta * v * v - mu; }
};

/// (1 − e^{−z})/z, 1 at z = 0.
template <class S>
S relative_decay(const S& z) {
  if (std::abs(primal(z)) > 0.5) return (1.0 - exp(-z)) / z;
  S sum(1.0), term(1.0);
  for (int k = 2; k < 18; ++k) {
    term = term * (-z) * (1.0 / k);
    sum = sum + term;
  }
  return sum;
}

/// u = side·η + ℓ where κ sinh η has the given value, κ = e^ℓ.
template <class S>
S sinh_variable(const S& value, const S& log_kappa, double side) {
  const double sign = primal(value) < 0.0 ? -1.0 : 1.0;
  const S size = sign * value;
  const S outward = log(size + sqrt(size * size + exp(2.0 * log_kappa)));  // |η| + ℓ
  return sign == side ? outward : 2.0 * log_kappa - outward;
}

/// tanh² η.
template <class S>
S tanh_square(const S& eta) {
  const S fall = exp(primal(eta) < 0.0 ? 2.0 * eta : -2.0 * eta);
  const S ratio = (1.0 - fall) / (1.0 + fall);
  return ratio * ratio;
}

/// What every orbit has: its constants.
template <class S>
struct Constants {
  Friction<S> friction;
  S lambda_x, lambda_y;

  S square() const { return lambda_x * lambda_x + lambda_y * lambda_y; }
  /// The speed at which λv = 0.
  S end_speed() const { return 1.0 / sqrt(square()); }
  S discriminant(const S& s) const {
    const S m = s * (friction.beta * s - friction.mu);
    const S one = 1.0 - lambda_y * m;
    return one * one - lambda_x * lambda_x * (s - m * m);
  }
  S c2() const { return square() * friction.mu * friction.mu - 2.0 * lambda_y * friction.beta; }
  S c3() const { return -2.0 * square() * friction.mu * friction.beta; }
  S c4() const { return square() * friction.beta * friction.beta; }
};

/// A point of an orbit. `excess` is v²(λx² + λy²) − 1, given apart because it vanishes at the end.
template <class S>
struct OrbitPoint {
  S v;
  S rate;    ///< N v'
  S weight;  ///< h
  S lambda_v;
  S normal;  ///< N = 1 − λv K
  S across;  ///< v λy − λv, as N K − N v' = N sin θ: both terms of the former may be large where a steady motion is slow

  OrbitPoint(const Constants<S>& constants, const S& speed, const S& rate_, const S& excess, const S& weight_)
      : v(speed), rate(rate_), weight(weight_) {
    const S K = constants.friction.force(v);
    const S A = v * constants.lambda_y - K;
    // Of the two forms of the root the one that adds numbers of the same sign.
    lambda_v = primal(A) * primal(rate) >= 0.0 ? (A + rate) / (1.0 - K * K) : excess / (A - rate);
    normal = 1.0 - lambda_v * K;
    across = normal * K - rate;
  }
};

/// An orbit that turns: it gains speed up to v₁, where v' = 0 and sin θ = K(v₁), and loses speed from there on. Either part
/// may be missing; then the turning point lies outside the path.
///
/// Constants: v₁ and the end slope r, which is tan θ₂ without friction; λv(v₁) = (1 − e^{−z})/c with c = −v₁K'(v₁), z = c
/// r, so that z → ∞ at the steady motion. Variable: v = v₁/√(1 + S²), S = κ sinh η, S < 0 while speed is gained (without
/// friction S = tan θ). With s₁ = v₁², ζ² = s₁ − s, D = ζ² (d + D₂ ζ² − D₃ ζ⁴ + D₄ ζ⁶), d = −D'(s₁) = (1 − K₁²) N₁
/// e^{−z}/s₁, and κ² = d/(d + D₂ s₁) (1 if D₂ < 0) the weight is smooth and of order one, however small d: κ enters by its
/// logarithm only.
template <class S>
struct TurningOrbit {
  Constants<S> constants;
  S v1, d, scale, log_kappa;
  S D2, D3, D4;
  S end_slope;  ///< S at the end: λv(v₁) √(1 − K₁²)

  TurningOrbit(const S& top_speed, const S& r, const Friction<S>& friction) : v1(top_speed) {
    const S K = friction.force(v1), s = v1 * v1;
    const S z = -(v1 * friction.slope(v1)) * r;
    const S lambda_v = r * relative_decay(z);
    const S N = 1.0 - lambda_v * K;
    const S cosine = sqrt((1.0 - K) * (1.0 + K));
    constants = {friction, N * cosine / v1, (N * K + lambda_v) / v1};
    end_slope = lambda_v * cosine;
    D2 = constants.c2() + s * (3.0 * constants.c3() + 6.0 * constants.c4() * s);
    D3 = constants.c3() + 4.0 * constants.c4() * s;
    D4 = constants.c4();
    const S log_d = log(cosine * cosine * N / s) - z;
    d = exp(log_d);
    scale = primal(D2) > 0.0 ? d + D2 * s : d;
    log_kappa = 0.5 * (log_d - log(scale));
  }

  [[nodiscard]] S middle() const { return log_kappa; }
  [[nodiscard]] S end_place() const { return end_slope; }
  /// u at a given S.
  S variable(const S& slope, double side) const { return sinh_variable(slope, log_kappa, side); }
  OrbitPoint<S> at(const S& u, double side) const {
    return point(side * 0.5 * (exp(u) - exp(2.0 * log_kappa - u)), tanh_square(u - log_kappa), side);
  }
  /// The point at a given S.
  OrbitPoint<S> at_place(const S& slope) const {
    const S square = slope * slope;
    return point(slope, square / (square + exp(2.0 * log_kappa)), 1.0);
  }

 private:
  OrbitPoint<S> point(const S& slope, const S& tanh_square, double side) const {
    const S spread = 1.0 + slope * slope;
    const S v = v1 / sqrt(spread);
    const S zeta2 = v * v * slope * slope;
    const S D234 = D2 - zeta2 * (D3 - D4 * zeta2);
    const S weight = side / (spread * sqrt(scale * (1.0 - tanh_square) + tanh_square * v * v * D234));
    const S rate = -(v * slope * sqrt(d + zeta2 * D234));
    return {constants, v, rate, (end_slope - slope) * (end_slope + slope) / spread, weight};
  }
};

/// An orbit that passes the steady motion losing speed throughout: from above it to below it.
///
/// Constants: the speed v_A at which D is least, and z, with v' = −ε there, ε = c e^{−z}, c = −v_A K'(v_A) > 0. From
/// D'(v_A) = 0 follows λv(v_A) = (1 − K² − ε(c + K + ε)) / (c(1 − K²) − εK(2c + ε)), which is 1/c at the steady motion.
/// With δ = v_A − v, D = N²ε² + E₂ δ² + δ³ F(δ), and the variable is η in δ = κ sinh η, κ = Nε/√E₂.
template <class S>
struct PassingOrbit {
  Constants<S> constants;
  S v_A, E2, D2, D3, D4;
  S log_kappa;
  S end_speed;

  PassingOrbit(const S& speed, const S& z, const Friction<S>& friction) : v_A(speed) {
    const S K = friction.force(v_A), s = v_A * v_A;
    const S c = -(v_A * friction.slope(v_A));
    const S epsilon = c * exp(-z);
    const S sine = K + epsilon, rest = (1.0 - K) * (1.0 + K);
    const S lambda_v = (rest - epsilon * (c + sine)) / (c * rest - epsilon * K * (2.0 * c + epsilon));
    const S N = 1.0 - lambda_v * K;
    constants = {friction, N * sqrt((1.0 - sine) * (1.0 + sine)) / v_A, (N * sine + lambda_v) / v_A};
    end_speed = constants.end_speed();
    D2 = constants.c2() + s * (3.0 * constants.c3() + 6.0 * constants.c4() * s);
    D3 = constants.c3() + 4.0 * constants.c4() * s;
    D4 = constants.c4();
    E2 = 4.0 * s * D2;
    log_kappa = log(N * c) - z - 0.5 * log(E2);
  }

  [[nodiscard]] S middle() const { return log_kappa; }
  [[nodiscard]] S end_place() const { return end_speed; }
  /// u at a given speed.
  S variable(const S& v, double side) const { return sinh_variable(S(v_A - v), log_kappa, side); }
  OrbitPoint<S> at(const S& u, double side) const {
    const S up = 0.5 * exp(u), down = 0.5 * exp(2.0 * log_kappa - u);
    return point(v_A - side * (up - down), up + down, tanh_square(u - log_kappa), side);
  }
  /// The point at a given speed.
  OrbitPoint<S> at_place(const S& v) const {
    const S square = (v_A - v) * (v_A - v), whole = square + exp(2.0 * log_kappa);
    return point(v, sqrt(whole), square / whole, 1.0);
  }

 private:
  OrbitPoint<S> point(const S& v, const S& cosh_part, const S& tanh_square, double side) const {
    const S delta = v_A - v, sum = v_A + v;
    const S F = D2 * (delta - 4.0 * v_A) - sum * sum * sum * (D3 - D4 * delta * sum);
    const S density = sqrt(E2 + tanh_square * delta * F);
    return {constants, v, -(density * cosh_part), (v - end_speed) * (v + end_speed) * constants.square(), side / density};
  }
};

/// A variable in which a monotone orbit is smooth: v = center ± width sinh η, + if speed is gained.
struct SpeedMap {
  double center = 0.0, width = 1.0;
};

/// An orbit whose speed changes in one sense throughout, not very close to a steady motion. Constants: the end speed v_f
/// and the end slope θ_f, so (λx, λy) = (cos θ_f, sin θ_f)/v_f. Variable: η of a SpeedMap, ℓ = 0. The sense is that of v' =
/// K(v_f) − sin θ_f at the end.
template <class S>
struct MonotoneOrbit {
  Constants<S> constants;
  S end_speed;
  double sense;
  SpeedMap map;

  MonotoneOrbit(const S& v_f, const S& theta_f, const Friction<S>& friction, const SpeedMap& speed_map = {})
      : constants{friction, cos(theta_f) / v_f, sin(theta_f) / v_f},
        end_speed(v_f),
        sense(primal(friction.force(v_f)) > std::sin(primal(theta_f)) ? 1.0 : -1.0),
        map(speed_map) {}

  [[nodiscard]] S middle() const { return S(0.0); }
  [[nodiscard]] S end_place() const { return end_speed; }
  /// u at a given speed.
  S variable(const S& v, double side) const {
    return sinh_variable(S(sense * (v - map.center) * (1.0 / map.width)), S(0.0), side);
  }
  /// The point at a given speed.
  OrbitPoint<S> at_place(const S& v) const { return at(variable(v, 1.0), 1.0); }
  OrbitPoint<S> at(const S& u, double side) const {
    const S up = 0.5 * map.width * exp(u), down = 0.5 * map.width * exp(-u);
    const S v = map.center + sense * side * (up - down);
    const S rate = sense * sqrt(constants.discriminant(v * v));
    return {constants, v, rate, (v - end_speed) * (v + end_speed) / (end_speed * end_speed),
            sense * side * (up + down) / rate};
  }
};

/// The map for an orbit that runs between two speeds: D is least at its centre, and grows by its own size over its width.
[[nodiscard]] SpeedMap speed_map(const Constants<double>& constants, double start, double end);

/// d(x, y, t)/du along an orbit.
template <template <class> class Orbit, class S>
Rates<S, 0, 3> rates_along(const Orbit<S>& orbit, const S& u, double side) {
  const OrbitPoint<S> point = orbit.at(u, side);
  const S way = point.v * point.weight;
  return {{}, {way * point.v * orbit.constants.lambda_x, way * point.across, point.normal * point.weight}};
}

/// An orbit as an arc without states: p = (its two constants, μ, β), w = (x, y, t), variable u on one side.
template <template <class> class OrbitOf>
struct OrbitArc {
  static constexpr int states = 0, parameters = 4, quadratures = 3;
  template <class S>
  using Orbit = OrbitOf<S>;
  double side = 1.0;
  SpeedMap map{};  ///< of a monotone orbit; others have no use for it

  template <class S>
  Orbit<S> orbit(const Vec<S, 4>& p) const {
    if constexpr (requires(const Orbit<S>& o) { o.map; }) {
      return Orbit<S>(p[0], p[1], Friction<S>{p[2], p[3]}, map);
    } else {
      return Orbit<S>(p[0], p[1], Friction<S>{p[2], p[3]});
    }
  }
  template <class S>
  Rates<S, 0, 3> rates(const S& u, const Vec<S, 0>&, const Vec<S, 4>& p) const {
    return rates_along(orbit(p), u, side);
  }
};

}  // namespace costate::drag
