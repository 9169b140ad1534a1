#include "factors.hpp"
#include "locating.hpp"
#include "newton.hpp"

#include <costate/error.hpp>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace costate {

namespace {

constexpr double margin = 0.25;            // a predicted error is trusted up to this share of the accuracy
constexpr double least_contraction = 0.3;  // c is not believed to be smaller
constexpr double least_damping = 1e-4;
constexpr double tightest = 1e-15;

void check(const LocateOptions& options) {
  const auto positive = [](const char* name, double value) {
    if (!(value > 0.0 && std::isfinite(value)))
      throw BadInput(fmt::format("{} = {:g} is not admissible: a positive number", name, value));
  };
  positive("accuracy", options.accuracy);
  positive("first_tolerance", options.first_tolerance);
  positive("tolerance_per_accuracy", options.tolerance_per_accuracy);
  positive("max_step", options.max_step);
  if (options.max_iterations < 1)
    throw BadInput(fmt::format("max_iterations = {} is not admissible: 1 or more", options.max_iterations));
  if (options.max_steps < 1) throw BadInput(fmt::format("max_steps = {} is not admissible: 1 or more", options.max_steps));
}

}  // namespace

class Locator::Search {
 public:
  Search(Shooting& shooting, const LocateOptions& options) : shooting_(shooting), options_(options) {
    check(options);
    constexpr double of_multistep = 0.1;
    wanted_ = options.tolerance_per_accuracy * (options.method == Method::runge_kutta ? 1.0 : of_multistep);
    last_tolerance_ = std::max(tightest, wanted_ * options.accuracy);
  }

  Located find(const Eigen::Ref<const Eigen::VectorXd>& start) {
    begin(start);
    contraction_ = 1.0;
    measured_ = false;
    set_tolerance(std::max(last_tolerance_, options_.first_tolerance));
    if (!evaluate(y_, true)) return ended(Termination::left_domain);
    while (true) {
      if (result_.iterations == options_.max_iterations) return ended(Termination::iteration_limit);
      residual_.swap(trial_);
      factorise(y_);
      factors_.correction(residual_, step_);
      length_ = length(step_);
      if (!std::isfinite(length_)) return ended(Termination::singular_jacobian);
      constexpr double near = 0.3;
      if (length_ <= near) weigh();
      const bool cut = bounds_.share(y_, step_) < 1.0;
      if (tolerance_ <= last_tolerance_ && enough(contraction_ * length_ * length_)) {
        if (!cut) {
          apply(step_);
          return ended(Termination::converged);
        }
        // The root is at a limit or beyond, or inside by less than can be told.
        if (length_ <= margin * options_.accuracy) return stalled();
      }
      switch (advance()) {
        case Step::taken: break;
        case Step::last: return ended(Termination::converged);
        case Step::none: {
          if (tolerance_ <= last_tolerance_) {
            constexpr double noise = 1e-3;
            result_.error = length_;
            if (length_ <= noise && !cut) return ended(Termination::small_step);
            return ended(left_ ? Termination::left_domain : Termination::stalled);
          }
          constexpr double tighter = 1e-3;  // looseness may be what is in the way
          set_tolerance(std::max(last_tolerance_, tighter * tolerance_));
          if (!evaluate(y_, true)) return ended(Termination::left_domain);
        }
      }
    }
  }

  Located correct(const Eigen::Ref<const Eigen::VectorXd>& prediction) {
    begin(prediction);
    set_tolerance(last_tolerance_);
    constexpr double too_slow = 0.3;
    double before = 0.0;  // length of the last correction by the same Jacobian
    while (result_.iterations < options_.max_iterations) {
      double rate = known_rate(y_);
      const bool chord = rate <= too_slow;
      if (!evaluate(y_, !chord)) return ended(Termination::left_domain);
      if (!chord) {
        factorise(y_);
        rate = 0.0;
      }
      factors_.correction(trial_, step_);
      length_ = length(step_);
      if (!std::isfinite(length_)) return ended(Termination::singular_jacobian);
      if (bounds_.share(y_, step_) < 1.0) return stalled();
      if (before > 0.0 && length_ > 0.5 * before) {
        result_.error = length_;
        return ended(length_ <= options_.accuracy ? Termination::small_step : Termination::stalled);
      }
      if (chord && before > 0.0 && length_ > 3.0 * last_tolerance_) {
        rate = std::max(rate, length_ / before);
        contraction_ = std::max(contraction_, 0.5 * rate / std::max(distance(y_), length_));
      }
      // The error that a Jacobian from here leaves is of second order; an older one's is of first.
      const double error = chord ? rate * length_ : contraction_ * length_ * length_;
      apply(step_);
      if (enough(error)) return ended(Termination::converged);
      before = length_;
    }
    return ended(Termination::iteration_limit);
  }

