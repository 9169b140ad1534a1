#include "newton.hpp"

#include <costate/error.hpp>

#include <Eigen/LU>
#include <algorithm>
#include <limits>

namespace costate {

Bounds Bounds::of(const Shooting& shooting) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  Bounds bounds{Eigen::VectorXd::Constant(shooting.size(), -infinity), Eigen::VectorXd::Constant(shooting.size(), infinity)};
  for (Eigen::Index i = 0; i < shooting.border(); ++i) {
    const Unknown& unknown = shooting.problem().unknowns()[static_cast<std::size_t>(i)];
    bounds.lower[i] = unknown.lower;
    bounds.upper[i] = unknown.upper;
  }
  return bounds;
}

double Bounds::share(const Eigen::VectorXd& y, const Eigen::VectorXd& step) const {
  constexpr double of_the_way = 0.9;
  double share = 1.0;
  for (Eigen::Index i = 0; i < y.size(); ++i) {
    const double end = y[i] + step[i];
    if (y[i] > lower[i] && end <= lower[i]) share = std::min(share, of_the_way * (lower[i] - y[i]) / step[i]);
    if (y[i] < upper[i] && end >= upper[i]) share = std::min(share, of_the_way * (upper[i] - y[i]) / step[i]);
  }
  return share;
}

namespace {

/// One run of the method. Corrections are kept in scaled unknowns.
class NaturalNewton {
 public:
  NaturalNewton(NewtonSystem& system, Eigen::VectorXd& y, const Eigen::VectorXd& scale, const Bounds& bounds,
                const NaturalOptions& options)
      : system_(system), y_(y), least_scale_(scale), scale_(scale), bounds_(bounds), options_(options) {}

  NewtonResult run() {
    if (!evaluate(y_)) return ended(Termination::left_domain);
    while (true) {
      residual_ = trial_;
      if (residual_.cwiseAbs().maxCoeff() <= options_.residual_tolerance) return ended(Termination::converged);
      if (result_.iterations == options_.max_iterations) return ended(Termination::iteration_limit);
      if (!system_.linearize()) return ended(Termination::left_domain);
      if (options_.relative) rescale();
      step_ = correction(residual_);
      length_ = step_.norm();
      if (!std::isfinite(length_)) return ended(Termination::singular_jacobian);
      if (length_ <= options_.step_tolerance) return ended(Termination::converged);
      if (!advance()) {
        if (length_ <= options_.noise) return ended(Termination::small_step);
        return ended(left_ ? Termination::left_domain : Termination::stalled);
      }
      ++result_.iterations;
    }
  }

 private:
  bool evaluate(const Eigen::VectorXd& y) {
    ++result_.residual_evaluations;
    try {
      trial_ = system_.residual(y);
    } catch (const LeftDomain& failure) {
      result_.message = failure.what();
      return false;
    }
    return trial_.allFinite();
  }

  /// Measures lengths at the present point, those of the last step included.
  void rescale() {
    const Eigen::VectorXd before = scale_;
    scale_ = least_scale_.cwiseMax(y_.cwiseAbs());
    if (last_.damping == 0.0) return;
    const Eigen::VectorXd ratio = before.cwiseQuotient(scale_);
    simplified_ = simplified_.cwiseProduct(ratio);
    last_.length = step_.cwiseProduct(ratio).norm();
  }

  [[nodiscard]] Eigen::VectorXd correction(const Eigen::VectorXd& r) { return system_.correction(r).cwiseQuotient(scale_); }

  NewtonResult ended(Termination termination) {
    result_.termination = termination;
    result_.residual_norm = residual_.norm();
    return result_;
  }

  /// Finds an admissible damping of the step and takes it.
  bool advance() {
    const double longest = std::min(options_.max_step / length_, bounds_.share(y_, step_.cwiseProduct(scale_)));
    double damping = std::min(predicted(), longest);
    bool reduced = false;
    left_ = false;
    while (damping >= options_.least_damping) {
      const Eigen::VectorXd next = y_ + damping * step_.cwiseProduct(scale_);
      left_ = !evaluate(next);
      if (left_) {
        damping *= 0.5;
        reduced = true;
        continue;
      }
      simplified_ = correction(trial_);
      const double curvature = (simplified_ - (1.0 - damping) * step_).norm();
      const double corrected = curvature > 0.0 ? 0.5 * damping * damping * length_ / curvature : longest;
      if (!(simplified_.norm() <= (1.0 - 0.25 * damping) * length_)) {
        damping = std::min(corrected, 0.5 * damping);
        reduced = true;
        continue;
      }
      if (const double wider = std::min({1.0, corrected, longest}); wider >= 4.0 * damping && !reduced) {
        damping = wider;
        continue;
      }
      y_ = next;
      last_ = Last{damping, length_};
      return true;
    }
    return false;
  }

  /// The damping that the last step's change of correction suggests for this one.
  [[nodiscard]] double predicted() const {
    if (last_.damping == 0.0) return 1.0;
    const double change = (simplified_ - step_).norm() * length_;
    if (!(change > 0.0)) return 1.0;
    return std::clamp(last_.damping * last_.length * simplified_.norm() / change, options_.least_damping, 1.0);
  }

  struct Last {
    double damping = 0.0, length = 0.0;
  };

  NewtonSystem& system_;
  Eigen::VectorXd& y_;
  const Eigen::VectorXd& least_scale_;
  Eigen::VectorXd scale_;
  const Bounds& bounds_;
  const NaturalOptions& options_;
  NewtonResult result_;
  Eigen::VectorXd residual_, trial_, step_, simplified_;
  double length_ = 0.0;
  bool left_ = false;
  Last last_;
};

}  // namespace

NewtonResult natural_newton(NewtonSystem& system, Eigen::VectorXd& y, const Eigen::VectorXd& scale, const Bounds& bounds,
                            const NaturalOptions& options) {
  return NaturalNewton(system, y, scale, bounds, options).run();
}

Eigen::VectorXd ShootingSystem::residual(const Eigen::VectorXd& y) {
  point_ = y;
  return shooting_.residual(shooting_.evaluate(y, {}, Extent::equations)).cwiseQuotient(row_scales_);
}

bool ShootingSystem::linearize() {
  factors_.emplace(shooting_.decompose(shooting_.evaluate(point_, {}, Extent::equations)));
  return true;
}

Eigen::VectorXd ShootingSystem::correction(const Eigen::VectorXd& r) {
  return -factors_->solve(r.cwiseProduct(row_scales_));
}

int ShootingSystem::orientation(const Eigen::VectorXd& y) {
  Eigen::MatrixXd scaled(y.size(), y.size());
  try {
    shooting_.jacobian(y, scaled);
  } catch (const LeftDomain&) {
    return 0;
  }
  scaled = row_scales_.cwiseInverse().asDiagonal() * scaled * unknown_scales_.asDiagonal();
  if (!scaled.allFinite()) return 0;
  const Eigen::PartialPivLU<Eigen::MatrixXd> factors(scaled);
  // The sign alone: a product of pivots could overflow.
  int sign = static_cast<int>(factors.permutationP().determinant());
  for (const double pivot : factors.matrixLU().diagonal()) sign *= pivot > 0.0 ? 1 : pivot < 0.0 ? -1 : 0;
  return sign;
}

}  // namespace costate
