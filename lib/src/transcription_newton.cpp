#include "transcription.hpp"

#include <Eigen/LU>

namespace costate {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

std::size_t place(Index i) { return static_cast<std::size_t>(i); }

}  // namespace

void Transcription::add_node_model(const DirectPoint& point, const Expansion& at, Index i, double barrier,
                                   VectorXd& gradient, MatrixXd& hessian) const {
  for (Index c = 0; c < point.node_slack.rows(); ++c) {
    if (!imposed(c, i)) continue;
    const SmoothMap::Expansion& e = at.node[place(i)][place(c)];
    const double s = point.node_slack(c, i), eta = point.node_multiplier(c, i);
    const VectorXd slope = e.jacobian.row(0).head(n_).transpose();
    gradient.head(n_) += (barrier + eta * (e.value[0] + s)) / s * slope;
    hessian.topLeftCorner(n_, n_) += eta / s * slope * slope.transpose() + e.hessian.topLeftCorner(n_, n_);
  }
}

std::optional<Transcription::Newton> Transcription::newton(const DirectPoint& point, const Expansion& at, double barrier,
                                                           double shift) const {
  const Index first = n_ + (s_.free_time ? 1 : 0);
  const Index varied = n_ + k_ + (s_.free_time ? 1 : 0);  // z = (q̄, u, log T)
  const double h = time(point) / static_cast<double>(steps_);
  const double share = shift / static_cast<double>(steps_);
  const VectorXd state_shift = share * state_scale_.cwiseAbs2().cwiseInverse();
  const VectorXd control_shift = share * control_scale_.cwiseAbs2().cwiseInverse();

  struct Step {
    Quadratic model;
    MatrixXd zx, zu, inverse;  // z = zx·x + zu·u + offset; E⁻¹
    VectorXd offset;
  };
  std::vector<Step> steps;
  steps.reserve(place(steps_));
  LinearQuadratic lq;
  lq.stages.resize(place(steps_));
  const MatrixXd unit = MatrixXd::Identity(n_, n_);
  for (Index i = 0; i < steps_; ++i) {
    Step step{step_model(point, at, i, barrier),
              MatrixXd::Zero(varied, size_),
              MatrixXd::Zero(varied, k_),
              {},
              VectorXd::Zero(varied)};
    const SmoothMap::Expansion& e = at.system[place(i)];
    const MatrixXd fq = e.jacobian.topLeftCorner(n_, n_), fu = e.jacobian.block(0, n_, n_, k_);
    step.inverse = (unit - 0.5 * h * fq).inverse();
    LinearQuadratic::Stage& stage = lq.stages[place(i)];
    stage.a = MatrixXd::Identity(size_, size_);
    stage.a.topLeftCorner(n_, n_) = step.inverse * (unit + 0.5 * h * fq);
    if (s_.free_time) stage.a.block(0, n_, n_, 1) = h * step.inverse * e.value.head(n_);
    stage.b = MatrixXd::Zero(size_, k_);
    stage.b.topRows(n_) = h * step.inverse * fu;
    stage.offset = VectorXd::Zero(size_);
    stage.offset.head(n_) = -step.inverse * (point.q.col(i + 1) - point.q.col(i) - h * e.value.head(n_));

    step.zx.topRows(n_) = 0.5 * stage.a.topRows(n_);
    step.zx.topLeftCorner(n_, n_) += 0.5 * unit;
    step.zu.topRows(n_) = 0.5 * stage.b.topRows(n_);
    step.zu.block(n_, 0, k_, k_).setIdentity();
    step.offset.head(n_) = 0.5 * stage.offset.head(n_);
    if (s_.free_time) step.zx(n_ + k_, n_) = 1.0;

    const MatrixXd& w = step.model.hessian;
    const VectorXd gradient = step.model.gradient + w * step.offset;
    stage.q = step.zx.transpose() * w * step.zx;
    stage.s = step.zu.transpose() * w * step.zx;
    stage.r = step.zu.transpose() * w * step.zu;
    stage.r.diagonal() += control_shift;
    stage.q.diagonal().head(n_) += state_shift;
    stage.gradient_x = step.zx.transpose() * gradient;
    stage.gradient_u = step.zu.transpose() * gradient;
    add_node_model(point, at, i, barrier, stage.gradient_x, stage.q);
    steps.push_back(std::move(step));
  }
  VectorXd penalties = VectorXd::Constant(at.end_value.size(), penalty_);
  for (std::size_t j = 0; j < fixed_end_.size(); ++j)
    penalties[static_cast<Index>(j)] /= state_scale_[fixed_end_[j]] * state_scale_[fixed_end_[j]];
  const VectorXd pulled = point.end_multiplier + penalties.cwiseProduct(at.end_value);
  lq.end_gradient = at.end_gradient + at.end_jacobian.transpose() * pulled;
  lq.end_hessian = at.end_hessian + at.end_jacobian.transpose() * penalties.asDiagonal() * at.end_jacobian;
  lq.end_hessian.diagonal().head(n_) += state_shift;
  for (Index j = n_; j < size_; ++j) lq.end_hessian(j, j) += shift;
  add_node_model(point, at, steps_, barrier, lq.end_gradient, lq.end_hessian);
  const auto free = static_cast<Index>(free_start_.size());
  lq.freedom = MatrixXd::Zero(size_, free + (s_.free_time ? 1 : 0));
  for (Index j = 0; j < free; ++j) {
    lq.freedom(free_start_[place(j)], j) = 1.0;
    if (carries_start_) lq.freedom(first + j, j) = 1.0;
  }
  if (s_.free_time) lq.freedom(n_, free) = 1.0;

  LinearQuadraticSolution solved;
  if (!solve(lq, solved)) return std::nullopt;

  Newton newton;
  DirectPoint& d = newton.direction;
  d.q.resize(n_, steps_ + 1);
  d.u.resize(k_, steps_);
  d.costate.resize(n_, steps_);
  d.step_slack.resizeLike(point.step_slack);
  d.step_multiplier.resizeLike(point.step_multiplier);
  d.node_slack.setZero(point.node_slack.rows(), steps_ + 1);
  d.node_multiplier.setZero(point.node_slack.rows(), steps_ + 1);
  for (Index i = 0; i <= steps_; ++i) d.q.col(i) = solved.x[place(i)].head(n_);
  d.log_time = s_.free_time ? solved.x[0][n_] : 0.0;
  // ds and dη of an inequality with value c, whose linear part moves by `change`.
  const auto inequality = [&](double c, double change, double s, double eta, double& ds, double& deta) {
    ds = -(c + s) - change;
    deta = (barrier - eta * ds) / s - eta;
    newton.slope -= barrier * ds / s;
  };
  for (Index i = 0; i < steps_; ++i) {
    const Step& step = steps[place(i)];
    d.u.col(i) = solved.u[place(i)];
    const VectorXd dz = step.zx * solved.x[place(i)] + step.zu * solved.u[place(i)] + step.offset;
    const VectorXd slope = (step.model.gradient + step.model.hessian * dz).head(n_);
    d.costate.col(i) = -step.inverse.transpose() * (solved.slope[place(i + 1)].head(n_) + 0.5 * slope) -
                       point.costate.col(i);
    newton.slope += step.model.cost_gradient.dot(dz);
    Index row = 0;
    for (const Bound& b : bounds_) {
      inequality(b.sign * (point.u(b.control, i) - b.value), b.sign * dz[n_ + b.control], point.step_slack(row, i),
                 point.step_multiplier(row, i), d.step_slack(row, i), d.step_multiplier(row, i));
      ++row;
    }
    for (const auto& map : at.mixed[place(i)]) {
      inequality(map.value[0], map.jacobian.row(0).dot(dz.head(n_ + k_)), point.step_slack(row, i),
                 point.step_multiplier(row, i), d.step_slack(row, i), d.step_multiplier(row, i));
      ++row;
    }
  }
  for (Index i = 0; i <= steps_; ++i) {
    for (Index c = 0; c < point.node_slack.rows(); ++c) {
      if (!imposed(c, i)) continue;
      const SmoothMap::Expansion& e = at.node[place(i)][place(c)];
      inequality(e.value[0], e.jacobian.row(0).head(n_).dot(d.q.col(i)), point.node_slack(c, i), point.node_multiplier(c, i),
                 d.node_slack(c, i), d.node_multiplier(c, i));
    }
  }
  const VectorXd& end = solved.x[place(steps_)];
  newton.slope += at.end_gradient.dot(end);
  d.end_multiplier = penalties.cwiseProduct(at.end_value + at.end_jacobian * end);
  if (!d.q.allFinite() || !d.u.allFinite() || !d.costate.allFinite()) return std::nullopt;
  return newton;
}

}  // namespace costate