 private:
  enum class Step { taken, last, none };

  void begin(const Eigen::Ref<const Eigen::VectorXd>& start) {
    if (start.size() != shooting_.size()) {
      throw BadInput(fmt::format("the start has {} values, the shooting {} unknowns", start.size(), shooting_.size()));
    }
    if (!start.allFinite()) throw BadInput("the start has a value that is not a finite number");
    if (row_scales_.size() != start.size() || !shooting_.cuts().empty()) {
      row_scales_ = shooting_.row_scales();
      unknown_scales_ = shooting_.unknown_scales();
      bounds_ = Bounds::of(shooting_);
    }
    y_ = start;
    next_.resize(y_.size());
    residual_.resize(y_.size());
    trial_.resize(y_.size());
    before_ = shooting_.statistics();
    result_ = {};
    left_ = false;
  }

  Located stalled() {
    result_.error = length_;
    return ended(Termination::stalled);
  }

  Located ended(Termination termination) {
    // A start beyond a limit may have led to a root there.
    const bool within = (y_.array() > bounds_.lower.array() && y_.array() < bounds_.upper.array()).all();
    if (termination == Termination::converged && !within) termination = Termination::stalled;
    Located located = std::move(result_);
    result_ = {};
    located.termination = termination;
    located.y = y_;
    located.correction = length_;
    located.tolerance = tolerance_;
    located.statistics = shooting_.statistics() - before_;
    return located;
  }

  /// Is an error that Newton's method leaves small enough? Then it is kept, with what the integration may add.
  bool enough(double error) {
    result_.error = error + amplification_ * last_tolerance_ / wanted_;
    return error <= margin * options_.accuracy;
  }

  void set_tolerance(double tolerance) {
    tolerance_ = tolerance;
    shooting_.set_flow_options(flow_options(options_, tolerance));
  }

  /// Near a root the Jacobian tells what error of an integration does.
  void weigh() {
    const double amplification = factors_.amplification();
    if (!std::isfinite(amplification)) return;
    amplification_ = std::max(1.0, amplification);
    last_tolerance_ = std::max(tightest, wanted_ * options_.accuracy / amplification_);
  }

  /// R at a point into trial_, with its derivatives or without.
  bool evaluate(const Eigen::VectorXd& y, bool differentiated) {
    try {
      const Shot& shot = differentiated ? shooting_.evaluate(y, {}, Extent::equations)
                                        : shooting_.values(y, Extent::equations);
      read_residual(shooting_, shot, trial_);
      return trial_.allFinite();
    } catch (const LeftDomain& failure) {
      result_.message = failure.what();
      return false;
    }
  }

  /// \pre the last evaluation was at y, with derivatives
  void factorise(const Eigen::VectorXd& y) {
    factors_.decompose(shooting_, shooting_.evaluate(y, {}, Extent::equations), row_scales_, unknown_scales_);
    factor_point_ = y;
    factor_tolerance_ = tolerance_;
  }

  [[nodiscard]] double length(const Eigen::VectorXd& v) const { return scaled_length(v, unknown_scales_, y_); }
  /// From where the Jacobian is known.
  [[nodiscard]] double distance(const Eigen::VectorXd& y) const {
    return scaled_length(y - factor_point_, unknown_scales_, y_);
  }
  /// At which corrections by the known Jacobian contract at y; infinite if there is none.
  [[nodiscard]] double known_rate(const Eigen::VectorXd& y) const {
    if (!factors_.known() || factor_point_.size() != y.size()) return std::numeric_limits<double>::infinity();
    return 2.0 * contraction_ * distance(y) + factor_tolerance_;
  }

