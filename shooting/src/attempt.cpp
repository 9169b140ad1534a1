#include "approach.hpp"
#include "attempt.hpp"
#include "diagnosis.hpp"
#include "opinions.hpp"
#include "verify.hpp"

#include <costate/error.hpp>
#include <costate/shooting/solve.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <fmt/format.h>

namespace costate {

namespace {

constexpr double tightest_solve = 2e-14;   // below this the multistep formulas only add rounding
constexpr double tightest_verify = 1e-15;  // the least relative tolerance CVODES takes
constexpr double tolerance_per_accuracy = 1e-3;
constexpr double verify_factor = 0.02;
constexpr double closer_look = 0.37;  // steps of the second opinion, in those of the first: not a simple fraction of them
constexpr long glance_steps = 20000;  // some ten integrations of a few arcs or segments

/// Ratio of an error bound to what is wanted: absolute up to 1, relative above; infinite for a number that is none.
double excess(const Quantity& quantity, double accuracy) {
  const double ratio = quantity.error_bound / (accuracy * std::max(1.0, std::abs(quantity.value)));
  return std::isfinite(ratio) ? ratio : std::numeric_limits<double>::infinity();
}

class Solver {
 public:
  Solver(Shooting& shooting, const SolveOptions& options, Effort effort)
      : shooting_(shooting),
        options_(options),
        effort_(effort),
        before_(shooting.statistics()),
        approach_(shooting, options_, effort, std::max(1e-6, tolerance_per_accuracy * options.accuracy), solution_.cost) {
    solution_.problem = shooting.shared_problem();
    solution_.parameters = shooting.parameters();
  }

  Solution run(const Start& start) {
    const double began = thread_seconds();
    shooting_.set_step_limit(before_.steps + options_.max_total_steps);
    try {
      if (effort_ == Effort::glance)
        shooting_.set_step_limit(before_.steps + std::min(glance_steps, options_.max_total_steps));
      const bool near = approach_.run(start, point_);
      shooting_.set_step_limit(before_.steps + options_.max_total_steps);
      if (!near && effort_ != Effort::full) {
        solution_.message = approach_.reason();
      } else if (refine()) {
        verify();
      }
    } catch (const BudgetSpent& spent) {
      solution_.message = fmt::format("given up: {}{}{}; try {}", spent.what(),
                                      approach_.reason().empty() ? "" : "; the last difficulty was: ", approach_.reason(),
                                      options_.advice);
    }
    solution_.arrived = located_ ? 1 : 0;
    solution_.y = point_.head(shooting_.border());
    solution_.nodes = static_cast<int>(shooting_.node_sizes().size());
    const Statistics now = shooting_.statistics();
    solution_.cost.seconds = thread_seconds() - began;
    solution_.cost.steps = now.steps - before_.steps;
    solution_.cost.rhs_evaluations = now.rhs_evaluations - before_.rhs_evaluations;
    solution_.cost.sensitivity_evaluations = now.sensitivity_evaluations - before_.sensitivity_evaluations;
    return std::move(solution_);
  }

 private:
  bool not_converged(const NewtonResult& result) {
    solution_.message = fmt::format("not converged: {} after {} Newton iterations", describe(result.termination),
                                    result.iterations);
    if (!result.message.empty()) solution_.message += fmt::format(" ({})", result.message);
    if (!approach_.reason().empty()) solution_.message += fmt::format("; before that: {}", approach_.reason());
    try {
      const Shot& shot = shooting_.evaluate(point_);
      solution_.message += fmt::format("; worst rows: {}", worst_rows(shooting_, shooting_.residual(shot)));
      const Staircase jacobian = shooting_.decompose(shot);
      if (jacobian.condition() > 1e8)
        solution_.message += fmt::format("; hardly determined: {}", weakest_direction(shooting_, jacobian));
    } catch (const LeftDomain&) {
      // The first guess itself is outside the domain: the message above says where.
    }
    solution_.message += "; try " + options_.advice;
    return false;
  }

  /// Tightens until the error bound meets the accuracy.
  bool refine() {
    double tolerance = std::max(tightest_solve, tolerance_per_accuracy * options_.accuracy);
    double best = 0.0;
    bool repeated = false;
    Quantity worst;
    while (true) {
      const NewtonResult result = newton(tolerance);
      if (!correct(tolerance, result)) return false;
      located_ = true;
      double reached = 0.0;
      for (const auto* list : {&solution_.reports, &solution_.unknowns}) {
        for (const Quantity& quantity : *list) {
          if (excess(quantity, options_.accuracy) > reached) {
            reached = excess(quantity, options_.accuracy);
            worst = quantity;
          }
        }
      }
      if (reached <= 1.0) return true;
      if (repeated || !std::isfinite(reached)) {
        if (!cut_what_grows()) break;
        repeated = false;
        best = 0.0;
        tolerance = std::max(tightest_solve, tolerance_per_accuracy * options_.accuracy);
        continue;
      }
      if (tolerance <= tightest_solve) {
        // Part of the bound is what Newton's method left over when it stopped; from the corrected point it leaves less.
        repeated = true;
        continue;
      }
      if (best > 0.0 && reached > 0.5 * best) {
        repeated = true;
        continue;
      }
      best = reached;
      // The bound is proportional to the tolerance where integration error dominates; half the excess again as margin.
      tolerance = std::max(tightest_solve, tolerance * std::min(0.1, 0.5 / reached));
    }
    solution_.message =
        fmt::format("the accuracy {:g} is not reached: the best error bound is {:.2g} for {}; try a larger one",
                    options_.accuracy, worst.error_bound, worst.name);
    return false;
  }

