#include "transcription.hpp"

#include <costate/error.hpp>

#include <Eigen/LU>
#include <cmath>
#include <numbers>

namespace costate {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

std::size_t place(Index i) { return static_cast<std::size_t>(i); }

void check(bool finite) {
  if (!finite) throw LeftDomain("a function of the statement is no number on the way to a direct solution");
}

double smallest_slack(double violation, double scale) { return std::max(-violation, 0.1 * scale); }

}  // namespace

DirectPoint DirectPoint::moved(const DirectPoint& direction, double primal, double dual) const {
  return {q + primal * direction.q,
          u + primal * direction.u,
          log_time + primal * direction.log_time,
          costate + primal * direction.costate,
          step_slack + primal * direction.step_slack,
          step_multiplier + dual * direction.step_multiplier,
          node_slack + primal * direction.node_slack,
          node_multiplier + dual * direction.node_multiplier,
          end_multiplier + primal * direction.end_multiplier};
}

Transcription::Transcription(const ExtremalStatement& statement, const DirectData& data, const DirectOptions& options)
    : s_(statement),
      data_(data),
      steps_(options.steps),
      n_(static_cast<Index>(statement.states.size())),
      k_(static_cast<Index>(statement.controls.size())),
      mixed_(static_cast<Index>(statement.mixed_maps.size())),
      state_scale_(n_),
      control_scale_(k_) {
  for (Index i = 0; i < n_; ++i) {
    const auto &start = data.start[place(i)], &end = data.end[place(i)];
    const double size = std::max({std::abs(start.value_or(0.0)), std::abs(end.value_or(0.0)),
                                  std::abs(s_.states[place(i)].second.guess.value_or(0.0))});
    state_scale_[i] = size > 0.0 ? size : s_.states[place(i)].second.scale;
    if (end) fixed_end_.push_back(i);
    if (!start) free_start_.push_back(i);
  }
  for (Index j = 0; j < k_; ++j) {
    const auto &lower = data.lower[place(j)], &upper = data.upper[place(j)];
    const double stated = s_.controls[place(j)].second.scale;
    control_scale_[j] = stated > 0.0 ? stated : lower && upper ? 0.5 * (*upper - *lower) : 1.0;
    if (lower) bounds_.push_back({j, -1.0, *lower});
    if (upper) bounds_.push_back({j, 1.0, *upper});
  }
  carries_start_ = !free_start_.empty() && (s_.terminal_cost || !s_.end_conditions.empty());
  size_ = n_ + (s_.free_time ? 1 : 0) + (carries_start_ ? static_cast<Index>(free_start_.size()) : 0);
  // Where a constraint has only fixed states to depend on, an end has no say in it, and it may hold there with equality.
  imposed_at_start_.assign(s_.constraints.size(), true);
  imposed_at_end_.assign(s_.constraints.size(), true);
  const DirectPoint straight = start(VectorXd::Zero(k_), DirectBegin::straight, 1.0);
  for (std::size_t c = 0; c < s_.constraints.size(); ++c) {
    const auto free_at = [&](Index node, const std::vector<std::optional<double>>& fixed) {
      VectorXd z = VectorXd::Zero(n_ + k_);
      z.head(n_) = straight.q.col(node);
      const auto expansion = s_.constraints[c].map->expand(z, data_.parameters, VectorXd::Zero(1));
      for (Index i = 0; i < n_; ++i) {
        if (!fixed[place(i)] && expansion.jacobian(0, i) != 0.0) return true;
      }
      return false;
    };
    imposed_at_start_[c] = free_at(0, data.start);
    imposed_at_end_[c] = free_at(steps_, data.end);
  }
}

double Transcription::time(const DirectPoint& point) const { return std::exp(point.log_time); }

double Transcription::longest_step(const DirectPoint& direction) const {
  const double size = std::max((control_scale_.cwiseInverse().asDiagonal() * direction.u).cwiseAbs().maxCoeff(),
                               std::abs(direction.log_time) / std::numbers::ln2);
  return 1.0 / std::max(1.0, size);
}

VectorXd Transcription::middle(const DirectPoint& point, Index i) const {
  VectorXd z(n_ + k_);
  z << 0.5 * (point.q.col(i) + point.q.col(i + 1)), point.u.col(i);
  return z;
}

/// The states from the first one on, by the explicit midpoint rule.
void Transcription::simulate(DirectPoint& point) const {
  const double h = time(point) / static_cast<double>(steps_);
  for (Index i = 0; i < steps_; ++i) {
    VectorXd z(n_ + k_);
    z << point.q.col(i), point.u.col(i);
    z.head(n_) += 0.5 * h * s_.system->value(z, data_.parameters).head(n_);
    point.q.col(i + 1) = point.q.col(i) + h * s_.system->value(z, data_.parameters).head(n_);
    check(point.q.col(i + 1).allFinite());
  }
}

