#include "curve.hpp"

#include <costate/error.hpp>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace costate {

/// Residual and derivatives at a point, in scaled unknowns and rows.
struct Curve::Linearised {
  Shot shot;
  Eigen::VectorXd residual;    ///< n
  Eigen::MatrixXd derivative;  ///< n × (n + 1)
};

std::size_t parameter_place(const Problem& problem, const std::string& name) {
  std::string names;
  for (std::size_t i = 0; i < problem.parameters().size(); ++i) {
    if (problem.parameters()[i].name == name) return i;
    names += (i == 0 ? "" : ", ") + problem.parameters()[i].name;
  }
  throw BadInput(fmt::format("the problem has no parameter {}; it has {}", name, names.empty() ? "none" : names));
}

Curve::Curve(std::shared_ptr<const Problem> problem, const std::vector<double>& parameters, std::size_t place,
             double parameter_scale, const FlowOptions& flow)
    : shooting_(std::move(problem)), place_(place), path_(parameters.size(), 0.0) {
  shooting_.set_parameters(parameters);
  shooting_.set_flow_options(flow);
  path_.at(place) = 1.0;
  scales_.resize(size() + 1);
  scales_ << shooting_.unknown_scales(), parameter_scale;
}

Eigen::VectorXd Curve::scaled(const Eigen::VectorXd& y, double parameter) const {
  Eigen::VectorXd u(size() + 1);
  u << y, parameter;
  return u.cwiseQuotient(scales_);
}

Eigen::RowVectorXd Curve::gradient(const Jet& jet) const {
  Eigen::RowVectorXd row = Eigen::RowVectorXd::Zero(size() + 1);
  for (const auto& entry : jet.gradient()) row[entry.column] = entry.derivative * scales_[entry.column];
  return row;
}

Curve::Linearised Curve::linearise(const Eigen::VectorXd& u) {
  std::vector<double> parameters = shooting_.parameters();
  if (parameters[place_] != parameter(u)) {
    parameters[place_] = parameter(u);
    shooting_.set_parameters(std::move(parameters));
  }
  Linearised at{shooting_.evaluate(unknowns(u), path_), {}, {}};
  at.residual.resize(size());
  at.derivative.resize(size(), size() + 1);
  const Eigen::VectorXd row_scales = shooting_.row_scales();
  for (Eigen::Index i = 0; i < size(); ++i) {
    const Jet& row = at.shot.rows()[static_cast<std::size_t>(i)];
    at.residual[i] = row.value / row_scales[i];
    at.derivative.row(i) = gradient(row) / row_scales[i];
  }
  return at;
}

std::optional<std::size_t> Curve::guard_place(const std::string& name, const Eigen::VectorXd& u) {
  try {
    const Linearised at = linearise(u);
    const auto& guards = at.shot.guards();
    const auto found = std::find_if(guards.begin(), guards.end(), [&](const Guard& guard) { return guard.name == name; });
    if (found != guards.end()) return static_cast<std::size_t>(found - guards.begin());
    failure_ = fmt::format("the structure has no guard named {}", name);
  } catch (const LeftDomain& left) {
    failure_ = left.what();
  }
  return std::nullopt;
}

std::optional<CurvePoint> Curve::correct(Eigen::VectorXd u, const Constraint& constraint, const Eigen::VectorXd& forward,
                                         const CorrectorOptions& options) {
  const Eigen::Index n = size();
  const Eigen::VectorXd predicted = u;
  constexpr double longest = 1.0;  // of a correction, when the start is rough
  constexpr double noise = 1e-6;   // below it a correction that no longer shrinks is that of the integration
  CurvePoint point;
  failure_.clear();
  double last = 0.0;
  try {
    for (int k = 0; k < options.max_iterations; ++k) {
      const Linearised at = linearise(u);
      ++newton_iterations_;
      Eigen::MatrixXd bordered(n + 1, n + 1);
      Eigen::VectorXd right(n + 1);
      bordered.topRows(n) = at.derivative;
      right.head(n) = -at.residual;
      switch (constraint.kind) {
        case Constraint::Kind::plane:
          bordered.row(n) = constraint.normal.transpose();
          right[n] = -constraint.normal.dot(u - predicted);
          break;
        case Constraint::Kind::parameter:
          bordered.row(n) = Eigen::RowVectorXd::Unit(n + 1, n);
          right[n] = constraint.value / scales_[n] - u[n];
          break;
        case Constraint::Kind::guard: {
          const Jet& guard = at.shot.guards().at(constraint.guard).value;
          bordered.row(n) = gradient(guard);
          right[n] = constraint.value - guard.value;
          break;
        }
      }
      Eigen::VectorXd correction = bordered.partialPivLu().solve(right);
      if (!correction.allFinite()) {
        failure_ = "the linear system is singular";
        return std::nullopt;
      }
      double size = correction.lpNorm<Eigen::Infinity>();
      if (options.far && size > longest) {
        correction *= longest / size;
        size = longest;
      }
      if (k == 0) point.first_correction = size;
      if (k == 1) point.contraction = size / last;
      const bool drowned = k > 0 && size <= noise && size >= 0.3 * last;
      if (size <= options.tolerance || drowned) {
        u += correction;
        if (constraint.kind == Constraint::Kind::parameter) {
          u[n] = constraint.value / scales_[n];
          point.landed = constraint.value;
        }
        point.u = u;
        point.iterations = k + 1;
        point.last_correction = size;
        point.parameter_correction = std::abs(correction[n] * scales_[n]);
        describe(at, correction, forward, point);
        return point;
      }
      if (!options.far && k > 0 && size > 0.9 * last) {
        failure_ = "Newton's method does not contract";
        return std::nullopt;
      }
      last = size;
      u += correction;
    }
    failure_ = fmt::format("Newton's method has not converged after {} iterations", options.max_iterations);
  } catch (const LeftDomain& left) {
    failure_ = left.what();
  }
  return std::nullopt;
}

void Curve::describe(const Linearised& at, const Eigen::VectorXd& correction, const Eigen::VectorXd& forward,
                     CurvePoint& point) const {
  const Eigen::Index n = size();
  point.tangent = at.derivative.fullPivLu().kernel().col(0).normalized();
  if (point.tangent.dot(forward) < 0.0) point.tangent = -point.tangent;
  const auto& guards = at.shot.guards();
  point.guards.resize(static_cast<Eigen::Index>(guards.size()));
  point.guard_rates.resize(point.guards.size());
  for (Eigen::Index i = 0; i < point.guards.size(); ++i) {
    const Jet& value = guards[static_cast<std::size_t>(i)].value;
    const Eigen::RowVectorXd slope = gradient(value);
    point.guards[i] = value.value + slope.dot(correction);
    point.guard_rates[i] = slope.dot(point.tangent);
  }
  const double parameter_rate = point.tangent[n] * scales_[n];
  for (const Report& report : at.shot.reports()) {
    const Eigen::RowVectorXd slope = gradient(report.value);
    point.reports.push_back(
        {report.name, report.unit, report.value.value + slope.dot(correction), slope.dot(point.tangent) / parameter_rate});
  }
  point.shot = at.shot;
}

}  // namespace costate
