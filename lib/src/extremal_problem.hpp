/// \file
/// The shooting problem of a stated optimal-control problem.
#pragma once

#include "costate_estimate.hpp"

namespace costate {

class ExtremalProblem final : public Problem {
 public:
  explicit ExtremalProblem(ExtremalStatement statement);

  [[nodiscard]] std::optional<Eigen::VectorXd> state_guess(int arc, double fraction) const override;
  /// From a coarse direct solution, see direct_phase.hpp and direct_start.hpp.
  [[nodiscard]] std::optional<Start> search_start(const std::vector<double>& parameters) const override;
  void shoot(Shot& shot) const override;
  [[nodiscard]] std::vector<Column> columns() const override;
  [[nodiscard]] std::vector<double> observe(const ArcPoint& point, const std::vector<double>& parameters) const override;
  [[nodiscard]] std::vector<PathCheck> check(const ArcPoint& point, const std::vector<double>& parameters) const override;

 private:
  /// What a junction asks for. Several may come together, in this order.
  enum class Condition {
    user,                  ///< the user's row
    continuous_h,          ///< H is continuous
    bangs,                 ///< H is continuous, divided by the step of the control
    continuous_u,          ///< the control is continuous
    switching_before,      ///< H_u = 0 with the control of the arc before
    switching_after,       ///< the same of the arc after
    switching_rate_after,  ///< d/dt H_u = 0 of the singular arc after
    touch,                 ///< c = 0 and c' = 0
    touch_first_order,     ///< c = 0 and H continuous after the jump
    boundary,              ///< c = … = c^(r−1) = 0
  };
  struct Junction {
    std::vector<Condition> conditions;
    int constraint = -1;
    std::size_t multiplier = 0, multipliers = 0;  ///< places of the unknowns πᵢ
  };
  class Pass;
  /// What is kept with every arc as constants of a solution, for the checks along it.
  struct Constants {
    double start_hamiltonian = 0.0;
    double size = 0.0;                  ///< largest Σ |λᵢ fᵢ| + |L| at the ends of the arcs
    std::vector<double> gradient_size;  ///< the same of H_u (k)
    double time = 0.0;                  ///< T
    double exit = 0.0;                  ///< μ(T) where it must vanish, over its terms
    std::vector<double> entry;          ///< by arc: the part at its entry of a constraint's multiplier, over its terms
    [[nodiscard]] std::vector<double> packed() const;
    static Constants unpacked(const std::vector<double>& packed, std::size_t controls);
  };

  void state_parameters();
  void state_start();
  void state_durations();
  void state_junctions();
  void state_end();
  void guess_costates();
  [[nodiscard]] std::vector<Condition> conditions(std::size_t junction) const;
  void add_row(std::string name, double scale = 1.0) { rows_.push_back({std::move(name), scale}); }
  std::size_t add_unknown(Unknown unknown);
  std::size_t add_parameter(Parameter parameter);
  [[nodiscard]] double costate_scale(std::size_t state) const;
  [[nodiscard]] bool has_end_functions() const { return s_.terminal_cost || !s_.end_conditions.empty(); }
  [[nodiscard]] std::vector<double> point_of(const ArcPoint& point) const;
  [[nodiscard]] double lower(const std::vector<double>& x, std::size_t control) const;
  [[nodiscard]] double upper(const std::vector<double>& x, std::size_t control) const;
  void check_control(const std::vector<double>& x, std::size_t arc, const ArcValues& values, const Constants& solution,
                     std::vector<PathCheck>& checks) const;
  void check_boundary(const std::vector<double>& x, std::size_t arc, const ArcValues& values, const Constants& solution,
                      std::vector<PathCheck>& checks) const;
  /// How much larger H is at the control than at the best other one looked at, relative to its terms.
  [[nodiscard]] double advantage(const std::vector<double>& x, std::size_t arc, const ArcValues& values,
                                 double size) const;
  [[nodiscard]] std::vector<std::vector<double>> other_controls(const std::vector<double>& x,
                                                                const std::vector<double>& control) const;
  /// Does nothing but the constraint of order 2 hold the state at the end that c' depends on?
  [[nodiscard]] bool ends_free(const std::vector<double>& x, const StateConstraint& constraint) const;
  [[nodiscard]] bool same_control(std::size_t before, std::size_t after) const;

  ExtremalStatement s_;
  std::size_t n_, cyclic_;
  std::vector<double> durations_;  ///< guesses
  // Places of unknowns and parameters; none where there is no such.
  std::vector<std::optional<std::size_t>> start_parameter_, end_parameter_, lower_parameter_, upper_parameter_;
  std::vector<std::optional<std::size_t>> start_unknown_, costate_unknown_, duration_unknown_;
  std::optional<std::size_t> time_parameter_;
  std::vector<std::size_t> end_multiplier_;
  std::vector<Junction> junctions_;
  std::optional<CostateEstimate> estimate_;  ///< where no costate is guessed
};

}  // namespace costate
