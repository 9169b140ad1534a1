/// \file
/// An optimal-control problem as it was stated, free of the system's type, and the shooting problem that follows from it.
///
/// Minimise J = Φ(q(0), q(T), T, p) + ∫ L dt subject to q' = f(q, u, p), fixed values of some states at the ends, end conditions
/// Ψⱼ(q(0), q(T), T, p) = 0, bounds of the controls and constraints. With H = −L + λ·f maximised over u, an extremal has
///
///     λᵢ(T) = −∂(Φ + σ·Ψ)/∂qᵢ(T)  where qᵢ(T) is not fixed,   λᵢ(0) = ∂(Φ + σ·Ψ)/∂qᵢ(0)  where qᵢ(0) is not fixed,
///     H(T) = ∂(Φ + σ·Ψ)/∂T        where T is free.
///
/// Rows at a junction at time t, for one control. The control of an arc is *held* where a bound or a constraint fixes it.
/// - between an interior arc and a held one: H_u = 0 with the held control (H is continuous there too, but to second order);
/// - between two held controls: (H(u⁻) − H(u⁺))/(u⁻ − u⁺) = 0, but u⁻ = u⁺ where one and the same side is held by a bound and a mixed
///   constraint, or two of these, in turn;
/// - a singular arc begins: H_u = 0 and d/dt H_u = 0; it ends where the arc after it begins, without a row;
/// - an arc along a state constraint of order r begins: c = … = c^(r−1) = 0, and H_u(λ⁻) = 0 with the control of the boundary
///   unless the arc before is singular; λ⁺ = λ⁻ + Σ πᵢ ∂c^(i)/∂q with the multipliers πᵢ ≥ 0 as unknowns (indirect adjoining; that the sign
///   is + and π ≥ 0 follows from c ≤ 0 and the maximum of H); it ends: H_u = 0, so that the multiplier of the constraint vanishes;
/// - a constraint is touched: c = 0 and c' = 0 (order 2) or H continuous (order 1), λ⁺ = λ⁻ + π ∂c/∂q.
/// For several controls: H is continuous.
///
/// Checked along the solution, relative to the terms that cancel: H is constant; H_u has its sign at a bound and vanishes between the bounds;
/// H is not larger at the bounds or between them than at the control; Legendre–Clebsch and Kelley; the multiplier μ of a constraint's arc
/// is ≥ 0. Along a state constraint of order r also the multiplier of the constraint itself, η = (−1)^r d^r μ/dt^r ≥ 0, and for r = 2 its part
/// at the entry, π₀ + dμ/dt ≥ 0, and μ(T) = 0 where the trajectory ends on the constraint and nothing else holds the state there. (For r = 1
/// μ(T) ≥ 0 is the part of the multiplier at T itself.)
///
/// Reference: Bryson, Denham & Dreyfus, AIAA J. 1 (1963) 2544–2550; Hartl, Sethi & Vickson, SIAM Review 37 (1995) 181–218, §5;
/// Bryson & Ho, Applied Optimal Control, 1975, ch. 2–3 and §8.
#pragma once

#include <costate/ends.hpp>
#include <costate/extremal_arc.hpp>
#include <costate/problem.hpp>
#include <costate/smooth_map.hpp>

#include <optional>
#include <span>

