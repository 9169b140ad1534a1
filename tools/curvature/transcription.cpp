#include "curvature/transcription.hpp"

#include "curvature/tau_step.hpp"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace costate::curvature {

namespace {

constexpr int cell_inputs = 4;  // θ, η at both ends, length
using First = Dual<double, cell_inputs>;
using Second = Dual<First, cell_inputs>;

Second seeded(double value, int direction) { return Second::variable(First::variable(value, direction), direction); }

class Transcription {
 public:
  Transcription(const ScaledScene& scene, const ControlGuess& guess, const TranscriptionOptions& options)
      : scene_(scene), options_(options), cells_(guess.eta.size() - 1), distance_(std::hypot(scene.x, scene.y)) {
    const double whole = guess.tau.back();
    u_.resize(static_cast<Eigen::Index>(first_eta() + cells_));
    u_[0] = std::log(whole);
    if (free_slope()) u_[1] = guess.slope;
    for (std::size_t i = 0; i <= cells_; ++i) {
      if (i > 0) share_.push_back((guess.tau[i] - guess.tau[i - 1]) / whole);
      if (i < cells_) eta(u_, i) = std::max(guess.eta[i], 1e-8);
    }
  }

  Transcribed run() {
    Transcribed result;
    double begin = 0.0;
    for (std::size_t i = 0; i < cells_; ++i) {
      const double around = i == 0            ? 0.5 * share_[0]
                            : i + 1 == cells_ ? 0.5 * share_[i - 1] + share_[i]
                                              : 0.5 * (share_[i - 1] + share_[i]);
      weight_.push_back(around * (1.0 - begin));
      begin += share_[i];
    }
    Values now = values(u_);
    if (!std::isfinite(now.time)) return result;
    barrier_ = first_barrier;
    bound_.resize(static_cast<Eigen::Index>(cells_));
    for (std::size_t i = 0; i < cells_; ++i) bound_[static_cast<Eigen::Index>(i)] = barrier(i) / eta(u_, i);
    reference_ = now.time;
    for (int i = 0; i < options_.max_iterations; ++i) {
      ++result.iterations;
      derivatives();
      const double error = optimality(now);
      if (error < std::max(10.0 * barrier_, 1e-8)) {
        if (barrier_ <= smallest_barrier) {
          result.converged = true;
          break;
        }
        barrier_ = std::max(smallest_barrier, std::min(0.2 * barrier_, std::pow(barrier_, 1.5)));
        reference_ = now.time;
        continue;
      }
      if (!advance(now)) break;
    }
    fill(now, result);
    return result;
  }

 private:
  static constexpr double first_barrier = 0.01, smallest_barrier = 1e-8;

  struct Values {
    double time = 0.0, y = 0.0;
    Eigen::VectorXd miss;  ///< of x and, unless the highest point is sought, y
  };

  [[nodiscard]] bool highest() const { return options_.goal == Goal::highest; }
  [[nodiscard]] Eigen::Index constraints() const { return highest() ? 1 : 2; }
  /// The weight of time in the objective. Where height is sought, a little of it keeps the motion from creeping to its end for ever.
  [[nodiscard]] double time_weight() const { return (highest() ? 1e-2 : 1.0) / reference_; }
  [[nodiscard]] double height_weight() const { return highest() ? 1.0 / distance_ : 0.0; }
  [[nodiscard]] double objective(const Values& v) const { return time_weight() * v.time - height_weight() * v.y; }

  [[nodiscard]] bool free_slope() const { return !scene_.slope; }
  [[nodiscard]] std::size_t first_eta() const { return free_slope() ? 2 : 1; }
  double& eta(Eigen::VectorXd& u, std::size_t i) const { return u[static_cast<Eigen::Index>(first_eta() + i)]; }
  [[nodiscard]] double eta(const Eigen::VectorXd& u, std::size_t i) const {
    return u[static_cast<Eigen::Index>(first_eta() + i)];
  }
  /// The node at which cell k ends. η is constant in the last one: at the very end it moves neither place nor time.
  [[nodiscard]] std::size_t after(std::size_t k) const { return std::min(k + 1, cells_ - 1); }
  [[nodiscard]] double slope(const Eigen::VectorXd& u) const { return scene_.slope ? *scene_.slope : u[1]; }

