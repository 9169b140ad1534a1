/// \file
/// A bead slowed by friction that depends on the normal force, the path's curvature left out of that force, to be brought
/// from one point to another in minimum time by the choice of the path (Negrón-Marrero & Santiago-Figueroa, The nonlinear
/// brachistochrone problem with friction, University of Puerto Rico at Humacao, 2005, §2.1, here [N]).
///
/// y up, θ the inclination of the path and the control, N = g cos θ:
///
///     x' = v cos θ,  y' = v sin θ,  v' = f(θ) = −g sin θ + K(N),  K(N) = −μN + βN³,  H = −1 + λx x' + λy y' + λv v' ≡ 0.
///
/// Start (0, 0) at the speed v₀; end (a, b) at any speed, λv(t_f) = 0. Friction is hard for β < 0, soft for β > 0. Where the
/// path overhangs, cos θ < 0, N is negative and K a thrust: the problem of [N] admits it.
///
/// With ℓ = |(λx, λy)| = 1/v_f and θ₂ = θ(t_f), (λx, λy) = ℓ (cos θ₂, sin θ₂), H = 0 and H_θ = 0 give, without a division
/// that can vanish along an extremal, in terms of d(θ) = −f_θ and τ = θ₂ − θ,
///
///     q = d cos τ + f sin τ,  v = v_f d/q,  λv = sin τ/q,  Γ = d_θ sin τ + d cos τ,  θ' = q²/(v_f Γ),  −H_θθ = Γ/q > 0:
///
/// an extremal turns monotonically, and t, x and y are quadratures over θ. Friction linear in N does the work −μ g dx:
/// gravity, tilted. Then d, f and with them the motion are those of a cycloid (TiltedCycloid), q is constant, and nothing is
/// integrated.
#pragma once

#include <costate/implicit.hpp>
#include <costate/pontryagin.hpp>
#include <costate/problem.hpp>

#include <numbers>
#include <optional>
#include <vector>

namespace costate::normal_friction {

/// A scene, in SI units. The defaults are a case of [N], Table 1.
struct Scene {
  double x = 3.0;        ///< end point a > 0, m
  double y = -9.0;       ///< end point b, m
  double speed = 35.0;   ///< v₀ > 0, m/s
  double mu = 5.0;       ///< μ ≥ 0, 1
  double beta = -0.02;   ///< β, s⁴/m²
  double gravity = 9.8;  ///< g, m/s²
};

/// The bead: q = (x, y, v), u = θ, p = (μ, β, g).
struct Bead {
  static constexpr int states = 3, cyclic = 2, controls = 1, parameters = 3;
  template <class S>
  Vec<S, 3> dynamics(const Vec<S, 3>& q, const Vec<S, 1>& u, const Vec<S, 3>& p) const {
    const S& v = q[2];
    const auto& [mu, beta, gravity] = p;
    const S cosine = cos(u[0]), sine = sin(u[0]);
    const S N = gravity * cosine;
    return {v * cosine, v * sine, N * (beta * N * N - mu) - gravity * sine};
  }
};

/// The slope that maximises H over the whole circle, where H + 1 = α cos θ + σ sin θ + κ cos³θ with α = v λx − λv μ g, σ = v
/// λy − λv g, κ = λv β g³ has at most three maxima: each is bracketed by a change of sign of H_θ on a grid and refined, the
/// highest taken.
struct BestSlope {
  template <class S>
  Vec<S, 1> control(const Vec<S, 3>& q, const Vec<S, 3>& costate, const Vec<S, 3>& p) const {
    const auto& [lambda_x, lambda_y, lambda_v] = costate;
    const auto& [mu, beta, gravity] = p;
    const Vec<S, 3> c{q[2] * lambda_x - lambda_v * mu * gravity, q[2] * lambda_y - lambda_v * gravity,
                      lambda_v * beta * gravity * gravity * gravity};
    const Bracket best = highest(primal(c));
    return {implicit_root(Slope{}, c, best.lower, best.upper)};
  }

  /// The maximiser of α cos θ + σ sin θ + κ cos³θ.
  static double of(const Vec<double, 3>& c) {
    const Bracket best = highest(c);
    return guarded_root(Slope{}, c, best.lower, best.upper);
  }

