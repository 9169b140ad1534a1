/// \file
/// A linear-quadratic problem in stages, solved by Riccati's recursion.
///
/// Minimise Σᵢ (½ xᵢᵀQᵢxᵢ + uᵢᵀSᵢxᵢ + ½ uᵢᵀRᵢuᵢ + qᵢᵀxᵢ + rᵢᵀuᵢ) + ½ x_NᵀQ_N x_N + q_Nᵀx_N subject to x_{i+1} = Aᵢxᵢ + Bᵢuᵢ + bᵢ and
/// x₀ = Fξ, over u and ξ. The value function ½ xᵀPᵢx + pᵢᵀx is carried back from the end. There is a unique minimum exactly if every
/// Rᵢ + BᵢᵀP_{i+1}Bᵢ and FᵀP₀F is positive definite, which tells a Newton step towards a minimum from one that is none.
///
/// Reference: Bryson & Ho, Applied Optimal Control, 1975, §§5.3, 6.3.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace costate {

struct LinearQuadratic {
  struct Stage {
    Eigen::MatrixXd a, b;     ///< A, B
    Eigen::VectorXd offset;   ///< b
    Eigen::MatrixXd q, s, r;  ///< Q, S, R
    Eigen::VectorXd gradient_x, gradient_u;
  };
  std::vector<Stage> stages;
  Eigen::MatrixXd end_hessian;   ///< Q_N
  Eigen::VectorXd end_gradient;  ///< q_N
  Eigen::MatrixXd freedom;       ///< F
};

struct LinearQuadraticSolution {
  std::vector<Eigen::VectorXd> x, u;
  std::vector<Eigen::VectorXd> slope;  ///< Pᵢxᵢ + pᵢ
};

/// Solves it. \return false if there is no unique minimum
[[nodiscard]] bool solve(const LinearQuadratic& problem, LinearQuadraticSolution& solution);

}  // namespace costate