  [[nodiscard]] Values values(const Eigen::VectorXd& u) const {
    Values r;
    double theta = slope(u), log_v = 0.0, x = 0.0, y = 0.0;
    const double whole = std::exp(u[0]);
    for (std::size_t k = 0; k < cells_; ++k) {
      const auto s = step(theta, eta(u, k), eta(u, after(k)), share_[k] * whole, scene_.mu, scene_.beta);
      const double v = std::exp(log_v);
      x += v * v * s.x;
      y += v * v * s.y;
      r.time += v * s.t;
      // A control that leaves what one step can follow is none.
      if (!(std::abs(s.log_v) < 2.0 && std::abs(s.theta - theta) < 2.0)) r.time = std::numeric_limits<double>::infinity();
      log_v += s.log_v;
      theta = s.theta;
    }
    r.y = y;
    r.miss = (Eigen::Vector2d(x - scene_.x, y - scene_.y) / distance_).head(constraints());
    return r;
  }

  /// Motion, gradients of time and miss, and the Hessian of the Lagrangian objective + ν·miss.
  void derivatives() {
    const Eigen::Index n = u_.size();
    const double whole = std::exp(u_[0]);
    motion_.assign(cells_ + 1, {slope(u_), 0.0, 0.0, 0.0, 0.0});
    steps_.clear();
    // Rows: θ, ln v, x, y, t; columns: unknowns.
    Eigen::Matrix<double, 5, Eigen::Dynamic> s = Eigen::Matrix<double, 5, Eigen::Dynamic>::Zero(5, n);
    if (free_slope()) s(0, 1) = 1.0;
    tangents_.assign(1, s.topRows<2>());
    for (std::size_t k = 0; k < cells_; ++k) {
      const Step<double>& at = motion_[k];
      const auto c = step(seeded(at.theta, 0), seeded(eta(u_, k), 1), seeded(eta(u_, after(k)), 2),
                          seeded(share_[k] * whole, 3), scene_.mu, scene_.beta);
      const double v = std::exp(at.log_v);
      const auto a = static_cast<Eigen::Index>(first_eta() + k), b = static_cast<Eigen::Index>(first_eta() + after(k));
      const auto row = [&](const Second& out) {
        Eigen::RowVectorXd r = out.gradient[0].value * s.row(0);
        r[a] += out.gradient[1].value;
        r[b] += out.gradient[2].value;
        r[0] += out.gradient[3].value * share_[k] * whole;
        return r;
      };
      const Eigen::RowVectorXd theta = row(c.theta), log_v = row(c.log_v);
      s.row(2) += v * v * (row(c.x) + 2.0 * c.x.value.value * s.row(1));
      s.row(3) += v * v * (row(c.y) + 2.0 * c.y.value.value * s.row(1));
      s.row(4) += v * (row(c.t) + c.t.value.value * s.row(1));
      s.row(1) += log_v;
      s.row(0) = theta;
      tangents_.push_back(s.topRows<2>());
      motion_[k + 1] = {c.theta.value.value, at.log_v + c.log_v.value.value, at.x + v * v * c.x.value.value,
                        at.y + v * v * c.y.value.value, at.t + v * c.t.value.value};
      steps_.push_back(c);
    }
    gradient_ = time_weight() * s.row(4).transpose() - height_weight() * s.row(3).transpose();
    constraint_ = s.middleRows(2, constraints()) / distance_;
    // Least-squares multipliers at first, Newton's afterwards.
    if (multiplier_.size() == 0) {
      Eigen::VectorXd g = gradient_;
      for (std::size_t i = 0; i < cells_; ++i) eta(g, i) -= bound_[static_cast<Eigen::Index>(i)];
      multiplier_ = -constraint_.transpose().colPivHouseholderQr().solve(g);
    }
    backward();
  }

