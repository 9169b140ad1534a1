#include "damped.hpp"

#include "staircase.hpp"

#include <costate/error.hpp>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace costate {

namespace {

/// The largest part of a step that keeps the unknowns within their limits.
double longest_step(const Problem& problem, const Eigen::VectorXd& y, const Eigen::VectorXd& step) {
  constexpr double kept = 0.1;
  double longest = 1.0;
  for (std::size_t i = 0; i < problem.unknowns().size(); ++i) {
    const Unknown& unknown = problem.unknowns()[i];
    const auto j = static_cast<Eigen::Index>(i);
    const double room = step[j] < 0.0 ? unknown.lower - y[j] : unknown.upper - y[j];
    if (std::isfinite(room) && step[j] / room > 0.0) longest = std::min(longest, (1.0 - kept) * room / step[j]);
  }
  return longest;
}

class Damped {
 public:
  Damped(Shooting& shooting, Eigen::VectorXd& y, const DampedOptions& options)
      : shooting_(shooting), y_(y), options_(options), damping_(options.first_damping) {}

  DampedResult run() {
    try {
      for (; result_.iterations < options_.max_iterations; ++result_.iterations) {
        const Shot shot = shooting_.evaluate(y_);
        const Staircase jacobian = shooting_.decompose(shot);
        const Eigen::VectorXd step = -jacobian.solve(shooting_.residual(shot));
        if (jacobian.singular() || !step.allFinite()) return failed("the Jacobian is singular");
        weights_ = shooting_.unknown_scales().cwiseMax(y_.cwiseAbs());
        if (step.cwiseQuotient(weights_).cwiseAbs().maxCoeff() <= options_.tolerance) {
          y_ += step;
          result_.converged = true;
          return result_;
        }
        predict(step);
        if (!advance(jacobian, step)) return result_;
      }
      return failed("the limit of iterations was reached");
    } catch (const LeftDomain& left) {
      result_.blocked = shooting_.failed_place();
      return failed(left.what());
    }
  }

 private:
  DampedResult failed(std::string why) {
    result_.message = std::move(why);
    return result_;
  }

  [[nodiscard]] double norm(const Eigen::VectorXd& step) const {
    return step.cwiseQuotient(weights_).norm() / std::sqrt(static_cast<double>(step.size()));
  }

  /// The damping that the nonlinearity seen between the last two corrections allows.
  void predict(const Eigen::VectorXd& step) {
    if (last_step_.size() > 0) {
      const double change = norm(last_simplified_ - step) * norm(step);
      if (change > 0.0) damping_ = std::min(1.0, damping_ * norm(last_step_) * norm(last_simplified_) / change);
    }
    damping_ = std::min(std::max(damping_, options_.least_damping), longest_step(shooting_.problem(), y_, step));
  }

  /// Takes the longest step found that passes the test.
  bool advance(const Staircase& jacobian, const Eigen::VectorXd& step) {
    const double size = norm(step);
    std::string why = "no damped step brings the solution nearer";
    std::optional<SegmentPlace> blocked;
    for (bool grown = false; damping_ >= options_.least_damping;) {
      const Eigen::VectorXd trial = y_ + damping_ * step;
      Eigen::VectorXd simplified;
      try {
        simplified = -jacobian.solve(shooting_.residual(shooting_.evaluate(trial)));
      } catch (const LeftDomain& left) {
        why = left.what();
        blocked = shooting_.failed_place();
        damping_ *= 0.5;
        continue;
      }
      const double nonlinear = norm(simplified - (1.0 - damping_) * step);
      const double allowed = 0.5 * size * damping_ * damping_ / std::max(nonlinear, 1e-300);
      if (!simplified.allFinite() || !(norm(simplified) <= (1.0 - 0.25 * damping_) * size)) {
        damping_ = std::isfinite(allowed) ? std::min(allowed, 0.5 * damping_) : 0.5 * damping_;
        blocked.reset();
        grown = true;  // a longer step has just failed
        continue;
      }
      const double longer = std::min({1.0, allowed, longest_step(shooting_.problem(), y_, step)});
      if (!grown && !blocked && longer >= 4.0 * damping_) {
        damping_ = longer;
        grown = true;
        continue;
      }
      y_ = trial;
      last_step_ = step;
      last_simplified_ = simplified;
      return true;
    }
    result_.blocked = blocked;
    result_.message = std::move(why);
    return false;
  }

  Shooting& shooting_;
  Eigen::VectorXd& y_;
  DampedOptions options_;
  double damping_;
  DampedResult result_;
  Eigen::VectorXd weights_, last_step_, last_simplified_;
};

}  // namespace

DampedResult damped_newton(Shooting& shooting, Eigen::VectorXd& y, const DampedOptions& options) {
  return Damped(shooting, y, options).run();
}

}  // namespace costate