  /// The highest local maximum but the one at θ, if there is another.
  static std::optional<double> other(const Vec<double, 3>& c, double theta);

 private:
  struct Bracket {
    double lower, upper;
  };
  static std::vector<Bracket> maxima(const Vec<double, 3>& c);
  static Bracket highest(const Vec<double, 3>& c);

  /// H_θ.
  struct Slope {
    template <class S>
    S operator()(const S& theta, const Vec<S, 3>& c) const {
      const S cosine = cos(theta), sine = sin(theta);
      return c[1] * cosine - sine * (c[0] + 3.0 * c[2] * cosine * cosine);
    }
  };
};

/// The acceleration along the path, f(θ) = x cos θ + y sin θ + cubic cos³θ: x = −μ g, y = −g, cubic = β g³.
template <class S>
struct Push {
  S x{}, y{}, cubic{};
};

/// What an extremal is at the slope θ, given θ₂ and τ = θ₂ − θ; names as at the top. In q and Γ the linear part of f is
/// constant, l = x sin θ₂ − y cos θ₂; it is taken out, since both may be far smaller than the terms they are defined by:
///
///     q = l + cubic (3 cos²θ₂ sin θ₂ − sin τ (cos(2θ₂ + θ) + cos τ cos(θ₂ + 2θ))),
///     Γ = l + 3 cubic cos θ ((cos²θ − 2 sin²θ) sin τ + cos θ sin θ cos τ).
template <class S>
struct SlopePoint {
  S theta, cosine, sine;
  S f, d;
  S q, gamma;
  S sine_left;  ///< sin τ