  /// Adjoints from the end, and with them the Hessian, cell by cell.
  void backward() {
    const Eigen::Index n = u_.size();
    const double whole = std::exp(u_[0]);
    hessian_ = Eigen::MatrixXd::Zero(n, n);
    adjoint_.assign(cells_ + 1, {0.0, 0.0});
    Eigen::Vector2d p(0.0, 0.0);  // of θ and ln v
    double length_gradient = 0.0;
    for (std::size_t k = cells_; k-- > 0;) {
      const Step<Second>& c = steps_[k];
      const double v = std::exp(motion_[k].log_v);
      const double wx = multiplier_[0] / distance_ * v * v, wt = v * time_weight();
      const double wy = v * v * (highest() ? -height_weight() : multiplier_[1] / distance_);
      const First fx = c.x.value * wx + c.y.value * wy, ft = c.t.value * wt;
      Eigen::Matrix<double, 5, 5> second;  // θ, η, η, length; ln v
      Eigen::Matrix<double, 5, 1> first;
      for (std::size_t i = 0; i < 4; ++i) {
        const auto row = static_cast<Eigen::Index>(i);
        for (std::size_t j = 0; j < 4; ++j) {
          const auto entry = [&](const Second& out) { return out.gradient[i].gradient[j]; };
          second(row, static_cast<Eigen::Index>(j)) = wx * entry(c.x) + wy * entry(c.y) + wt * entry(c.t) +
                                                      p[0] * entry(c.theta) + p[1] * entry(c.log_v);
        }
        second(row, 4) = second(4, row) = 2.0 * fx.gradient[i] + ft.gradient[i];
        first[row] = fx.gradient[i] + ft.gradient[i] + p[0] * c.theta.gradient[i].value + p[1] * c.log_v.gradient[i].value;
      }
      second(4, 4) = 4.0 * fx.value + ft.value;
      first[4] = 2.0 * fx.value + ft.value + p[1];
      const double scale = share_[k] * whole;  // ∂length/∂ ln(whole)
      const auto a = static_cast<Eigen::Index>(first_eta() + k), b = static_cast<Eigen::Index>(first_eta() + after(k));
      Eigen::Matrix<double, 5, Eigen::Dynamic> m = Eigen::Matrix<double, 5, Eigen::Dynamic>::Zero(5, b + 1);
      m.row(0).head(a + 1) = tangents_[k].row(0).head(a + 1);  // later columns do not move the start of the cell
      m.row(4).head(a + 1) = tangents_[k].row(1).head(a + 1);
      m(1, a) = 1.0;
      m(2, b) = 1.0;
      m(3, 0) += scale;
      hessian_.topLeftCorner(b + 1, b + 1).noalias() += m.transpose() * (second * m);
      length_gradient += first[3] * scale;
      p = Eigen::Vector2d(first[0], first[4]);
      adjoint_[k] = p;
    }
    hessian_(0, 0) += length_gradient;  // length = share · exp(u₀)
  }

  /// The barrier at a node weighs as much as η does there: by the cell's length, and by λv v, which falls to 0 at the end.
  [[nodiscard]] double barrier(std::size_t i) const { return barrier_ * weight_[i]; }

  [[nodiscard]] double optimality(const Values& now) const {
    Eigen::VectorXd g = gradient_ + constraint_.transpose() * multiplier_;
    double complementarity = 0.0;
    for (std::size_t i = 0; i < cells_; ++i) {
      eta(g, i) -= bound_[static_cast<Eigen::Index>(i)];
      complementarity = std::max(complementarity, std::abs(bound_[static_cast<Eigen::Index>(i)] * eta(u_, i) - barrier(i)));
    }
    return std::max({g.cwiseAbs().maxCoeff(), complementarity, now.miss.cwiseAbs().maxCoeff()});
  }

  [[nodiscard]] double merit(const Eigen::VectorXd& u, const Values& v, double penalty) const {
    double logs = 0.0;
    for (std::size_t i = 0; i < cells_; ++i) logs += weight_[i] * std::log(eta(u, i));
    return objective(v) - barrier_ * logs + penalty * v.miss.lpNorm<1>();
  }

