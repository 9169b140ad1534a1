/// \file
/// A coarse direct solution of a stated optimal-control problem: discretise, then optimise.
///
/// The trajectory has N equal steps of length h = T/N; states are given at their ends, controls are constant on each. The equations are
/// q_{i+1} − qᵢ = h f(q̄ᵢ, uᵢ) with q̄ᵢ = (qᵢ + q_{i+1})/2, the cost is Φ + Σ h L(q̄ᵢ, uᵢ). State constraints hold at the ends of the steps,
/// mixed ones and bounds at the middle. T > 0 is sought by its logarithm.
///
/// The minimum is found by a primal-dual interior-point method: every inequality c ≤ 0 has a slack s > 0, c + s = 0, and a multiplier η > 0
/// with s η = μ ↘ 0. The Newton step of the optimality conditions is a linear-quadratic problem in stages; a multiple of the unit matrix is
/// added to its Hessian until it has a minimum, and the step is shortened until a filter takes it. Nothing in it is random.
///
/// The midpoint rule is symplectic: with the multipliers λᵢ of its equations as costates it discretises Pontryagin's conditions by the same
/// rule, H_u(q̄ᵢ, λᵢ, uᵢ) = 0 between the bounds, and all of it is of second order. λ is the costate of the state constraints' direct adjoining:
/// it jumps by ηᵢ c_q where a constraint acts.
///
/// Reference: Hager, Numer. Math. 87 (2000) 247–282 (costates from discretisation); Wächter & Biegler, Math. Program. 106 (2006) 25–57
/// (interior point, filter, inertia correction).
#pragma once

#include <costate/extremal_statement.hpp>

namespace costate {

/// The numbers a statement leaves open, as far as they are stated.
struct DirectData {
  Eigen::VectorXd parameters;                       ///< of the system (m)
  std::vector<std::optional<double>> lower, upper;  ///< of the controls
  std::vector<std::optional<double>> start, end;    ///< of the states
  double time = 0.0;                                ///< T or its guess
};

struct DirectOptions {
  int steps = 80;                               ///< N
  int iterations = 150;                         ///< at most
  double first_barrier = 10.0, barrier = 1e-6;  ///< the first μ and the last
};

/// Work left to several solutions together.
struct DirectBudget {
  int newton_systems = 0;  ///< to be factorised
};

/// How the states begin.
enum class DirectBegin {
  straight,   ///< on the straight line between their ends
  simulated,  ///< as the first controls lead them from the start; the ends are missed
};

struct DirectSolution {
  double time = 0.0;               ///< T
  double cost = 0.0;               ///< J
  Eigen::MatrixXd state;           ///< q (n × (N + 1))
  Eigen::MatrixXd control;         ///< u (k × N)
  Eigen::MatrixXd costate;         ///< λ at the middle of the steps (n × N)
  Eigen::VectorXd start_costate;   ///< λ(0) (n)
  Eigen::MatrixXd multiplier;      ///< η of the state constraints, ≥ 0 (constraints × (N + 1))
  Eigen::VectorXd end_multiplier;  ///< σ of the end conditions
  int iterations = 0;
};

/// The solution from constant controls `u` (k); nothing if none is found, or none within the budget, if there is one.
[[nodiscard]] std::optional<DirectSolution> direct_solution(const ExtremalStatement& statement, const DirectData& data,
                                                            const Eigen::VectorXd& u,
                                                            DirectBegin begin = DirectBegin::straight,
                                                            const DirectOptions& options = {},
                                                            DirectBudget* budget = nullptr);

}  // namespace costate