  SlopePoint(const Push<S>& push, const S& theta2, const S& left)
      : theta(theta2 - left), cosine(cos(theta)), sine(sin(theta)), sine_left(sin(left)) {
    const S cosine_left = cos(left), end_cosine = cos(theta2), end_sine = sin(theta2);
    const S c2 = cosine * cosine;
    f = cosine * (push.x + push.cubic * c2) + push.y * sine;
    d = sine * (push.x + 3.0 * push.cubic * c2) - push.y * cosine;
    const S linear = push.x * end_sine - push.y * end_cosine;
    q = linear + push.cubic * (3.0 * end_cosine * end_cosine * end_sine -
                               sine_left * (cos(theta2 + theta2 + theta) + cosine_left * cos(theta2 + theta + theta)));
    gamma = linear + 3.0 * push.cubic * cosine * ((c2 - 2.0 * sine * sine) * sine_left + cosine * sine * cosine_left);
  }
  /// λv.
  [[nodiscard]] S lambda_v() const { return sine_left / q; }
  /// v / v_f.
  [[nodiscard]] S speed_ratio() const { return d / q; }
  /// dt/dθ / v_f.
  [[nodiscard]] S slowness() const { return gamma / (q * q); }
  /// α, σ and κ of H + 1 as a function of the slope here, see BestSlope.
  [[nodiscard]] Vec<S, 3> hamiltonian(const Push<S>& push, const S& theta2) const {
    const S ratio = speed_ratio(), lambda = lambda_v();
    return {ratio * cos(theta2) + lambda * push.x, ratio * sin(theta2) + lambda * push.y, lambda * push.cubic};
  }
};

/// An arc as it is integrated, over σ ∈ [0, 1], τ = τ₁ + Δ (1 − σ): no state, w = (t, x, y, ∫ cos³θ ds),
/// p = (θ₂, τ₁, Δ, v_f, push x, push y, push cubic). The turn Δ is positive where the path curves to the left; τ₁ is left to
/// turn at the arc's end.
struct SlopeArc {
  static constexpr int states = 0, parameters = 7, quadratures = 4;
  template <class S>
  Rates<S, 0, 4> rates(const S& sigma, const Vec<S, 0>&, const Vec<S, 7>& p) const {
    const auto& [theta2, left, turn, end_speed, push_x, push_y, cubic] = p;
    const SlopePoint<S> at(Push<S>{push_x, push_y, cubic}, theta2, left + turn * (1.0 - sigma));
    const S time = turn * end_speed * at.slowness();
    const S length = time * end_speed * at.speed_ratio();
    return {{}, {time, length * at.cosine, length * at.sine, length * at.cosine * at.cosine * at.cosine}};
  }
};

/// Parameters of the problem, by place.
enum ScenePlace : std::size_t { x_place, y_place, speed_place, mu_place, beta_place, gravity_place, nonlinearity_place };

/// θ grows to the left, falls to the right.
enum class Side { left = 1, right = -1 };

/// An arc of an extremal: to which side it curves, and to which side the slope has jumped at the corner before it, if any.
struct ArcShape {
  Side turn = Side::left;
  Side jump = Side::left;
  bool operator==(const ArcShape&) const = default;
};
using Structure = std::vector<ArcShape>;

/// An arc with its size: |Δ|, and how far the slope has jumped at the corner before it, rad.
struct ArcSpan {
  ArcShape shape;
  double turn = 0.0, jump = 0.0;
};

/// An extremal but for its scale: the slope at its end, and its arcs in order of time.
struct Chain {
  double theta2 = 0.0;
  std::vector<ArcSpan> arcs;
  [[nodiscard]] Structure structure() const;
};

/// The shooting problem of a scene for a given structure: one arc, or several with corners between. Unknowns: theta2,
/// log_turn = ln |Δ| of the last arc, then for each corner from the last to the first its jump and log_turn of the arc
/// before it; the first arc, which may vanish at the start, has its turn itself. Rows: the end across the linear part (px, py) of f, in units of the chord; the energy v_f² − v₀² = 2 (px a +
/// py b + cubic ∫ cos³θ ds), which stands for the end along it and knows v_f to all digits where it is small; at each corner
/// that v and λv are continuous, in a form that is regular where the jump vanishes. Guards: the jump at every corner and the turn of the first
/// of several arcs; the least −H_θθ of every arc; and by how much H at the start is higher than at its other local maximum, over the
/// turn of the first of several arcs, with which it vanishes. (Inside, away from the corners, only path checks compare H with its other
/// maxima.) Reports: final_time, lambda_x,
/// lambda_y, lambda_v0, theta1, theta2, v_f; t1, t2, … of the corners.
///
/// Friction that is not linear can make H have two maxima. Where an arc in one piece would pass a stretch with Γ/q < 0, the
/// law jumps from one maximum to the other when they are equal: a corner of the path, with λ, v and H continuous
/// (Weierstrass–Erdmann).
///
/// The parameter `nonlinearity` (1 in the scene) draws a straight path from a problem in closed form: at 0, f(θ) is replaced
/// by the x cos θ + y sin θ that agrees with it, in value and slope, at the inclination of the chord.
[[nodiscard]] std::shared_ptr<const Problem> make_problem(const Scene& scene, const Structure& structure = {{}});

/// The unknowns of a problem with the structure of a chain, and what unknowns of a problem of this model say of its arcs. \throws BadInput for
/// a problem of another model, or a vector of another size.
[[nodiscard]] Eigen::VectorXd unknowns(const Chain& chain);
[[nodiscard]] Chain chain_of(const Problem& problem, const Eigen::VectorXd& y);

/// The part of its turn that is left on an arc, τ = left + turn · part, where −H_θθ = Γ/q is least: in [0, 1].
[[nodiscard]] double weakest_part(const Push<double>& push, double theta2, double left, double turn);

/// Names of the guards; arcs and corners are counted from 0 and 1, as reports are.
[[nodiscard]] std::string jump_at_corner(std::size_t i);
[[nodiscard]] std::string curvature_of_arc(std::size_t i);
inline constexpr const char* turn_of_first_arc = "turn of arc 1";
inline constexpr const char* lead_at_start = "H at the start less its other maximum";

/// Parameter values of a scene, as the problem orders them.
[[nodiscard]] std::vector<double> parameters(const Scene& scene, double nonlinearity = 1.0);

/// f(θ) at the given nonlinearity, see make_problem.
[[nodiscard]] Push<double> push_of(const Scene& scene, double nonlinearity = 1.0);

}  // namespace costate::normal_friction
