/// \file
/// A shooting problem as a system of equations: residual, Jacobian, derivative along a path of parameters.
#pragma once

#include <costate/nonlinear.hpp>
#include <costate/problem.hpp>

#include <limits>
#include <memory>
#include <optional>

namespace costate {

class Staircase;

/// How much of an evaluation is wanted.
enum class Extent {
  equations,   ///< rows, matches and arcs; nothing is allocated for them after the first time
  everything,  ///< reports and guards too
};

/// Multiple shooting: where arcs are cut, and what stands at the cuts.
struct Mesh {
  Cuts cuts;
  std::vector<int> sizes;  ///< of the nodes, states and quadratures together, in the order of the cuts
  Eigen::VectorXd nodes;   ///< their values (z, w), one node after the other
};

/// R(y; p) of a problem, evaluated with exact derivatives. One integration of the arcs serves residual and Jacobian.
///
/// Its unknowns are those of the problem, the border, followed by the nodes where arcs are cut (none at first: single shooting);
/// its rows are those of the problem, followed by the matching conditions. Newton's linear systems are solved by a QR
/// decomposition that is linear in the number of segments (see staircase.hpp).
class Shooting final : public NonlinearSystem {
 public:
  explicit Shooting(std::shared_ptr<const Problem> problem);
  ~Shooting() override;

  [[nodiscard]] const Problem& problem() const { return *problem_; }
  [[nodiscard]] std::shared_ptr<const Problem> shared_problem() const { return problem_; }
  [[nodiscard]] const std::vector<double>& parameters() const { return parameters_; }
  void set_parameters(const std::vector<double>& values);
  void set_flow_options(const FlowOptions& options);
  [[nodiscard]] const FlowOptions& flow_options() const { return flows_.options(); }
  /// Cuts the arcs; the values of the nodes are part of the point from here on, not kept. \throws BadInput if sizes do not fit.
  void set_mesh(const Mesh& mesh);
  [[nodiscard]] const Cuts& cuts() const { return cuts_; }
  [[nodiscard]] const std::vector<int>& node_sizes() const { return node_sizes_; }
  /// Evaluations throw BudgetSpent once statistics().steps has reached this number.
  void set_step_limit(long steps) { step_limit_ = steps; }
  /// \throws BudgetSpent if that is so now: for those who integrate with flows() themselves
  void check_step_limit() const;
  /// Number of the problem's own unknowns.
  [[nodiscard]] Eigen::Index border() const { return static_cast<Eigen::Index>(problem_->unknowns().size()); }

  /// An evaluation at y. With `path` (one rate per parameter) the derivative of every jet along it is in column size().
  /// The last point is remembered: asking again costs nothing, and asking for more integrates nothing. The reference is valid until the
  /// next call of a function that is not const. \throws LeftDomain
  const Shot& evaluate(const Eigen::VectorXd& y, const std::vector<double>& path = {},
                       Extent extent = Extent::everything);

  /// The arcs as they are at a start, with its states for what they lead to: nothing is integrated. \throws LeftDomain
  [[nodiscard]] std::vector<ArcRecord> sketch(const Start& start);
  /// The segment in which the last evaluation failed.
  [[nodiscard]] SegmentPlace failed_place() const { return failed_place_; }

  /// The same without derivatives: the integrations follow the states alone, with steps of their own. \throws LeftDomain
  const Shot& values(const Eigen::VectorXd& y, Extent extent = Extent::everything);

  [[nodiscard]] Eigen::Index size() const override { return border() + node_scales_.size(); }
  void residual(const Eigen::VectorXd& y, Eigen::VectorXd& r) override;
  void jacobian(const Eigen::VectorXd& y, Eigen::MatrixXd& j) override;
  bool factorise(const Eigen::VectorXd& y) override;
  void solve(const Eigen::VectorXd& r, Eigen::VectorXd& x) const override;

  /// R, ∂R/∂y and ∂R/∂path of a shot, and ∂R/∂y decomposed.
  [[nodiscard]] Eigen::VectorXd residual(const Shot& shot) const;
  [[nodiscard]] Eigen::MatrixXd jacobian(const Shot& shot) const;
  [[nodiscard]] Eigen::VectorXd path_derivative(const Shot& shot) const;
  [[nodiscard]] Staircase decompose(const Shot& shot) const;
  /// Row i of R: a row of the problem, or a match.
  [[nodiscard]] const Jet& row(const Shot& shot, Eigen::Index i) const;
  [[nodiscard]] std::string row_name(Eigen::Index i) const;
  [[nodiscard]] std::string unknown_name(Eigen::Index j) const;

  /// Size of the Newton correction at y, max |(J⁻¹R)ⱼ| / scaleⱼ: how far y is from the root, whatever the rows are scaled by.
  [[nodiscard]] double correction(const Eigen::VectorXd& y);

  [[nodiscard]] Eigen::VectorXd unknown_scales() const;
  [[nodiscard]] Eigen::VectorXd row_scales() const;
  [[nodiscard]] Statistics statistics() const { return flows_.statistics(); }
  [[nodiscard]] FlowCache& flows() { return flows_; }

 private:
  /// A shot that is kept from one evaluation to the next, and whether it is that of the present point.
  struct Kept {
    std::optional<Shot> shot;
    bool current = false;
  };

  void check_size(const Eigen::VectorXd& y) const;
  void forget();
  void fit(Kept& kept, bool differentiated);
  void shoot(Kept& kept, const Eigen::VectorXd& y, Extent extent);
  [[nodiscard]] std::string node_name(Eigen::Index component) const;

  std::shared_ptr<const Problem> problem_;
  std::vector<double> parameters_;
  Cuts cuts_;
  std::vector<int> node_sizes_;
  Eigen::VectorXd node_scales_;
  SegmentPlace failed_place_;
  long step_limit_ = std::numeric_limits<long>::max();
  std::unique_ptr<Staircase> newton_;
  FlowCache flows_;
  Kept shot_, values_;  ///< with derivatives and without
  Eigen::VectorXd point_;
  std::vector<double> path_;
};

}  // namespace costate