  /// Where accuracy is lost by growth along the arcs, cutting them wins it back: done once.
  bool cut_what_grows() {
    if (cut_ || !options_.multiple) return false;
    cut_ = true;
    try {
      return largest_growth(shooting_, point_) > MeshOptions{}.growth && approach_.cut_by_growth(point_, {});
    } catch (const LeftDomain&) {
      return false;
    }
  }

  NewtonResult newton(double tolerance) {
    shooting_.set_flow_options(flow_options(options_, tolerance));
    return kinsol(shooting_, point_, options_, solution_.cost);
  }

  /// One Newton correction from a tighter integration, a second opinion on it, and from both the error bounds.
  ///
  /// The errors of one method are systematic, those of two have nothing in common: the first opinion is another method's than the
  /// solve's, the second the solve's own. An arc that only one of them can integrate, a stiff one for example, is judged by that one twice.
  bool correct(double tolerance, const NewtonResult& result) {
    if (!near_root(result.termination)) return not_converged(result);
    const Eigen::VectorXd root = point_;
    if (options_.method != Method::bdf) {
      try {
        return correct(tolerance, result, options_.method == Method::adams ? Method::runge_kutta : Method::adams);
      } catch (const LeftDomain&) {
        point_ = root;
      }
    }
    try {
      return correct(tolerance, result, options_.method);
    } catch (const LeftDomain& failure) {
      solution_.message = fmt::format("the root found cannot be verified: {}", failure.what());
      return false;
    }
  }

  bool correct(double tolerance, const NewtonResult& result, Method first_method) {
    shooting_.set_flow_options(flow_options(options_, tolerance));
    const std::vector<Report> loose = shooting_.evaluate(point_).reports();
    const double tight = std::max(tightest_verify, verify_factor * tolerance);
    FlowOptions first = flow_options(options_, tight);
    first.method = first_method;
    shooting_.set_flow_options(first);
    const Shot shot = shooting_.evaluate(point_);
    const Staircase jacobian = shooting_.decompose(shot);
    if (!isolated(jacobian)) return false;
    const Eigen::VectorXd correction = jacobian.solve(shooting_.residual(shot));
    const double size = correction.cwiseQuotient(shooting_.unknown_scales()).cwiseAbs().maxCoeff();
    if (!result.converged() && !(size <= coarsest_accuracy)) return not_converged(result);

    const Eigen::VectorXd before = point_;
    point_ -= correction;
    // One method twice must have another tolerance to see its own errors. A tighter one differs by nearly all of the first's error;
    // where there is none, a looser one by several times that.
    const bool at_floor = tight < 5.0 * tightest_verify, independent = first_method != options_.method;
    FlowOptions second_options = flow_options(options_, at_floor ? (independent ? tight : 5.0 * tight) : 0.2 * tight);
    second_options.longest_step *= closer_look;
    shooting_.set_flow_options(second_options);
    const Shot second = shooting_.values(point_);
    const Opinions opinions(shooting_, jacobian, correction, shooting_.residual(second), at_floor ? 1.5 : 3.0);
    solution_.reports.clear();
    for (std::size_t i = 0; i < shot.reports().size(); ++i) {
      const Report& report = shot.reports()[i];
      Eigen::VectorXd gradient = Eigen::VectorXd::Zero(shooting_.size());
      for (const auto& entry : report.value.gradient()) gradient[entry.column] = entry.derivative;
      solution_.reports.push_back(opinions.quantity(report.name, report.unit, gradient, loose[i].value.value,
                                                    report.value.value, second.reports()[i].value.value));
    }
    solution_.unknowns.clear();
    for (Eigen::Index i = 0; i < shooting_.border(); ++i) {
      solution_.unknowns.push_back(opinions.quantity(shooting_.unknown_name(i), "",
                                                     Eigen::VectorXd::Unit(shooting_.size(), i), before[i], before[i],
                                                     point_[i]));
    }
    return true;
  }

  bool isolated(const Staircase& jacobian) {
    solution_.certificate.condition = jacobian.condition();
    if (solution_.certificate.condition < 1e14) return true;
    solution_.message = fmt::format(
        "the Jacobian is singular at the root found (condition {:.1e}): the solution is not "
        "isolated, hardly determined is {}; try {}",
        solution_.certificate.condition, weakest_direction(shooting_, jacobian), options_.advice);
    return false;
  }

  /// Refuses roots that are no solutions, and keeps the trajectory of those that are.
  void verify() {
    const std::string objection = verify_root(shooting_, point_, options_.accuracy, solution_);
    if (objection.empty()) {
      solution_.status = Solution::Status::solved;
    } else {
      solution_.status = Solution::Status::refused;
      solution_.message = objection;
    }
  }

  Shooting& shooting_;
  SolveOptions options_;
  Effort effort_;
  Statistics before_;
  bool cut_ = false;       ///< where the arcs grow, for the sake of accuracy
  Eigen::VectorXd point_;  ///< unknowns of the problem, then the nodes
  bool located_ = false;   ///< a root, whether it is known as well as asked or not
  Solution solution_;
  Approach approach_;
};

}  // namespace

Solution attempt(Shooting& shooting, const Start& start, const SolveOptions& options, Effort effort) {
  return Solver(shooting, options, effort).run(start);
}

}  // namespace costate