  /// The share of the step that limits leave.
  double apply(const Eigen::VectorXd& step) {
    const double share = bounds_.share(y_, step);
    y_ += share * step;
    ++result_.iterations;
    return share;
  }

  /// From y along the correction, to where the next one is shorter; evaluated there, if it is not the last.
  Step advance() {
    const double longest = std::min(options_.max_step / length_, bounds_.share(y_, step_));
    double damping = std::min(longest, measured_ ? std::min(1.0, 0.5 / (contraction_ * length_)) : 1.0);
    const double present = tolerance_;
    left_ = false;
    while (damping >= least_damping) {
      next_ = y_ + damping * step_;
      const double predicted = (1.0 - damping) * length_ + contraction_ * damping * damping * length_ * length_ + present;
      const double rate = 2.0 * contraction_ * length_ + factor_tolerance_;
      const bool chord = damping == 1.0 && margin * options_.accuracy >= rate * predicted;
      set_tolerance(chord ? last_tolerance_ : next_tolerance(predicted, present));
      left_ = !evaluate(next_, !chord);
      if (left_) {
        damping *= 0.5;
        continue;
      }
      factors_.correction(trial_, simplified_);
      const double next_length = length(simplified_);
      const double curvature = scaled_length(simplified_ - (1.0 - damping) * step_, unknown_scales_, y_);
      if (!(next_length <= (1.0 - 0.25 * damping) * length_)) {
        const double corrected = 0.5 * damping * damping * length_ / curvature;
        damping = std::min(std::isfinite(corrected) ? corrected : 0.0, 0.5 * damping);
        continue;
      }
      const double seen = curvature / (damping * damping * length_ * length_);
      // Below the noise of the integration the contraction is seen as no better than that.
      if (curvature > 3.0 * present || seen < contraction_) {
        contraction_ = std::max(seen, least_contraction);
        measured_ = true;
      }
      y_.swap(next_);
      ++result_.iterations;
      if (!chord) return Step::taken;
      length_ = next_length;
      const double error = (2.0 * contraction_ * length(step_) + factor_tolerance_) * next_length;
      const bool whole = apply(simplified_) == 1.0;
      if (enough(error) && whole) return Step::last;
      return evaluate(y_, true) ? Step::taken : Step::none;
    }
    tolerance_ = present;
    return Step::none;
  }

  /// Of the integration at a point whose correction is expected to have a length.
  [[nodiscard]] double next_tolerance(double predicted, double present) const {
    constexpr double share = 3.0;                              // true errors are well below tolerances
    const double left = contraction_ * predicted * predicted;  // after that correction
    if (left <= margin * options_.accuracy) return last_tolerance_;
    return std::clamp(share * left, last_tolerance_, std::max(present, last_tolerance_));
  }

  Shooting& shooting_;
  LocateOptions options_;
  double wanted_;  ///< tolerance per accuracy
  double last_tolerance_, tolerance_ = 0.0, amplification_ = 1.0;
  Eigen::VectorXd row_scales_, unknown_scales_;
  Bounds bounds_;
  Factors factors_;
  Eigen::VectorXd factor_point_;
  double factor_tolerance_ = 0.0;
  double contraction_ = 1.0;  ///< c
  bool measured_ = false;     ///< is it?
  bool left_ = false;         ///< the domain, at the last try
  double length_ = 0.0;       ///< of the step
  Eigen::VectorXd y_, next_, residual_, trial_, step_, simplified_;
  Statistics before_;
  Located result_;
};

Locator::Locator(Shooting& shooting, const LocateOptions& options) : search_(std::make_unique<Search>(shooting, options)) {}
Locator::~Locator() = default;

Located Locator::find(const Eigen::Ref<const Eigen::VectorXd>& start) { return search_->find(start); }
Located Locator::correct(const Eigen::Ref<const Eigen::VectorXd>& prediction) { return search_->correct(prediction); }

Located locate(Shooting& shooting, const Eigen::Ref<const Eigen::VectorXd>& start, const LocateOptions& options) {
  return Locator(shooting, options).find(start);
}

}  // namespace costate
