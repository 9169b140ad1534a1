/// \file
/// The brachistochrone with Coulomb friction: a bead slides from rest down a wire, friction μN, in minimum time.
///
/// y down, α the slope below the horizontal: x' = v cos α, y' = v sin α, v' = g sin α − μN/m, N/m = g cos α − v α' (the wire
/// bends up, α' ≤ 0, and pushes). The speed is linear in α', so α cannot be a state and α' a control; with z = v e^{−μα} the
/// rate α' is gone and the slope itself is the control (Ashby, Brittin, Love & Wyss, Am. J. Phys. 43 (1975) 902–906;
/// Kurilin, arXiv:2501.18622 (2025), here [K], whose curve is not this optimum):
///
///     x' = z e^{μα} cos α,   y' = z e^{μα} sin α,   z' = g (sin α − μ cos α) e^{−μα}.
///
/// H = −1 + λ·f is maximised over α ∈ [−π/2, π/2] and vanishes; λx, λy are constant, λz(t_f) = 0, and λv = λz e^{−μα} is the
/// costate of v. The bead starts straight down, α(0) = π/2, for every μ, with λv(0) = 1/g. A minimum exists iff μ < H/L.
///
/// **What is integrated.** Along the extremal, with tan α = μ + r cot φ, the angle φ runs from 0 to φ_F ∈ (0, π), and
/// everything is smooth in it, whatever the scene:
///
///     h² = sin²φ + (μ sin φ + r cos φ)²,   v = A h sin φ / r²,   cos α = sin φ / h,   sin α = (μ sin φ + r cos φ) / h,
///     G = 2h² − r² = r² + 4μr sin φ sin(φ_F − φ) / sin φ_F ≥ r²,
///     dt/dφ = A G/(g r³),   dx/dφ = A² G sin²φ/(g r⁵),   g (y − μx) = v²/2 + μ ∫ v² |dα|,   v² |dα|/dφ = A² sin²φ/r³,
///     r = μ cot φ_F + √(1 + μ²/sin²φ_F),   λx = (1 + μ² + r²)/(2A),   λy = r cot φ_F / A.
///
/// (From H = 0 and H_α = 0: cos α/v = P is quadratic in tan α, P ∝ (tan α − μ)² + r²; φ is the substitution that integrates
/// it. The last of the five integrals is the work of friction against gravity: all its terms are positive, so y − μx keeps
/// its digits as μ → H/L.) No state is left: the arc is three quadratures over s = φ/φ_F. As μ → 0, φ is the angle from
/// straight down, r = 1: the cycloid.
#pragma once

#include <costate/implicit.hpp>
#include <costate/pontryagin.hpp>
#include <costate/problem.hpp>

#include <numbers>

namespace costate::coulomb {

/// A scene, in SI units: from rest at (0, 0) to (L, H), y down. The defaults are a case of [K].
struct Scene {
  double drop = 5.0;      ///< H, m
  double span = 4.0;      ///< L > 0, m
  double gravity = 9.81;  ///< g, m/s²
  double friction = 0.3;  ///< coefficient μ ≥ 0
};

/// The coefficient from which on the scene has no solution: along any wire the bead arrives with v²/2 ≤ g (H − μL).
[[nodiscard]] inline double largest_friction(const Scene& scene) { return scene.drop / scene.span; }

/// States (x, y, z), control α, parameters (μ, g).
struct SlidingBead {
  static constexpr int states = 3, cyclic = 2, controls = 1, parameters = 2;
  template <class S>
  Vec<S, 3> dynamics(const Vec<S, 3>& q, const Vec<S, 1>& u, const Vec<S, 2>& p) const {
    const auto& [mu, g] = p;
    const S sine = sin(u[0]), cosine = cos(u[0]), growth = exp(mu * u[0]);
    const S v = q[2] * growth;
    return {v * cosine, v * sine, g * (sine - mu * cosine) / growth};
  }
};

/// The slope that maximises H. With β = π/2 − α and E = e^{2μα}, H_α = 0 reads
///     tan β = z E (λx − μλy) / (z E (λy + μλx) + g (1 + μ²) λz),
/// whose right-hand side falls as β grows where λx > μλy: one root within (0, π).
struct FastestSlope {
  template <class S>
  Vec<S, 1> control(const Vec<S, 3>& q, const Vec<S, 3>& costate, const Vec<S, 2>& p) const {
    const auto& [lambda_x, lambda_y, lambda_z] = costate;
    const auto& [mu, g] = p;
    const Vec<S, 4> c{q[2] * (lambda_x - mu * lambda_y), q[2] * (lambda_y + mu * lambda_x), g * (1.0 + mu * mu) * lambda_z, mu};
    return {std::numbers::pi / 2 - implicit_root(FromVertical{}, c, 0.0, std::numbers::pi)};
  }

 private:
  /// β less the angle that its tangent must have.
  struct FromVertical {
    template <class S>
    S operator()(const S& beta, const Vec<S, 4>& c) const {
      const auto& [along, down, still, mu] = c;
      const S E = exp(2.0 * mu * (std::numbers::pi / 2 - beta));
      return beta - atan2(E * along, E * down + still);
    }
  };
};

/// The arc as it is integrated, in s = φ/φ_F ∈ (0, 1): no state, p = (φ_F, κ) with κ = 2(μ/r) tan(φ_F/2), and w' = ((sin
/// φ/σ)² γ, (sin φ/σ)², γ) with σ = sin(φ_F/2), γ = (1 + κ sin φ sin(φ_F − φ)/σ²)/(1 + κ) ≤ 1: x, the work of friction and
/// the time, in units in which all are of order one for every scene.
struct SlidingArc {
  static constexpr int states = 0, parameters = 2, quadratures = 3;
  template <class S>
  Rates<S, 0, 3> rates(const S& s, const Vec<S, 0>&, const Vec<S, 2>& p) const {
    const auto& [turn, kappa] = p;
    const S sine = sin(turn * s), half = sin(0.5 * turn);
    const S G = (1.0 + kappa * sine * sin(turn * (1.0 - s)) / (half * half)) / (1.0 + kappa);
    const S square = sine * sine / (half * half);
    return {{}, {square * G, square, G}};
  }
};

/// Parameters of the problem, by place.
enum ScenePlace : std::size_t { drop_place, span_place, gravity_place, friction_place };

/// The shooting problem of a scene with H > μL > 0.
///
/// Unknowns: turn = ln(φ_F/(π − φ_F)) and scale = ln(A² φ_F σ² (1 + κ) / (g L r³)), the latter ln of x_f/L over its
/// quadrature. Rows: ln(x_f/L) and ln((y_f − μx_f)/(H − μL)). Both rows are nearly linear in the unknowns however far off
/// they are, so Newton's method converges from (0, 0) for every scene, and the condition of the Jacobian is bounded.
///
/// Reports: final_time, lambda_x, lambda_y, lambda_v0, alpha0, alphaF, end_speed.
/// \throws BadInput unless span and gravity are positive and 0 ≤ μ < H/L.
[[nodiscard]] std::shared_ptr<const Problem> make_problem(const Scene& scene);

/// Parameter values of a scene, as the problem orders them.
[[nodiscard]] std::vector<double> parameters(const Scene& scene);

}  // namespace costate::coulomb