  /// One step of the primal–dual method. False where no step descends.
  bool advance(Values& now) {
    const Eigen::Index n = u_.size();
    Eigen::MatrixXd h = hessian_;
    Eigen::VectorXd g = gradient_;  // of the barrier function
    for (std::size_t i = 0; i < cells_; ++i) {
      const auto place = static_cast<Eigen::Index>(first_eta() + i);
      h(place, place) += bound_[static_cast<Eigen::Index>(i)] / u_[place];
      g[place] -= barrier(i) / u_[place];
    }
    const Eigen::HouseholderQR<Eigen::MatrixXd> qr(constraint_.transpose());
    const Eigen::MatrixXd q = qr.householderQ() * Eigen::MatrixXd::Identity(n, n);
    const Eigen::Index m = constraints();
    const Eigen::MatrixXd range = q.leftCols(m), null = q.rightCols(n - m);
    const Eigen::MatrixXd r = qr.matrixQR().topLeftCorner(m, m).triangularView<Eigen::Upper>();
    Eigen::VectorXd normal = range * r.transpose().triangularView<Eigen::Lower>().solve(-now.miss);
    // Far from the end point its linearisation is worth little.
    constexpr double longest = 1.0;
    double shortened = 1.0;
    if (normal.norm() > longest) shortened = longest / normal.norm();
    normal *= shortened;
    const Eigen::MatrixXd reduced = null.transpose() * h * null;
    const Eigen::VectorXd slope = null.transpose() * (g + h * normal);
    Eigen::LLT<Eigen::MatrixXd> factor;
    double shift = 0.0;
    const double size = std::max(1e-8, reduced.diagonal().cwiseAbs().maxCoeff());
    while (true) {
      factor.compute(reduced + shift * Eigen::MatrixXd::Identity(n - m, n - m));
      if (factor.info() == Eigen::Success) break;
      shift = shift == 0.0 ? std::max(1e-8 * size, last_shift_ / 4.0) : 8.0 * shift;
      if (!(shift < 1e12 * size)) return false;
    }
    last_shift_ = shift;
    const Eigen::VectorXd direction = normal - null * factor.solve(slope);
    const Eigen::VectorXd force = -(g + h * direction + shift * (direction - normal));
    const Eigen::VectorXd multiplier = r.triangularView<Eigen::Upper>().solve(range.transpose() * force);

    double primal = 1.0, dual = 1.0;
    const double keep = std::max(0.9, 1.0 - barrier_);
    Eigen::VectorXd bound_direction(bound_.size());
    for (std::size_t i = 0; i < cells_; ++i) {
      const auto j = static_cast<Eigen::Index>(i);
      const double e = eta(u_, i), d = eta(direction, i);
      bound_direction[j] = barrier(i) / e - bound_[j] - bound_[j] / e * d;
      if (d < 0.0) primal = std::min(primal, -keep * e / d);
      if (bound_direction[j] < 0.0) dual = std::min(dual, -keep * bound_[j] / bound_direction[j]);
    }
    const double most = std::abs(direction[0]);
    if (primal * most > 0.7) primal = 0.7 / most;
    const double miss = now.miss.lpNorm<1>();
    const double slope_along = g.dot(direction);
    const double curvature = std::max(0.0, direction.dot(h * direction));
    if (miss > 1e-14) {
      penalty_ = std::max({penalty_, (slope_along + 0.5 * curvature) / (0.7 * shortened * miss), 1e-2});
      penalty_ = std::min(penalty_, 1e8);
    }
    const double decrease = slope_along - penalty_ * shortened * miss;
    const double before = merit(u_, now, penalty_);
    const double noise = 1e-13 * (1.0 + std::abs(before));
    for (double step = primal; step > 1e-9; step *= 0.5) {
      const Eigen::VectorXd next = u_ + step * direction;
      const Values there = values(next);
      if (!std::isfinite(there.time) || !there.miss.allFinite()) continue;
      if (merit(next, there, penalty_) > before + 1e-4 * step * decrease + noise) continue;
      u_ = next;
      now = there;
      bound_ += dual * bound_direction;
      for (std::size_t i = 0; i < cells_; ++i) {
        // The multipliers stay within a factor of what the barrier makes them.
        double& b = bound_[static_cast<Eigen::Index>(i)];
        b = std::clamp(b, 1e-6 * barrier(i) / eta(u_, i), 1e6 * barrier(i) / eta(u_, i));
      }
      multiplier_ = multiplier;
      return true;
    }
    return false;
  }

  void fill(const Values& now, Transcribed& result) const {
    result.time = now.time;
    result.miss = now.miss.norm();
    result.y = now.y;
    if (multiplier_.size() == 2) {
      result.lambda_x = -multiplier_[0] * reference_ / distance_;
      result.lambda_y = -multiplier_[1] * reference_ / distance_;
    }
    // A free slope may have been found a whole turn away: the same motion.
    const double turns = free_slope() ? 2.0 * std::numbers::pi * std::round(u_[1] / (2.0 * std::numbers::pi)) : 0.0;
    double tau = 0.0;
    for (std::size_t i = 0; i <= cells_; ++i) {
      if (i > 0) tau += share_[i - 1] * std::exp(u_[0]);
      const std::size_t own = std::min(i, cells_ - 1);
      result.nodes.push_back({tau, motion_[i].t, motion_[i].theta - turns, motion_[i].log_v, eta(u_, own),
                              -adjoint_[i][1] * reference_, -adjoint_[i][0] * reference_,
                              bound_[static_cast<Eigen::Index>(own)]});
    }
  }