DirectPoint Transcription::start(const VectorXd& u, DirectBegin begin, double barrier) const {
  DirectPoint point;
  point.q.resize(n_, steps_ + 1);
  for (Index i = 0; i < n_; ++i) {
    const State& state = s_.states[place(i)].second;
    const auto &from = data_.start[place(i)], &to = data_.end[place(i)];
    const double first = from ? *from : state.guess ? *state.guess : to.value_or(0.0);
    const double last = to ? *to : state.guess ? *state.guess : first;
    for (Index j = 0; j <= steps_; ++j)
      point.q(i, j) = std::lerp(first, last, static_cast<double>(j) / static_cast<double>(steps_));
  }
  point.u = u.replicate(1, steps_);
  point.log_time = std::log(data_.time);
  if (begin == DirectBegin::simulated) simulate(point);
  point.costate.setZero(n_, steps_);
  const auto constraints = static_cast<Index>(s_.constraints.size());
  point.step_slack.resize(static_cast<Index>(bounds_.size()) + mixed_, steps_);
  point.node_slack.setOnes(constraints, steps_ + 1);
  for (Index i = 0; i < steps_; ++i) {
    Index row = 0;
    for (const Bound& bound : bounds_) {
      point.step_slack(row++, i) = smallest_slack(bound.sign * (point.u(bound.control, i) - bound.value),
                                                  control_scale_[bound.control]);
    }
    for (const auto& map : s_.mixed_maps) {
      point.step_slack(row++, i) = smallest_slack(map->value(middle(point, i), data_.parameters)[0], 1.0);
    }
  }
  for (Index c = 0; c < constraints; ++c) {
    VectorXd values(steps_ + 1), z = VectorXd::Zero(n_ + k_);
    for (Index i = 0; i <= steps_; ++i) {
      z.head(n_) = point.q.col(i);
      values[i] = s_.constraints[place(c)].map->value(z, data_.parameters)[0];
    }
    const double size = values.cwiseAbs().maxCoeff();
    for (Index i = 0; i <= steps_; ++i) point.node_slack(c, i) = smallest_slack(values[i], size > 0.0 ? size : 1.0);
  }
  point.step_multiplier = barrier * point.step_slack.cwiseInverse();
  point.node_multiplier = barrier * point.node_slack.cwiseInverse();
  for (Index c = 0; c < constraints; ++c) {
    for (const Index node : {Index{0}, steps_}) {
      if (imposed(c, node)) continue;
      point.node_slack(c, node) = 1.0;
      point.node_multiplier(c, node) = 0.0;
    }
  }
  point.end_multiplier.setZero(static_cast<Index>(fixed_end_.size() + s_.end_conditions.size()));
  return point;
}

Merit Transcription::merit(const DirectPoint& point, double barrier) const {
  Merit merit;
  const double h = time(point) / static_cast<double>(steps_);
  double logarithms = 0.0;
  for (Index i = 0; i < steps_; ++i) {
    const VectorXd z = middle(point, i), f = s_.system->value(z, data_.parameters);
    merit.cost += h * f[n_];
    merit.infeasibility += (point.q.col(i + 1) - point.q.col(i) - h * f.head(n_)).cwiseQuotient(state_scale_).lpNorm<1>();
    Index row = 0;
    const auto inequality = [&](double value, double scale) {
      const double slack = point.step_slack(row++, i);
      merit.infeasibility += std::abs(value + slack) / scale;
      logarithms += std::log(slack);
    };
    for (const Bound& b : bounds_) inequality(b.sign * (point.u(b.control, i) - b.value), control_scale_[b.control]);
    for (const auto& map : s_.mixed_maps) inequality(map->value(z, data_.parameters)[0], 1.0);
  }
  VectorXd z = VectorXd::Zero(n_ + k_);
  for (Index i = 0; i <= steps_; ++i) {
    z.head(n_) = point.q.col(i);
    for (Index c = 0; c < point.node_slack.rows(); ++c) {
      if (!imposed(c, i)) continue;
      const double slack = point.node_slack(c, i);
      merit.infeasibility += std::abs(s_.constraints[place(c)].map->value(z, data_.parameters)[0] + slack);
      logarithms += std::log(slack);
    }
  }
  Expansion at;
  expand_ends(point, at);
  merit.cost += at.end_cost;
  for (Index j = 0; j < at.end_value.size(); ++j) {
    const bool state = place(j) < fixed_end_.size();
    merit.infeasibility += std::abs(at.end_value[j]) / (state ? state_scale_[fixed_end_[place(j)]] : 1.0);
  }
  merit.barrier = merit.cost - barrier * logarithms;
  check(std::isfinite(merit.barrier) && std::isfinite(merit.infeasibility));
  return merit;
}

