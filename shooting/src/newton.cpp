#include "newton.hpp"

#include <costate/error.hpp>

#include <algorithm>
#include <limits>

namespace costate {

Bounds Bounds::of(const Problem& problem) {
  const auto n = static_cast<Eigen::Index>(problem.unknowns().size());
  Bounds bounds{Eigen::VectorXd(n), Eigen::VectorXd(n)};
  for (Eigen::Index i = 0; i < n; ++i) {
    const Unknown& unknown = problem.unknowns()[static_cast<std::size_t>(i)];
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
      : system_(system), y_(y), scale_(scale), bounds_(bounds), options_(options) {}

  NewtonResult run() {
    if (!evaluate(y_)) return ended(Termination::left_domain);
    while (true) {
      residual_ = trial_;
      if (residual_.cwiseAbs().maxCoeff() <= options_.residual_tolerance) return ended(Termination::converged);
      if (result_.iterations == options_.max_iterations) return ended(Termination::iteration_limit);
      if (!system_.linearize()) return ended(Termination::left_domain);
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
  const Eigen::VectorXd& scale_;
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

DenseShooting::DenseShooting(Shooting& shooting)
    : shooting_(shooting), unknown_scales_(shooting.unknown_scales()), row_scales_(shooting.row_scales()) {}

Eigen::VectorXd DenseShooting::residual(const Eigen::VectorXd& y) {
  point_ = y;
  return shooting_.residual(shooting_.evaluate(y)).cwiseQuotient(row_scales_);
}

bool DenseShooting::linearize() {
  const Eigen::MatrixXd scaled = row_scales_.cwiseInverse().asDiagonal() * shooting_.jacobian(shooting_.evaluate(point_)) *
                                 unknown_scales_.asDiagonal();
  if (!scaled.allFinite()) return false;
  factors_.compute(scaled);
  return true;
}

Eigen::VectorXd DenseShooting::correction(const Eigen::VectorXd& r) {
  return -factors_.solve(r).cwiseProduct(unknown_scales_);
}

int DenseShooting::orientation(const Eigen::VectorXd& y) {
  try {
    residual(y);
  } catch (const LeftDomain&) {
    return 0;
  }
  if (!linearize()) return 0;
  // The sign alone: a product of pivots could overflow.
  int sign = static_cast<int>(factors_.permutationP().determinant());
  for (const double pivot : factors_.matrixLU().diagonal()) sign *= pivot > 0.0 ? 1 : pivot < 0.0 ? -1 : 0;
  return sign;
}

}  // namespace costate
