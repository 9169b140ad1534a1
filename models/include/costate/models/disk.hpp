/// \file
/// The rolling disk: a homogeneous disk that rolls on a plane without slipping, kept upright, brought from one direction and
/// place to another in minimum time by forces that do no work (Obradović, Šalinić & Radulović, Theor. Appl. Mech. 44 (2017)
/// 237–254, here [O]).
///
/// States: contact point x, y; heading φ; speed V along the heading; turning rate Ω = φ'. The kinetic energy is constant,
/// V² + r²Ω²/6 = c₁². The friction that rolling needs is V'² + V²Ω² ≤ (k g)² per unit mass, [O] (4.1).
///
/// Everything depends on x/L, y/L, φ and κ = k g L/c₁² only, with L = r/√6 and time T = L/c₁. All fields here are in those
/// units: V² + Ω² = 1, and H = −1 + λ·f is maximised.
#pragma once

#include <costate/pontryagin.hpp>
#include <costate/problem.hpp>

#include <numbers>
#include <optional>

namespace costate::disk {

/// A scene, in SI units. The defaults are the case of [O].
struct Scene {
  double x = 1.0;                                 ///< end point x_f, m
  double y = 1.0;                                 ///< end point y_f, m
  double heading = std::numbers::pi / 2;          ///< end heading φ_f, rad, counted through every turn; > 0 left, < 0 right
  double radius = 2.449489742783178;              ///< r, m; √6 in [O], so that L = 1
  double speed = 1.0;                             ///< c₁, m/s: the speed of a disk that goes straight
  double gravity = 9.80665;                       ///< g, m/s²
  std::optional<double> friction = std::nullopt;  ///< coefficient k_f; none: unlimited
};

/// Free disk: the friction limit does not bind, so the pair (V, Ω) on the unit circle is the control.
struct FreeRolling {
  static constexpr int states = 3, cyclic = 2, controls = 2, parameters = 0;
  template <class S>
  Vec<S, 3> dynamics(const Vec<S, 3>& q, const Vec<S, 2>& u, const Vec<S, 0>&) const {
    const auto& [x, y, phi] = q;
    const auto& [V, Omega] = u;
    return {V * cos(phi), V * sin(phi), Omega};
  }
};

/// The speeds that maximise H: (V, Ω) along (A, λφ), A = λx cos φ + λy sin φ, [O] (3.20).
struct FastestRolling {
  template <class S>
  Vec<S, 2> control(const Vec<S, 3>& q, const Vec<S, 3>& costate, const Vec<S, 0>&) const {
    const auto& [lambda_x, lambda_y, lambda_phi] = costate;
    const S A = lambda_x * cos(q[2]) + lambda_y * sin(q[2]);
    const S norm = sqrt(A * A + lambda_phi * lambda_phi);
    return {A / norm, lambda_phi / norm};
  }
};

/// Disk whose speed V is a state and V' the control; parameter κ. With LimitingFriction this states the saturated arc as
/// Pontryagin's principle gives it; what is integrated is SaturatedArc, the same flow in a form without roots, and the tests hold
/// one against the other.
struct LimitedRolling {
  static constexpr int states = 4, cyclic = 2, controls = 1, parameters = 1;
  template <class S>
  Vec<S, 4> dynamics(const Vec<S, 4>& q, const Vec<S, 1>& u, const Vec<S, 1>&) const {
    const auto& [x, y, phi, V] = q;
    return {V * cos(phi), V * sin(phi), sqrt(1.0 - V * V), u[0]};
  }
};

/// Friction at its limit: V' = ±√(κ² − V²Ω²), [O] (4.10).
struct LimitingFriction {
  double sign = 1.0;
  template <class S>
  Vec<S, 1> control(const Vec<S, 4>& q, const Vec<S, 4>&, const Vec<S, 1>& p) const {
    const S V2 = q[3] * q[3];
    return {sign * sqrt(p[0] * p[0] - V2 * (1.0 - V2))};
  }
  /// V'² + V²Ω² − κ² = 0 along the arc.
  template <class S>
  S constraint(const Vec<S, 4>& q, const Vec<S, 1>& u, const Vec<S, 1>& p) const {
    const S V2 = q[3] * q[3];
    return u[0] * u[0] + V2 * (1.0 - V2) - p[0] * p[0];
  }
};

/// The free arc as it is integrated: z = (φ, λφ), p = (λx, λy), w = (x, y). A pendulum in 2φ.
///
/// H = −1 + √(A² + λφ²) vanishes, so (V, Ω) = (A, λφ), and with A_φ = λy cos φ − λx sin φ
///
///     φ' = λφ,   λφ' = −A A_φ,   x' = A cos φ,   y' = A sin φ:
///
/// the flow of FreeRolling under FastestRolling in a form without roots, on H = 0, where the tests hold one against the other. Like
/// there H is a constant of the motion: ½(A² + λφ²)' = A A_φ λφ − λφ A A_φ.
struct FreeArc {
  static constexpr int states = 2, parameters = 2, quadratures = 2;
  template <class S>
  Rates<S, 2, 2> rates(const S&, const Vec<S, 2>& z, const Vec<S, 2>& p) const {
    const auto& [phi, lambda_phi] = z;
    const auto& [lambda_x, lambda_y] = p;
    const S cosine = cos(phi), sine = sin(phi);
    const S A = lambda_x * cosine + lambda_y * sine;
    return {{lambda_phi, A * (lambda_x * sine - lambda_y * cosine)}, {A * cosine, A * sine}};
  }
};

/// The saturated arc as it is integrated: z = (φ, ν, V', λφ) with V = V₁ + ℓν, p = (λx, λy, V₁, ℓ, τ), w = (x, y, q₁, q₂);
/// Ω = τ√(1 − V²), τ = ±1.
///
/// The constraint, differentiated once, is Duffing's equation V'' = 2V³ − V; unlike V' = ±√(κ² − V²Ω²) it passes through a turning
/// point of V. S = λ_V V' = 1 − A V − λφ Ω obeys S' = −V' G with G = H_V at λ_V = 0, G = A − λφ V/Ω, and
///
///     G' = A_φ/Ω − λφ V'/Ω³,   q₁ = ∫G'/ℓ dt,   q₂ = ∫G' ν/ℓ dt,   S = S₁ − ℓ ν G₁ − ℓ²(ν q₁ − q₂).
///
/// On a short arc S is of the order of the duration squared while its terms are of order one. With ℓ the duration, ν, q₁ and
/// q₂ are of order one too, so S/ℓ² keeps its digits however short the arc.
struct SaturatedArc {
  static constexpr int states = 4, parameters = 5, quadratures = 4;
  template <class S>
  Rates<S, 4, 4> rates(const S&, const Vec<S, 4>& z, const Vec<S, 5>& p) const {
    const auto& [phi, nu, acceleration, lambda_phi] = z;
    const auto& [lambda_x, lambda_y, V1, scale, turn] = p;
    const S V = V1 + scale * nu;
    const S Omega = turn * sqrt(1.0 - V * V);
    const S cosine = cos(phi), sine = sin(phi);
    const S A_phi = lambda_y * cosine - lambda_x * sine;
    const S G_rate = (A_phi - lambda_phi * acceleration / (Omega * Omega)) / (Omega * scale);
    return {{Omega, acceleration / scale, V * (2.0 * V * V - 1.0), -V * A_phi}, {V * cosine, V * sine, G_rate, G_rate * nu}};
  }
};

/// The boundary arc: V² = V±² = ½(1 ± √(1 − 4κ²)) is constant; z = φ, p = (V, τ), Ω = τ√(1 − V²), w = (x, y).
struct BoundaryArc {
  static constexpr int states = 1, parameters = 2, quadratures = 2;
  template <class S>
  Rates<S, 1, 2> rates(const S&, const Vec<S, 1>& z, const Vec<S, 2>& p) const {
    const auto& [V, turn] = p;
    return {{turn * sqrt(1.0 - V * V)}, {V * cos(z[0]), V * sin(z[0])}};
  }
};

enum class ArcKind { free, saturated, boundary };

/// One arc of a structure. A free arc finds its own signs.
struct ArcType {
  ArcKind kind = ArcKind::free;
  double sign = 0.0;    ///< saturated: of V'; boundary: which of V±
  double turn = 1.0;    ///< saturated, boundary: of Ω
  double course = 1.0;  ///< boundary: of V
  bool operator==(const ArcType&) const = default;
};
using Structure = std::vector<ArcType>;

/// "F" free, "C" saturated, "B" boundary, in order of time.
[[nodiscard]] std::string letters(const Structure& structure);

/// Why the arcs of a structure cannot be as they are; empty if they can: signs are 1 or −1, one of two neighbours is
/// saturated, two saturated ones differ in the sign of V', two that are not free turn the same way, V' leads to and from
/// V±, and all boundary arcs are on the same side of the speeds that the limit forbids.
[[nodiscard]] std::string objection_to(const Structure& structure);

/// Parameters of the problem, by place. `friction` is present only in scenes with a coefficient.
enum ScenePlace : std::size_t { x_place, y_place, heading_place, radius_place, speed_place, gravity_place, friction_place };

/// The shooting problem of a scene for a given structure.
///
/// Arcs are integrated outward from an anchor: the first free arc if there is one (its start φ₁ is an unknown unless the
/// problem starts there), else the first boundary arc, else the switch between the first two saturated arcs, or the start of the
/// only one. Started in the middle the system stays well conditioned where the forward one of [O] (4.33)–(4.38) does not.
/// Unknowns: φ₁, λx, λy, what the anchor needs besides, and the durations; in units of L, T and c₁. On a saturated arc the
/// anchor has V and V' as unknowns, and the friction limit as a row, which is smooth where V' vanishes.
///
/// A saturated arc that starts from the anchor has S = λ_V V' = 0 there, and must have it at its far end. That row is divided
/// by the square of the duration (by the duration, if the arc began at a switch of V' or at the end of the motion), which removes
/// the root of vanishing duration that the equations of [O] have for every k_f.
///
/// Reports: final_time, t1, t2, …, lambda_x, lambda_y, lambda_phi0, V0, Omega0. Guards: see GuardPlace.
/// One arc at the limit, or a saturated and a boundary one, have paths with fewer degrees of freedom than the end has
/// conditions: their Jacobians are singular, and they hold for one value of the friction coefficient at most.
/// \throws BadInput if the structure cannot be (see objection_to) or has arcs at a limit that the scene does not have.
[[nodiscard]] std::shared_ptr<const Problem> make_problem(const Scene& scene, const Structure& structure);

/// Parameter values of a scene, as the problem orders them.
[[nodiscard]] std::vector<double> parameters(const Scene& scene);

/// What must stay positive on an arc for the structure to be right. With κ the limit and G = A − λφ V/Ω, which drives
/// λ_V' = −G where λ_V = 0:
enum class GuardKind {
  duration,               ///< of any arc
  friction_at_start,      ///< (κ² − |λ|²Ω²)/κ² of a free arc that starts the motion
  friction_at_end,        ///< … that ends it
  friction_inside,        ///< (κ² − |λ|²)/κ² of a free arc on which A passes zero; 1 of another
  switching_at_start,     ///< −G sign V' of a saturated arc that starts the motion: λ_V leaves zero to the right side;
                          ///< over the duration squared if a free arc follows
  switching_at_end,       ///< G sign V' of one that ends it or ends in a switch
  acceleration_at_start,  ///< |V'| of a saturated arc that starts the motion
  acceleration_at_end,    ///< … that ends it or ends in a switch
  turning_at_start,       ///< Ω² of a saturated arc; τ Ω where it meets a free one, which may turn either way
  turning_at_end,
  multiplier_at_start,  ///< ∓G sign V of a boundary arc at V±: λ_V must not be driven across zero
  multiplier_at_end,
};
struct GuardPlace {
  GuardKind kind;
  std::size_t arc;
  bool operator==(const GuardPlace&) const = default;
};
/// The guards of a structure in the order in which the problem sets them, and the name of one. Without a friction limit
/// there are durations alone.
[[nodiscard]] std::vector<GuardPlace> guards_of(const Structure& structure, bool limited);
[[nodiscard]] std::string name_of(const GuardPlace& guard);

/// A point of an arc, in units of L and T, turned left.
struct ArcState {
  double phi = 0.0, V = 0.0, acceleration = 0.0, lambda_phi = 0.0;
};
/// An arc with its ends.
struct ArcSpan {
  ArcType type;
  double duration = 0.0;
  ArcState begin, end;
};
/// The arcs of a solution, or of a guess, in units of L and T, turned left.
struct Chain {
  double lambda_x = 0.0, lambda_y = 0.0;
  std::vector<ArcSpan> arcs;

  [[nodiscard]] Structure structure() const;
  /// A = λx cos φ + λy sin φ, and A_φ.
  [[nodiscard]] double along(double phi) const;
  [[nodiscard]] double across(double phi) const;
};
/// The chain of a shot. \throws BadInput if the problem is not one of make_problem's.
[[nodiscard]] Chain chain_of(const Problem& problem, const Shot& shot);
/// The unknowns of the chain's structure, in the order of its problem.
[[nodiscard]] Eigen::VectorXd unknowns(const Chain& chain);

}  // namespace costate::disk
