/// \file
/// A shooting problem as a system of equations: residual, Jacobian, derivative along a path of parameters.
#pragma once

#include <costate/nonlinear.hpp>
#include <costate/problem.hpp>

#include <optional>

namespace costate {

/// R(y; p) of a problem, evaluated with exact derivatives. One integration of the arcs serves residual and Jacobian.
class Shooting final : public NonlinearSystem {
 public:
  explicit Shooting(std::shared_ptr<const Problem> problem);

  [[nodiscard]] const Problem& problem() const { return *problem_; }
  [[nodiscard]] std::shared_ptr<const Problem> shared_problem() const { return problem_; }
  [[nodiscard]] const std::vector<double>& parameters() const { return parameters_; }
  void set_parameters(std::vector<double> values);
  void set_flow_options(const FlowOptions& options);
  [[nodiscard]] const FlowOptions& flow_options() const { return flows_.options(); }

  /// A whole evaluation at y. With `path` (one rate per parameter) the derivative of every jet along it is in column size().
  /// The last point is remembered, so asking again costs nothing. The reference is valid until the
  /// next call of a function that is not const. \throws LeftDomain
  const Shot& evaluate(const Eigen::VectorXd& y, const std::vector<double>& path = {});

  /// The same without derivatives: the integrations follow the states alone, with steps of their own. \throws LeftDomain
  [[nodiscard]] Shot values(const Eigen::VectorXd& y);

  [[nodiscard]] Eigen::Index size() const override { return static_cast<Eigen::Index>(problem_->unknowns().size()); }
  void residual(const Eigen::VectorXd& y, Eigen::VectorXd& r) override;
  void jacobian(const Eigen::VectorXd& y, Eigen::MatrixXd& j) override;

  /// R, ∂R/∂y and ∂R/∂path of a shot.
  [[nodiscard]] Eigen::VectorXd residual(const Shot& shot) const;
  [[nodiscard]] Eigen::MatrixXd jacobian(const Shot& shot) const;
  [[nodiscard]] Eigen::VectorXd path_derivative(const Shot& shot) const;

  /// Size of the Newton correction at y, max |(J⁻¹R)ⱼ| / scaleⱼ: how far y is from the root, whatever the rows are scaled by.
  [[nodiscard]] double correction(const Eigen::VectorXd& y);

  [[nodiscard]] Eigen::VectorXd unknown_scales() const;
  [[nodiscard]] Eigen::VectorXd row_scales() const;
  [[nodiscard]] Statistics statistics() const { return flows_.statistics(); }
  [[nodiscard]] FlowCache& flows() { return flows_; }

 private:
  std::shared_ptr<const Problem> problem_;
  std::vector<double> parameters_;
  FlowCache flows_;
  std::optional<Shot> shot_;
  Eigen::VectorXd point_;
  std::vector<double> path_;
};

}  // namespace costate
