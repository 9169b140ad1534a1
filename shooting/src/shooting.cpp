#include <costate/error.hpp>
#include <costate/shooting/shooting.hpp>

#include <Eigen/LU>
#include <fmt/format.h>

namespace costate {

Shooting::Shooting(std::shared_ptr<const Problem> problem) : problem_(std::move(problem)) {
  const auto unknowns = problem_->unknowns().size();
  const auto rows = problem_->rows().size();
  if (unknowns != rows) {
    throw BadInput(fmt::format("the problem has {} unknowns and {} rows; shooting needs as many rows as unknowns", unknowns,
                               rows));
  }
  for (const Parameter& parameter : problem_->parameters()) parameters_.push_back(parameter.value);
}

void Shooting::set_parameters(std::vector<double> values) {
  if (values.size() != problem_->parameters().size()) {
    throw BadInput(fmt::format("{} parameter values given, the problem has {}", values.size(), problem_->parameters().size()));
  }
  parameters_ = std::move(values);
  shot_.reset();
}

void Shooting::set_flow_options(const FlowOptions& options) {
  flows_.set_options(options);
  shot_.reset();
}

const Shot& Shooting::evaluate(const Eigen::VectorXd& y, const std::vector<double>& path) {
  if (shot_ && path == path_ && y == point_) return *shot_;
  std::vector<Jet> unknowns;
  for (Eigen::Index i = 0; i < size(); ++i) unknowns.push_back(Jet::variable(y[i], static_cast<int>(i)));
  std::vector<Jet> parameters;
  for (std::size_t i = 0; i < parameters_.size(); ++i) {
    const double rate = path.empty() ? 0.0 : path[i];
    parameters.push_back(rate == 0.0 ? Jet(parameters_[i]) : Jet::variable(parameters_[i], static_cast<int>(size()), rate));
  }
  shot_.reset();
  Shot shot(flows_, std::move(unknowns), std::move(parameters), problem_->rows().size());
  problem_->shoot(shot);
  point_ = y;
  path_ = path;
  return shot_.emplace(std::move(shot));
}

Shot Shooting::values(const Eigen::VectorXd& y) {
  Shot shot(flows_, std::vector<Jet>(y.begin(), y.end()), std::vector<Jet>(parameters_.begin(), parameters_.end()),
            problem_->rows().size());
  problem_->shoot(shot);
  return shot;
}

void Shooting::residual(const Eigen::VectorXd& y, Eigen::VectorXd& r) { r = residual(evaluate(y)); }

void Shooting::jacobian(const Eigen::VectorXd& y, Eigen::MatrixXd& j) { j = jacobian(evaluate(y)); }

Eigen::VectorXd Shooting::residual(const Shot& shot) const {
  Eigen::VectorXd r(size());
  for (Eigen::Index i = 0; i < size(); ++i) r[i] = shot.rows()[static_cast<std::size_t>(i)].value;
  return r;
}

Eigen::MatrixXd Shooting::jacobian(const Shot& shot) const {
  Eigen::MatrixXd j = Eigen::MatrixXd::Zero(size(), size());
  for (Eigen::Index i = 0; i < size(); ++i) {
    for (const auto& entry : shot.rows()[static_cast<std::size_t>(i)].gradient()) {
      if (entry.column < size()) j(i, entry.column) = entry.derivative;
    }
  }
  return j;
}

Eigen::VectorXd Shooting::path_derivative(const Shot& shot) const {
  Eigen::VectorXd d(size());
  for (Eigen::Index i = 0; i < size(); ++i) {
    d[i] = shot.rows()[static_cast<std::size_t>(i)].derivative(static_cast<int>(size()));
  }
  return d;
}

double Shooting::correction(const Eigen::VectorXd& y) {
  const Shot& shot = evaluate(y);
  const Eigen::VectorXd step = jacobian(shot).partialPivLu().solve(residual(shot));
  return step.cwiseQuotient(unknown_scales()).cwiseAbs().maxCoeff();
}

Eigen::VectorXd Shooting::unknown_scales() const {
  Eigen::VectorXd s(size());
  for (Eigen::Index i = 0; i < size(); ++i) s[i] = problem_->unknowns()[static_cast<std::size_t>(i)].scale;
  return s;
}

Eigen::VectorXd Shooting::row_scales() const {
  Eigen::VectorXd s(size());
  for (Eigen::Index i = 0; i < size(); ++i) s[i] = problem_->rows()[static_cast<std::size_t>(i)].scale;
  return s;
}

}  // namespace costate
