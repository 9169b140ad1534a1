/// \file
/// The discretised problem of direct_phase.hpp: values, optimality errors, and the linear-quadratic problem of a Newton step.
#pragma once

#include "direct_phase.hpp"
#include "linear_quadratic.hpp"

namespace costate {

/// Variables, slacks and multipliers; also a direction in all of them.
struct DirectPoint {
  Eigen::MatrixXd q, u;
  double log_time = 0.0;
  Eigen::MatrixXd costate;                      ///< λ (n × N)
  Eigen::MatrixXd step_slack, step_multiplier;  ///< of bounds and mixed constraints (… × N)
  Eigen::MatrixXd node_slack, node_multiplier;  ///< of state constraints (… × (N + 1))
  Eigen::VectorXd end_multiplier;               ///< of fixed ends, then of the end conditions

  /// this + the steps times the direction: `primal` for variables, slacks and multipliers of equations, `dual` for η.
  [[nodiscard]] DirectPoint moved(const DirectPoint& direction, double primal, double dual) const;
};

/// What a line search looks at.
struct Merit {
  double cost = 0.0;           ///< J
  double barrier = 0.0;        ///< J − μ Σ log s
  double infeasibility = 0.0;  ///< sum of the violations of all equations, in scales
};

class Transcription {
 public:
  Transcription(const ExtremalStatement& statement, const DirectData& data, const DirectOptions& options);

  [[nodiscard]] DirectPoint start(const Eigen::VectorXd& u, DirectBegin begin, double barrier) const;
  /// \throws LeftDomain where a function is no number
  [[nodiscard]] Merit merit(const DirectPoint& point, double barrier) const;

  /// Derivatives at a point. \throws LeftDomain where one is no number
  struct Expansion {
    std::vector<SmoothMap::Expansion> system;              // per step
    std::vector<std::vector<SmoothMap::Expansion>> mixed;  // per step, per constraint
    std::vector<std::vector<SmoothMap::Expansion>> node;   // per node, per constraint; empty where it is not imposed
    double end_cost = 0.0;
    Eigen::VectorXd end_gradient;  // of Φ, by (q(T), log T, free q(0))
    Eigen::MatrixXd end_hessian;   // of Φ + σ·Ψ
    Eigen::VectorXd end_value;     // fixed ends, Ψ
    Eigen::MatrixXd end_jacobian;
  };
  [[nodiscard]] Expansion expand(const DirectPoint& point) const;

  /// Largest violation of the optimality conditions at a barrier μ, in scales and per unit of T.
  [[nodiscard]] double error(const DirectPoint& point, const Expansion& at, double barrier) const;

  struct Newton {
    DirectPoint direction;
    double slope = 0.0;  ///< of J − μ Σ log s along it
  };
  /// The Newton step with `shift` times the scaled unit matrix added to the Hessian; nothing if that has no minimum.
  [[nodiscard]] std::optional<Newton> newton(const DirectPoint& point, const Expansion& at, double barrier,
                                             double shift) const;

  /// The largest part of a direction, up to 1, in which no control moves by more than its scale and the time by more than a factor of 2.
  [[nodiscard]] double longest_step(const DirectPoint& direction) const;

  [[nodiscard]] double time(const DirectPoint& point) const;
  [[nodiscard]] DirectSolution solution(const DirectPoint& point) const;

 private:
  struct Bound {
    Eigen::Index control;
    double sign, value;  ///< sign·u ≤ sign·value
  };
  /// ½ zᵀWz + gᵀz of one step in z = (q̄, u, log T).
  struct Quadratic {
    Eigen::VectorXd gradient, cost_gradient;  ///< with barrier and multipliers of inequalities, and of h L alone
    Eigen::MatrixXd hessian;
  };

  [[nodiscard]] Eigen::VectorXd middle(const DirectPoint& point, Eigen::Index i) const;
  [[nodiscard]] bool imposed(Eigen::Index constraint, Eigen::Index node) const {
    return (node > 0 || imposed_at_start_[static_cast<std::size_t>(constraint)]) &&
           (node < steps_ || imposed_at_end_[static_cast<std::size_t>(constraint)]);
  }
  void simulate(DirectPoint& point) const;
  void expand_ends(const DirectPoint& point, Expansion& at) const;
  [[nodiscard]] Quadratic step_model(const DirectPoint& point, const Expansion& at, Eigen::Index i, double barrier) const;
  void add_node_model(const DirectPoint& point, const Expansion& at, Eigen::Index i, double barrier,
                      Eigen::VectorXd& gradient, Eigen::MatrixXd& hessian) const;

  const ExtremalStatement& s_;
  const DirectData& data_;
  Eigen::Index steps_, n_, k_, mixed_, size_;  ///< size_ of (q, log T, free q(0))
  Eigen::VectorXd state_scale_, control_scale_;
  std::vector<Bound> bounds_;
  std::vector<Eigen::Index> fixed_end_, free_start_;
  bool carries_start_;  ///< free q(0) as constant states
  std::vector<bool> imposed_at_start_, imposed_at_end_;
  double penalty_ = 1e6;  ///< of the end conditions, in scales
};

}  // namespace costate