void Transcription::expand_ends(const DirectPoint& point, Expansion& at) const {
  const auto fixed = static_cast<Index>(fixed_end_.size()), conditions = static_cast<Index>(s_.end_conditions.size());
  at.end_gradient.setZero(size_);
  at.end_hessian.setZero(size_, size_);
  at.end_value.resize(fixed + conditions);
  at.end_jacobian.setZero(fixed + conditions, size_);
  for (Index j = 0; j < fixed; ++j) {
    const Index i = fixed_end_[place(j)];
    at.end_value[j] = point.q(i, steps_) - *data_.end[place(i)];
    at.end_jacobian(j, i) = 1.0;
  }
  if (!s_.terminal_cost && conditions == 0) return;
  const Index log_time = n_, first = n_ + (s_.free_time ? 1 : 0);
  std::vector<Jet> x;
  for (Index i = 0; i < n_; ++i) x.emplace_back(point.q(i, 0));
  for (std::size_t j = 0; carries_start_ && j < free_start_.size(); ++j) {
    const Index i = free_start_[j];
    x[place(i)] = Jet::variable(point.q(i, 0), static_cast<int>(first) + static_cast<int>(j));
  }
  for (Index i = 0; i < n_; ++i) x.push_back(Jet::variable(point.q(i, steps_), static_cast<int>(i)));
  const double t = time(point);
  const Jet final_time = s_.free_time ? Jet::variable(t, static_cast<int>(log_time), t) : Jet(t);
  x.push_back(final_time);
  for (const double p : data_.parameters) x.emplace_back(p);
  const auto add = [&](const EndFunction& f, double weight, auto&& gradient) {
    const EndFunction::Expansion e = f.at(x);
    const auto entry = [&](Index row, const Jet& slope) {
      gradient[row] += slope.value;
      for (const Jet::Entry& second : slope.gradient()) at.end_hessian(row, second.column) += weight * second.derivative;
    };
    for (Index i = 0; i < n_; ++i) entry(i, e.end[place(i)]);
    if (s_.free_time) entry(log_time, e.time * final_time);
    for (std::size_t j = 0; carries_start_ && j < free_start_.size(); ++j) {
      entry(first + static_cast<Index>(j), e.start[place(free_start_[j])]);
    }
    return e.value.value;
  };
  if (s_.terminal_cost) at.end_cost = add(*s_.terminal_cost, 1.0, at.end_gradient);
  for (Index j = 0; j < conditions; ++j) {
    VectorXd gradient = VectorXd::Zero(size_);
    at.end_value[fixed + j] = add(*s_.end_conditions[place(j)].second, point.end_multiplier[fixed + j], gradient);
    at.end_jacobian.row(fixed + j) = gradient;
  }
}

Transcription::Expansion Transcription::expand(const DirectPoint& point) const {
  Expansion at;
  const auto steps = place(steps_);
  at.system.reserve(steps);
  at.mixed.resize(steps);
  at.node.resize(steps + 1);
  const Index bounds = static_cast<Index>(bounds_.size());
  for (Index i = 0; i < steps_; ++i) {
    const VectorXd z = middle(point, i);
    VectorXd weights(n_ + 1);
    weights << -point.costate.col(i), 1.0;
    at.system.push_back(s_.system->expand(z, data_.parameters, weights));
    check(at.system.back().hessian.allFinite() && at.system.back().jacobian.allFinite());
    for (Index j = 0; j < mixed_; ++j) {
      at.mixed[place(i)].push_back(
          s_.mixed_maps[place(j)]->expand(z, data_.parameters, point.step_multiplier.col(i).segment(bounds + j, 1)));
      check(at.mixed[place(i)].back().hessian.allFinite());
    }
  }
  VectorXd z = VectorXd::Zero(n_ + k_);
  for (Index i = 0; i <= steps_; ++i) {
    z.head(n_) = point.q.col(i);
    for (Index c = 0; c < point.node_slack.rows(); ++c) {
      at.node[place(i)].push_back(
          s_.constraints[place(c)].map->expand(z, data_.parameters, point.node_multiplier.col(i).segment(c, 1)));
      check(at.node[place(i)].back().hessian.allFinite());
    }
  }
  expand_ends(point, at);
  check(at.end_hessian.allFinite() && at.end_jacobian.allFinite());
  return at;
}