  ScaledScene scene_;
  TranscriptionOptions options_;
  std::size_t cells_;
  double distance_;
  double reference_ = 1.0;
  std::vector<double> share_;   ///< of the length in τ, by cell
  std::vector<double> weight_;  ///< of the barrier, by node
  Eigen::VectorXd u_;           ///< ln of the length in τ; θ(0) if free; η at the nodes
  Eigen::VectorXd bound_;       ///< multipliers of η ≥ 0
  Eigen::VectorXd multiplier_;  ///< of the end point
  double barrier_ = first_barrier, penalty_ = 1e-2, last_shift_ = 0.0;

  std::vector<Step<double>> motion_;
  std::vector<Step<Second>> steps_;
  std::vector<Eigen::Matrix<double, 2, Eigen::Dynamic>> tangents_;
  std::vector<Eigen::Vector2d> adjoint_;
  Eigen::VectorXd gradient_;
  Eigen::MatrixXd constraint_;
  Eigen::MatrixXd hessian_;
};

}  // namespace

Transcribed transcribe(const ScaledScene& scene, const ControlGuess& guess, const TranscriptionOptions& options) {
  const auto cells = static_cast<std::size_t>(options.cells);
  ControlGuess onto{{}, {}, guess.slope, 0.0};
  std::size_t at = 0;
  for (std::size_t i = 0; i <= cells; ++i) {
    const double tau = guess.tau.back() * static_cast<double>(i) / static_cast<double>(cells);
    while (at + 2 < guess.tau.size() && guess.tau[at + 1] < tau) ++at;
    const double part = (tau - guess.tau[at]) / (guess.tau[at + 1] - guess.tau[at]);
    onto.tau.push_back(tau);
    onto.eta.push_back(std::lerp(guess.eta[at], guess.eta[at + 1], std::clamp(part, 0.0, 1.0)));
  }
  return Transcription(scene, guess.tau.size() == cells + 1 ? guess : onto, options).run();
}

ControlGuess regrid(const Transcribed& coarse, int cells) {
  const auto& nodes = coarse.nodes;
  // The cells go, in equal parts, by τ (none is much longer than the mean), by τ in contact, which may be short, and by the changes of
  // θ and of η, which may begin steeply.
  std::array<double, 4> sum{};
  std::vector<std::array<double, 4>> sums{sum};
  for (std::size_t i = 1; i < nodes.size(); ++i) {
    const TranscribedNode &a = nodes[i - 1], &b = nodes[i];
    const bool held = a.bound > a.eta && b.bound > b.eta;
    const double length = b.tau - a.tau;
    const std::array<double, 4> parts{length, held ? 0.0 : length, std::abs(b.theta - a.theta), std::abs(b.eta - a.eta)};
    for (std::size_t j = 0; j < parts.size(); ++j) sum[j] += parts[j];
    sums.push_back(sum);
  }
  std::vector<double> monitor;
  for (const auto& upto : sums) {
    monitor.push_back(0.0);
    for (std::size_t j = 0; j < sum.size(); ++j) monitor.back() += sum[j] > 0.0 ? upto[j] / sum[j] : 0.0;
  }
  ControlGuess fine{{}, {}, nodes.front().theta, coarse.miss};
  std::size_t at = 0;
  for (int j = 0; j <= cells; ++j) {
    const double wanted = monitor.back() * j / cells;
    while (at + 2 < monitor.size() && monitor[at + 1] < wanted) ++at;
    const double part = std::clamp((wanted - monitor[at]) / (monitor[at + 1] - monitor[at]), 0.0, 1.0);
    fine.tau.push_back(std::lerp(nodes[at].tau, nodes[at + 1].tau, part));
    fine.eta.push_back(std::lerp(nodes[at].eta, nodes[at + 1].eta, part));
  }
  return fine;
}

}  // namespace costate::curvature