namespace costate {

/// A state variable.
struct State {
  std::optional<double> start{};    ///< fixed value at t = 0; none: free
  std::optional<double> end{};      ///< fixed value at T; none: free
  double scale = 1.0;               ///< a typical magnitude
  std::optional<double> guess{};    ///< of a free value
  std::optional<double> costate{};  ///< guess of λ(0); without any, costates are estimated from the guessed motion
  double costate_scale = 0.0;  ///< a typical magnitude of λ; 0: ten over that of the state, or the guess if it is larger
  std::string unit = "1";
};

/// A control variable.
struct Control {
  std::optional<double> lower{}, upper{};
  std::optional<double> guess{};  ///< where the search for an interior maximum starts; none: between the bounds
  double scale = 0.0;             ///< a typical magnitude; 0: half the distance of the bounds, or 1
  std::string unit = "1";
};

/// What is known beforehand of an arc.
struct Arc {
  double duration = 0.0;              ///< guess; 0: an equal share of the time left
  std::vector<double> multipliers{};  ///< guesses of π₀, π₁ at the entry of a boundary arc; 0 where none
};

/// A user's row at a junction: of x = (q, λ, p) before it and the controls before and after.
using JunctionRow =
    std::function<Jet(const std::vector<Jet>& x, const std::vector<Jet>& before, const std::vector<Jet>& after)>;

/// f and L at a point, with their derivatives.
struct Linearisation {
  Eigen::VectorXd f;               ///< (n)
  Eigen::MatrixXd f_q, f_u;        ///< (n × n), (n × k)
  double cost = 0.0;               ///< L
  Eigen::VectorXd cost_q, cost_u;  ///< (n), (k)
};

struct ExtremalStatement {
  struct Constraint {
    std::string name;
    std::shared_ptr<const StateConstraint> constraint;
    int order = 0;
    std::shared_ptr<const SmoothMap> map;  ///< c alone (1 row)
  };
  struct PlacedArc {
    std::string name;
    std::shared_ptr<const ExtremalArc> arc;
    Arc known;
    int constraint = -1;  ///< place of a boundary arc's constraint
    int side = 0;         ///< 1 where what holds the control bounds it from above, −1 from below, 0 if that is not known
  };
  struct Junction {
    int touched = -1;         ///< place of a constraint touched
    double multiplier = 0.0;  ///< guess of its π
    std::string name;         ///< of the user's row
    JunctionRow row;          ///< instead of the derived one
  };

  int cyclic = 0;
  std::function<Linearisation(const std::vector<double>& x, const Eigen::VectorXd& u)> linearise;  ///< of the system
  Eigen::VectorXd control_start, control_scale;  ///< where controls are searched, and typical magnitudes (k)
  std::vector<std::pair<std::string, State>> states;
  std::vector<std::pair<std::string, Control>> controls;
  std::vector<Parameter> parameters;
  bool minimum_time = false;  ///< the system states no running cost
  bool free_time = false;
  double time = 0.0;  ///< T, or its guess
  std::shared_ptr<const EndFunction> terminal_cost;
  std::vector<std::pair<std::string, std::shared_ptr<const EndFunction>>> end_conditions;
  std::vector<Constraint> constraints;
  std::vector<std::pair<std::string, MixedConstraint>> mixed;
  std::vector<std::shared_ptr<const SmoothMap>> mixed_maps;  ///< the same in their order (1 row each)
  std::shared_ptr<const SmoothMap> system;                   ///< (f, L) (n + 1 rows)
  std::vector<PlacedArc> arcs;
  std::vector<Junction> junctions;  ///< one fewer than arcs
};

/// Refuses what no problem can be made of: numbers out of range, names used twice. \throws BadInput
void check_statement(const ExtremalStatement& statement);

/// Refuses values of an arc with constant controls outside the bounds. \throws BadInput
void check_constant(const std::vector<std::pair<std::string, Control>>& controls, std::span<const double> values);

/// The order of a state constraint: as stated, 1 or 2, or found at the points x if that is 0.
/// \throws BadInput for any other number, one that the points contradict, or where they show none
[[nodiscard]] int constraint_order(const std::string& name, int stated, const StateConstraint& constraint,
                                   const std::vector<std::vector<double>>& points);

/// The shooting problem. Unknowns, as far as they are not known: "x_start", "lambda_x" (at the start), "duration 1", …, multipliers.
/// Parameters: those of the system, "u_lower", "u_upper", "x_start", "x_end", "final_time", as far as stated. Reports: "t1", …
/// (switching times), "final_time", "cost" (J).
/// \throws BadInput where a row is missing or one too many
[[nodiscard]] std::shared_ptr<const Problem> extremal_problem(ExtremalStatement statement);

}  // namespace costate
