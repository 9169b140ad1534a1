#include "direct_phase.hpp"

#include "transcription.hpp"

#include <costate/error.hpp>

#include <cmath>

namespace costate {

namespace {

/// Pairs of infeasibility and barrier function that no later point may be worse than in both.
class Filter {
 public:
  [[nodiscard]] bool accepts(const Merit& at) const {
    for (const auto& [infeasibility, barrier] : entries_) {
      if (at.infeasibility >= infeasibility && at.barrier >= barrier) return false;
    }
    return true;
  }
  void add(const Merit& at) {
    entries_.emplace_back((1.0 - margin) * at.infeasibility, at.barrier - margin * at.infeasibility);
  }
  void clear() { entries_.clear(); }

  static constexpr double margin = 1e-5;

 private:
  std::vector<std::pair<double, double>> entries_;
};

/// The largest step up to 1 that leaves 1 % of every component.
double to_boundary(const Eigen::MatrixXd& at, const Eigen::MatrixXd& direction) {
  constexpr double kept = 0.01;
  double step = 1.0;
  for (Eigen::Index i = 0; i < at.size(); ++i) {
    const double d = direction.data()[i];
    if (d < 0.0) step = std::min(step, (kept - 1.0) * at.data()[i] / d);
  }
  return step;
}

class InteriorPoint {
 public:
  InteriorPoint(const Transcription& problem, const Eigen::VectorXd& u, DirectBegin begin, const DirectOptions& options,
                DirectBudget* budget)
      : problem_(problem),
        options_(options),
        budget_(budget),
        barrier_(options.first_barrier),
        point_(problem.start(u, begin, share())) {}

  bool run() {
    for (iterations_ = 0; iterations_ < options_.iterations; ++iterations_) {
      const Transcription::Expansion at = problem_.expand(point_);
      const double infeasibility = problem_.merit(point_, share()).infeasibility;
      constexpr double tightness = 10.0;
      while (std::max(problem_.error(point_, at, share()), infeasibility) < tightness * barrier_) {
        if (barrier_ <= options_.barrier) return true;
        completed_ = barrier_;
        barrier_ = std::max(options_.barrier, std::min(0.2 * barrier_, std::pow(barrier_, 1.5)));
        filter_.clear();
      }
      // A point that is nearly central is good enough to start from.
      if (!step(at)) return completed_ <= good_enough;
    }
    return completed_ <= good_enough;
  }

  [[nodiscard]] DirectSolution solution() const {
    DirectSolution s = problem_.solution(point_);
    s.iterations = iterations_;
    return s;
  }

 private:
  /// μ of one inequality: the barrier function is a mean over the steps, as the cost is an integral.
  [[nodiscard]] double share() const { return barrier_ / options_.steps; }

  bool step(const Transcription::Expansion& at) {
    const Merit here = problem_.merit(point_, share());
    if (iterations_ == 0) most_infeasible_ = 1e4 * std::max(1.0, here.infeasibility);
    double shift = 0.0;
    constexpr double largest_shift = 1e10;
    while (shift <= largest_shift) {
      if (budget_ != nullptr && budget_->newton_systems-- <= 0) return false;
      const auto newton = problem_.newton(point_, at, share(), shift);
      if (newton && search(here, *newton)) {
        last_shift_ = shift > 0.0 ? shift : last_shift_;
        return true;
      }
      shift = shift > 0.0 ? 8.0 * shift : std::max(1e-6, last_shift_ / 3.0);
    }
    return false;
  }

  bool search(const Merit& here, const Transcription::Newton& newton) {
    const DirectPoint& d = newton.direction;
    const double longest = std::min({problem_.longest_step(d), to_boundary(point_.step_slack, d.step_slack),
                                     to_boundary(point_.node_slack, d.node_slack)});
    const double dual = std::min(to_boundary(point_.step_multiplier, d.step_multiplier),
                                 to_boundary(point_.node_multiplier, d.node_multiplier));
    constexpr double shortest = 1e-3;
    for (double part = longest; part >= shortest * longest; part *= 0.5) {
      DirectPoint next = point_.moved(d, part, dual);
      try {
        const Merit there = problem_.merit(next, share());
        if (there.infeasibility > most_infeasible_ || !filter_.accepts(there)) continue;
        const bool descent = newton.slope < 0.0 && part * std::pow(-newton.slope, 2.3) > std::pow(here.infeasibility, 1.1);
        if (descent) {
          if (there.barrier > here.barrier + 1e-4 * part * newton.slope + 1e-12 * std::abs(here.barrier)) continue;
        } else {
          if (there.infeasibility > (1.0 - Filter::margin) * here.infeasibility &&
              there.barrier > here.barrier - Filter::margin * here.infeasibility) {
            continue;
          }
          filter_.add(here);
        }
        point_ = std::move(next);
        keep_multipliers_near_barrier();
        return true;
      } catch (const LeftDomain&) {
        continue;
      }
    }
    return false;
  }

  /// s η stays within a factor of μ, so that the Hessian stays that of the barrier to within it.
  void keep_multipliers_near_barrier() {
    constexpr double factor = 1e8;
    const auto keep = [&](Eigen::MatrixXd& multiplier, const Eigen::MatrixXd& slack) {
      for (Eigen::Index i = 0; i < multiplier.size(); ++i) {
        double& eta = multiplier.data()[i];
        const double central = share() / slack.data()[i];
        if (eta > 0.0) eta = std::clamp(eta, central / factor, central * factor);
      }
    };
    keep(point_.step_multiplier, point_.step_slack);
    keep(point_.node_multiplier, point_.node_slack);
  }

  const Transcription& problem_;
  const DirectOptions& options_;
  DirectBudget* budget_;
  double barrier_;
  DirectPoint point_;
  Filter filter_;
  static constexpr double good_enough = 1e-3;
  double completed_ = std::numeric_limits<double>::infinity();  ///< the last μ whose conditions were met
  double last_shift_ = 0.0, most_infeasible_ = 0.0;
  int iterations_ = 0;
};

}  // namespace

DirectSolution Transcription::solution(const DirectPoint& point) const {
  DirectSolution s;
  s.time = time(point);
  s.cost = merit(point, 0.0).cost;
  s.state = point.q;
  s.control = point.u;
  s.costate = point.costate;
  s.multiplier = point.node_multiplier;
  s.end_multiplier = point.end_multiplier.tail(static_cast<Eigen::Index>(s_.end_conditions.size()));
  Eigen::VectorXd weights(n_ + 1);
  weights << point.costate.col(0), -1.0;
  const double h = s.time / static_cast<double>(steps_);
  const auto first = s_.system->expand(middle(point, 0), data_.parameters, weights);
  s.start_costate = point.costate.col(0) + 0.5 * h * (first.jacobian.transpose() * weights).head(n_);
  return s;
}

std::optional<DirectSolution> direct_solution(const ExtremalStatement& statement, const DirectData& data,
                                              const Eigen::VectorXd& u, DirectBegin begin, const DirectOptions& options,
                                              DirectBudget* budget) {
  try {
    const Transcription problem(statement, data, options);
    InteriorPoint method(problem, u, begin, options, budget);
    if (!method.run()) return std::nullopt;
    return method.solution();
  } catch (const LeftDomain&) {
    return std::nullopt;
  }
}

}  // namespace costate
