/// \file
/// A bead on a wire with friction that depends on the normal force, the curvature's part included, brought to a point in minimum
/// time (Negrón-Marrero & Santiago-Figueroa 2005, §2.2, here [N]).
///
/// States: place x, y (up); speed v; inclination θ. Control: turning rate u = θ'. Normal force per unit mass h = g cos θ + v u ≥ 0:
///
///     x' = v cos θ,  y' = v sin θ,  v' = −g sin θ + K(h),  θ' = u,  K(h) = −μh + βh³,  β < 0.
///
/// H = −1 + λ·f is maximised; H_u = λv v K'(h) + λθ = 0 while h > 0 (contact arc), h = 0 while λθ ≤ μ λv v (ballistic arc: the bead
/// leaves the wire). λv(t_f) = λθ(t_f) = 0. H is concave in h iff 6βhλv v² ≤ 0 (Legendre–Clebsch): for β > 0 there is no minimum.
/// The closure (46)–(47) of [N] is not that of the optimum: h(0) is free, and the end point, where H_u = 0 degenerates, is regular
/// instead, K'(h_f) = v_f (λx sin θ_f − λy cos θ_f).
///
/// With time in units of v/g, dt = (v/g) dτ, and η = h/g, k = K/g, n = g λv/v, the motion has no scale of its own:
///
///     θ_τ = η − cos θ,  (ln v)_τ = k − sin θ,  k(η) = −μη + β̂η³,  β̂ = β g²,
///
/// so every extremal is one of v_f = 1, g = 1, scaled. All fields here are in those units: lengths v_f²/g, times v_f/g.
#pragma once

#include <costate/pontryagin.hpp>
#include <costate/problem.hpp>

#include <optional>

