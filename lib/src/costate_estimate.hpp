/// \file
/// Costates that suit a guessed motion, to start from where no others are known.
///
/// Along a guessed q(t) with guessed durations every condition on the costates is linear in them once the controls are known:
/// λ' = L_q − f_qᵀλ, H_u = f_uᵀλ − L_u = 0 on interior and singular arcs and at junctions, transversality, H(T). The control of an arc
/// is its bound or what its constraint asks for; else the one whose f(q, u) is nearest to the guessed q'. λ(0) and all multipliers
/// are the least-squares solution, drawn a little towards 0 where the conditions leave them open.
#pragma once

#include <costate/extremal_statement.hpp>

#include <Eigen/Core>

namespace costate {

/// What is guessed of the motion: states q (n) at a fraction of the whole time, durations of the arcs.
struct GuessedMotion {
  Eigen::VectorXd start, end;
  std::vector<double> durations;
};

struct CostateEstimate {
  static constexpr int cells = 16;  ///< per arc

  Eigen::VectorXd start;                     ///< λ(0) (n)
  std::vector<Eigen::VectorXd> multipliers;  ///< πᵢ of each junction
  Eigen::VectorXd end_multipliers;           ///< σ
  std::vector<Eigen::MatrixXd> along;        ///< λ at the ends of the cells of each arc (n × (cells + 1))
};

/// `multipliers` says how many πᵢ each junction has, `constraint` of which constraint. Nothing where a value on the way is not a number.
[[nodiscard]] std::optional<CostateEstimate> estimate_costates(const ExtremalStatement& statement,
                                                               const GuessedMotion& motion,
                                                               const std::vector<int>& constraint,
                                                               const std::vector<std::size_t>& multipliers);

}  // namespace costate
