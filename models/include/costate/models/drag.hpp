/// \file
/// Bead with speed-dependent friction: from one point to another in minimum time on a wire through a resisting medium
/// (Negrón-Marrero & Santiago-Figueroa 2005, §3; here [N]).
///
/// y up, θ the inclination of the path, which is the control:
///
///     x' = v cos θ,   y' = v sin θ,   v' = −g sin θ + K(v),   K(v) = −μ v + β v³.
///
/// The start is (0, 0) at the speed v₀, the end (a, b) at any speed, so λv(t_f) = 0. H = −1 + λ·f is maximised and vanishes:
/// (cos θ, sin θ) is along (vλx, vλy − gλv). With the multipliers of [N]: λx = −c₂, λy = c₃, λv = λ v.
///
/// Friction is hard if β ≤ 0: K ≤ 0 at every speed. If β > 0 it is soft, and a thrust beyond v_c = √(μ/β): then K grows
/// faster than v², a bead that dives far enough gains any speed in finite time, and the infimum over all paths need not be
/// attained. What is computed is the fastest extremal without a focal point, a local minimum.
#pragma once

#include <costate/models/drag_orbits.hpp>
#include <costate/pontryagin.hpp>
#include <costate/problem.hpp>

namespace costate::drag {

/// A scene, in SI units. The defaults are a case of [N] (figure 3).
struct Scene {
  double x = 6.0;        ///< end point a, m; positive
  double y = -1.0;       ///< end point b, m, up
  double speed = 2.0;    ///< v₀, m/s
  double mu = 0.3;       ///< μ, 1/s
  double beta = 0.004;   ///< β, s/m²; negative: hard, positive: soft
  double gravity = 9.8;  ///< g, m/s²

  [[nodiscard]] Friction<double> friction() const { return {mu, beta}; }
};

/// The model: states x, y, v; control (cos θ, sin θ) on the unit circle; parameters μ, β, g.
struct Bead {
  static constexpr int states = 3, cyclic = 2, controls = 2, parameters = 3;
  template <class S>
  Vec<S, 3> dynamics(const Vec<S, 3>& q, const Vec<S, 2>& u, const Vec<S, 3>& p) const {
    const auto& [x, y, v] = q;
    const auto& [cosine, sine] = u;
    const auto& [mu, beta, g] = p;
    return {v * cosine, v * sine, Friction<S>{mu, beta}.force(v) - g * sine};
  }
};

/// The slope that maximises H: along (vλx, vλy − gλv), [N] (51).
struct FastestSlope {
  template <class S>
  Vec<S, 2> control(const Vec<S, 3>& q, const Vec<S, 3>& costate, const Vec<S, 3>& p) const {
    const auto& [lambda_x, lambda_y, lambda_v] = costate;
    const S along = q[2] * lambda_x, across = q[2] * lambda_y - p[2] * lambda_v;
    const S inverse = 1.0 / sqrt(along * along + across * across);
    return {along * inverse, across * inverse};
  }
};

/// The state–costate flow in time: z = (v, λv), p = (λx, λy, μ, β, g), w = (x, y). What is integrated is its reduction to
/// quadratures (drag_orbits.hpp); the tests hold one against the other.
using Flight = Pontryagin<Bead, FastestSlope>;

/// Units in which g = 1 and the end point is at the distance 1.
template <class S>
struct Scaled {
  S length, time, speed;  ///< of the units, in m, s and m/s
  S x, y, v0;
  Friction<S> friction;

  /// `get` gives the scene's parameters by their places.
  template <class Get>
  explicit Scaled(const Get& get);
};

/// Parameters of the problem, by place.
enum ScenePlace : std::size_t { x_place, y_place, speed_place, mu_place, beta_place, gravity_place };

template <class S>
template <class Get>
Scaled<S>::Scaled(const Get& get) {
  const S a = get(x_place), b = get(y_place);
  length = sqrt(a * a + b * b);
  time = sqrt(length / get(gravity_place));
  speed = length / time;
  x = a / length;
  y = b / length;
  v0 = get(speed_place) / speed;
  friction = {get(mu_place) * time, get(beta_place) * speed * speed * time};
}

/// Parameter values of a scene, as the problem orders them.
[[nodiscard]] std::vector<double> parameters(const Scene& scene);

enum class Family { turning, passing, monotone };

/// An extremal of a scene: its family and, in units of Scaled, the constants of its orbit and its final time. Of a turning
/// orbit the first constant is S at the start instead of v₁ = v₀√(1 + S²), which tells gain of speed from loss, and the
/// second asinh r.
struct Guess {
  Family family = Family::turning;
  double first = 0.0, second = 0.0;
  double final_time = 0.0;
};

/// How a path is cut into arcs. Each runs towards the place nearest to a steady motion, η = 0, from an end of the path: a
/// long way near the steady motion is so entered from where the integrand varies, and taken in a few growing steps.
enum class Arcs {
  from_start,  ///< one on side −1, from the start to the end, which is not or hardly beyond that place
  from_end,    ///< one on side +1, from the end to the start, which is not or hardly before it
  from_both,   ///< one on either side, meeting there
};

/// The arcs of the path from one place on an orbit to another (see variable() of the orbits).
template <class Orbit, class S>
Arcs arcs_between(const Orbit& orbit, const S& start, const S& end) {
  constexpr double hardly = 0.5;  // a shorter arc is not worth its overhead
  const double middle = primal(orbit.middle());
  if (middle - primal(orbit.variable(start, -1.0)) > -hardly) return Arcs::from_end;
  return primal(orbit.variable(end, 1.0)) - middle < hardly ? Arcs::from_start : Arcs::from_both;
}

/// The shooting problem of a scene for one family of orbits. Unknowns: the constants of the orbit and the final time. Rows:
/// x, y and t where the arcs from both ends meet. Everything else, H = 0, the speed v₀ at the start and λv = 0 at the end,
/// holds by construction.
///
/// Reports: final_time, lambda_x, lambda_y, lambda_v0, theta1, theta2, v_f.
[[nodiscard]] std::shared_ptr<const Problem> make_problem(const Scene& scene, const Guess& guess);

/// The family of a problem that make_problem made. \throws BadInput for another problem.
[[nodiscard]] Family family_of(const Problem& problem);
/// Its map, if it is that of a monotone orbit, and how its path is cut.
[[nodiscard]] SpeedMap map_of(const Problem& problem);
[[nodiscard]] Arcs arcs_of(const Problem& problem);

/// The unknowns of that problem at a guess.
[[nodiscard]] Eigen::VectorXd unknowns(const Guess& guess);

/// The height below which every point can be reached and above which none can, if friction resists at every speed up to v₀
/// (K ≤ 0):
///
///     y_max = ∫₀^{v₀} v dv / (g − K(v)),
///
/// the height of a vertical throw. For Φ(v) = ∫₀^v u du/(g − K) obeys (y + Φ)' = v K (1 − sin θ)/(g − K) ≤ 0 along any
/// motion, with equality on the vertical only, so y ≤ Φ(v₀) − Φ(v) < y_max wherever x > 0. Below it, a path that rises
/// steeply and then runs on nearly level at as low a speed as it takes loses as little as one likes. With soft friction the
/// bound holds for motions that never exceed v_c, which a throw from v₀ < v_c does not. SI units.
[[nodiscard]] double greatest_height(const Scene& scene);

}  // namespace costate::drag