double Transcription::error(const DirectPoint& point, const Expansion& at, double barrier) const {
  const double h = time(point) / static_cast<double>(steps_);
  MatrixXd by_q = MatrixXd::Zero(n_, steps_ + 1);
  double worst = 0.0, by_time = 0.0;
  const auto complementary = [&](double slack, double multiplier) {
    worst = std::max(worst, std::abs(slack * multiplier - barrier));
  };
  for (Index i = 0; i < steps_; ++i) {
    const SmoothMap::Expansion& e = at.system[place(i)];
    VectorXd weights(n_ + 1);
    weights << -point.costate.col(i), 1.0;
    VectorXd gradient = h * e.jacobian.transpose() * weights;
    by_time += h * weights.dot(e.value);
    Index row = 0;
    for (const Bound& b : bounds_) {
      gradient[n_ + b.control] += b.sign * point.step_multiplier(row, i);
      complementary(point.step_slack(row, i), point.step_multiplier(row, i));
      ++row;
    }
    for (const auto& map : at.mixed[place(i)]) {
      gradient += point.step_multiplier(row, i) * map.jacobian.row(0).transpose();
      complementary(point.step_slack(row, i), point.step_multiplier(row, i));
      ++row;
    }
    worst = std::max(worst, gradient.tail(k_).cwiseProduct(control_scale_).cwiseAbs().maxCoeff());
    by_q.col(i) += 0.5 * gradient.head(n_) - point.costate.col(i);
    by_q.col(i + 1) += 0.5 * gradient.head(n_) + point.costate.col(i);
  }
  for (Index i = 0; i <= steps_; ++i) {
    for (Index c = 0; c < point.node_slack.rows(); ++c) {
      if (!imposed(c, i)) continue;
      by_q.col(i) += point.node_multiplier(c, i) * at.node[place(i)][place(c)].jacobian.row(0).head(n_).transpose();
      complementary(point.node_slack(c, i), point.node_multiplier(c, i));
    }
  }
  const VectorXd ends = at.end_gradient + at.end_jacobian.transpose() * point.end_multiplier;
  by_q.col(steps_) += ends.head(n_);
  const Index first = n_ + (s_.free_time ? 1 : 0);
  for (std::size_t j = 0; carries_start_ && j < free_start_.size(); ++j)
    by_q(free_start_[j], 0) += ends[first + static_cast<Index>(j)];
  for (Index i = 0; i < n_; ++i) {
    if (data_.start[place(i)]) by_q(i, 0) = 0.0;
  }
  worst = std::max(worst, (state_scale_.asDiagonal() * by_q).cwiseAbs().maxCoeff()) * static_cast<double>(steps_);
  if (s_.free_time) worst = std::max(worst, std::abs(by_time + ends[n_]));
  return worst / std::max(1.0, (state_scale_.asDiagonal() * point.costate).cwiseAbs().maxCoeff());
}

Transcription::Quadratic Transcription::step_model(const DirectPoint& point, const Expansion& at, Index i,
                                                   double barrier) const {
  const double h = time(point) / static_cast<double>(steps_);
  const Index size = n_ + k_ + (s_.free_time ? 1 : 0);
  const SmoothMap::Expansion& e = at.system[place(i)];
  Quadratic model{VectorXd::Zero(size), VectorXd::Zero(size), MatrixXd::Zero(size, size)};
  model.cost_gradient.head(n_ + k_) = h * e.jacobian.row(n_).transpose();
  model.hessian.topLeftCorner(n_ + k_, n_ + k_) = h * e.hessian;
  if (s_.free_time) {
    VectorXd weights(n_ + 1);
    weights << -point.costate.col(i), 1.0;
    const VectorXd mixed = h * e.jacobian.transpose() * weights;
    model.cost_gradient[n_ + k_] = h * e.value[n_];
    model.hessian.topRightCorner(n_ + k_, 1) = mixed;
    model.hessian.bottomLeftCorner(1, n_ + k_) = mixed.transpose();
    model.hessian(n_ + k_, n_ + k_) = h * weights.dot(e.value);
  }
  model.gradient = model.cost_gradient;
  Index row = 0;
  const auto coefficients = [&](double value) {
    const double s = point.step_slack(row, i), eta = point.step_multiplier(row, i);
    ++row;
    return std::pair{(barrier + eta * (value + s)) / s, eta / s};
  };
  for (const Bound& b : bounds_) {
    const auto [slope, curvature] = coefficients(b.sign * (point.u(b.control, i) - b.value));
    model.gradient[n_ + b.control] += b.sign * slope;
    model.hessian(n_ + b.control, n_ + b.control) += curvature;
  }
  for (const auto& map : at.mixed[place(i)]) {
    const auto [slope, curvature] = coefficients(map.value[0]);
    model.gradient.head(n_ + k_) += slope * map.jacobian.row(0).transpose();
    model.hessian.topLeftCorner(n_ + k_, n_ + k_) += curvature * map.jacobian.transpose() * map.jacobian + map.hessian;
  }
  return model;
}

}  // namespace costate