namespace costate::curvature {

/// A scene, in SI units.
struct Scene {
  double x = 4.0;                      ///< end point a, m
  double y = -2.5;                     ///< end point b, m, up
  double speed = 2.0;                  ///< v₀, m/s
  std::optional<double> slope = -1.0;  ///< θ(0), rad; none: free
  double mu = 0.2;                     ///< μ
  double beta = -1e-3;                 ///< β, s⁴/m²
  double gravity = 9.8;                ///< g, m/s²
};

/// The bead: parameters μ, β, g; control u = θ'.
struct Bead {
  static constexpr int states = 4, cyclic = 2, controls = 1, parameters = 3;
  template <class S>
  static S normal_force(const Vec<S, 4>& q, const Vec<S, 1>& u, const Vec<S, 3>& p) {
    return p[2] * cos(q[3]) + q[2] * u[0];
  }
  template <class S>
  Vec<S, 4> dynamics(const Vec<S, 4>& q, const Vec<S, 1>& u, const Vec<S, 3>& p) const {
    const auto& [x, y, v, theta] = q;
    const auto& [mu, beta, gravity] = p;
    const S h = normal_force(q, u, p);
    return {v * cos(theta), v * sin(theta), beta * h * h * h - mu * h - gravity * sin(theta), u[0]};
  }
};

/// H_u = 0: 3|β|h² = λθ/(λv v) − μ.
struct Contact {
  template <class S>
  Vec<S, 1> control(const Vec<S, 4>& q, const Vec<S, 4>& costate, const Vec<S, 3>& p) const {
    const S h = sqrt((p[0] - costate[3] / (costate[2] * q[2])) / (3.0 * p[1]));
    return {(h - p[2] * cos(q[3])) / q[2]};
  }
};

/// Free flight, h = 0.
struct Ballistic {
  template <class S>
  Vec<S, 1> control(const Vec<S, 4>& q, const Vec<S, 4>&, const Vec<S, 3>& p) const {
    return {-(p[2] * cos(q[3]) / q[2])};
  }
  template <class S>
  S constraint(const Vec<S, 4>& q, const Vec<S, 1>& u, const Vec<S, 3>& p) const {
    return Bead::normal_force(q, u, p);
  }
};

/// The contact arc as it is integrated: z = (ln v, θ, η, n), p = (λx, λy, μ, β̂), w = (x, y, t), in the variable ω with dt = v η dω.
///
/// With B = λx cos θ + λy sin θ, λθ = −n v² k'(η), and H_u = 0 differentiated once:
///
///     n_τ = −B − n (k' θ_τ − sin θ + k),   6β̂ η η_τ = (B_θ + B k')/n + k'² θ_τ − k k' − cos θ.
///
/// Where the arc meets a ballistic one η → 0 like a square root of time; in ω, dτ = η dω, everything is analytic there.
/// n → 0 at the end of the motion, where the first term is 0/0: there EndSeries takes over.
struct ContactArc {
  static constexpr int states = 4, parameters = 4, quadratures = 3;
  template <class S>
  Rates<S, 4, 3> rates(const S&, const Vec<S, 4>& z, const Vec<S, 4>& p) const {
    const auto& [log_v, theta, eta, n] = z;
    const auto& [lambda_x, lambda_y, mu, beta] = p;
    const S cosine = cos(theta), sine = sin(theta), v = exp(log_v);
    const S B = lambda_x * cosine + lambda_y * sine, B_theta = lambda_y * cosine - lambda_x * sine;
    const S quadratic = beta * eta * eta;
    const S k = eta * (quadratic - mu), slope = 3.0 * quadratic - mu, turn = eta - cosine;
    return {{eta * (k - sine), eta * turn, ((B_theta + B * slope) / n + slope * (slope * turn - k) - cosine) / (6.0 * beta),
             -(eta * (B + n * (slope * turn - sine + k)))},
            {eta * v * v * cosine, eta * v * v * sine, eta * v}};
  }
};

/// The ballistic arc: a parabola. p = (v cos θ, v sin θ, θ) where t = 0, at one of its ends, then λx, λy and the costates of the two
/// velocities there, which are linear in t; w = (x, y, t).
struct BallisticArc {
  static constexpr int states = 0, parameters = 7, quadratures = 3;
  template <class S>
  Rates<S, 0, 3> rates(const S& t, const Vec<S, 0>&, const Vec<S, 7>& p) const {
    return {{}, {p[0], p[1] - t, S(1.0)}};
  }
};

/// Order of the power series with which a contact arc ends.
inline constexpr int end_order = 14;
/// The last piece of a contact arc that ends the motion: a power series in s = ω_f − ω of (x, y, t, ln v, θ, η, n), differentiated.
/// p: coefficients 1 … end_order of the first, of the second, …; integrated in −s.
struct EndSeries {
  static constexpr int states = 0, parameters = 7 * end_order, quadratures = 7;
  template <class S>
  Rates<S, 0, 7> rates(const S& omega, const Vec<S, 0>&, const Vec<S, 7 * end_order>& p) const {
    Rates<S, 0, 7> r{};
    for (std::size_t i = 0; i < 7; ++i) {
      for (std::size_t j = end_order; j > 0; --j) {
        r.quadrature[i] = p[i * end_order + j - 1] * static_cast<double>(j) - r.quadrature[i] * omega;
      }
      r.quadrature[i] = -r.quadrature[i];
    }
    return r;
  }
};

enum class ArcKind { contact, ballistic };

/// A state inside a contact arc, at which it is cut in two for multiple shooting.
struct Node {
  double fraction;  ///< of the arc's length in ω, from its later end
  double theta, eta, n;
};

/// One arc of a structure, and an estimate of it.
struct ArcPlan {
  ArcKind kind = ArcKind::contact;
  double length = 1.0;        ///< in ω (contact) or t (ballistic)
  std::vector<Node> nodes{};  ///< of a contact arc, the latest first
};

/// The arcs of a motion in order of time, and an estimate of its end.
struct Plan {
  std::vector<ArcPlan> arcs;
  double theta_start = 0.0;      ///< θ(0), an unknown where it is free and the first arc is ballistic
  double theta_end = 0.0;        ///< θ_f
  double eta_end = 1.0;          ///< η_f, if the last arc is a contact arc
  double slope_end = 0.0;        ///< B_θ/B at t_f, if it is ballistic
  double log_speed_ratio = 0.0;  ///< ln(v_f/v₀)
};

/// Parameters of the problem, by place. `slope` is present only where θ(0) is given.
enum ScenePlace : std::size_t { x_place, y_place, speed_place, mu_place, beta_place, gravity_place, slope_place };

/// The shooting problem of a scene for the structure of a plan.
///
/// The chain is integrated backward from the end, where H = 0 and λv = λθ = 0 give B = 1/v_f, and regularity B_θ = −K'(η_f) B:
/// there backward integration damps what it would amplify forward. Unknowns: θ_f; η_f (contact) or B_θ/B (ballistic); ln(v_f/v₀);
/// the lengths of the arcs; θ(0), if it is free and the first arc ballistic; and the states (θ, η, n) at the nodes, with rows of
/// continuity. Speed and place at the nodes are no unknowns: the motion has no scale of its own, so each segment is scaled by where
/// the chain has come. The ratio of speeds is one all the same: the end of the motion then makes its length, and what happened before
/// in a small scale enters through a logarithm. A first ballistic arc is computed from the start, and the chain must meet it in
/// ln v and θ; else these rows are set at the start (a contact arc first with a free slope, which is so without friction, has
/// η(0) = 0). Further rows: the end point; λθ(0) = 0 where the slope is free; at each junction h = 0, or λθ = μ λv v if the ballistic
/// arc is the later one.
///
/// Reports: t1, t2, … (junctions), final_time, lambda_x, lambda_y, lambda_v0, lambda_theta0, h0, theta1, theta2, v_f.
/// \throws BadInput if the structure cannot be (empty, or two neighbouring arcs of one kind).
[[nodiscard]] std::shared_ptr<const Problem> make_problem(const Scene& scene, const Plan& plan);

/// The unknowns that a plan estimates, in the order of the scene's problem.
[[nodiscard]] Eigen::VectorXd unknowns(const Scene& scene, const Plan& plan);

/// The inverse: what a vector of unknowns of a problem of this model says of its arcs. Estimates that are no unknowns keep their
/// defaults. \throws BadInput for a problem of another model, or a vector of another size.
[[nodiscard]] Plan plan_of(const Problem& problem, const Eigen::VectorXd& y);

/// Names of the guards (see Guard), in units of v_f and g: h/g at the ends of a motion in contact there (at the start by the length of the
/// arc, if another follows); in flight (μ λv v − λθ)/(duration) at the start and μ − λθ/(λv v) at the end; and the length of every
/// arc, counted from 0.
inline constexpr const char* start_force = "normal force at the start";
inline constexpr const char* start_switching = "mu lambda_v v - lambda_theta at the start";
inline constexpr const char* end_force = "normal force at the end";
inline constexpr const char* end_switching = "mu - lambda_theta/(lambda_v v) at the end";
[[nodiscard]] std::string length_of_arc(std::size_t i);

/// Parameter values of a scene, as the problem orders them.
[[nodiscard]] std::vector<double> parameters(const Scene& scene);

}  // namespace costate::curvature
