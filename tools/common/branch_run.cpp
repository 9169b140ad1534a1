#include "branch_run.hpp"

#include <costate/error.hpp>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace costate::tools {

namespace {

std::optional<double> value_of(const std::vector<BranchReport>& reports, const std::string& name) {
  const auto found = std::find_if(reports.begin(), reports.end(), [&](const BranchReport& r) { return r.name == name; });
  return found == reports.end() ? std::nullopt : std::optional(found->value);
}

class Follower {
 public:
  explicit Follower(const VariedScene& scene) : scene_(scene), variation_(scene.variation) {}

  VariedOutcome run() {
    began_ = thread_seconds();
    if (const auto start = first()) follow(*start);
    result_.cost.seconds = thread_seconds() - began_;
    return std::move(result_);
  }

 private:
  bool shows_steps() const { return variation_.values.empty(); }

  /// A scene on the way. Where its numbers do not go together it is one that is not solved: what was found before is kept.
  Outcome solve_at(double value) {
    variation_.store(value);
    Outcome outcome;
    try {
      outcome = scene_.solve();
    } catch (const BadInput& error) {
      if (value == variation_.from) throw;
      outcome.message = error.what();
    }
    result_.cost.add(outcome.cost);
    return outcome;
  }

  std::optional<BranchStart> start_of(const Outcome& outcome) const {
    if (scene_.start) {
      if (auto start = scene_.start(outcome)) return start;
    }
    if (outcome.closed_form) return std::nullopt;
    return BranchStart{outcome.solution.problem, outcome.solution.parameters, outcome.solution.y};
  }

  /// The scene at the start of the variation; where that is known in closed form only, a little beyond.
  std::optional<BranchStart> first() {
    begin_ = variation_.from;
    goal_ = variation_.to;
    Outcome outcome = solve_at(begin_);
    if (!outcome.solved()) return refuse(std::move(outcome));
    if (auto start = start_of(outcome)) return start;
    keep_closed_form(begin_, std::move(outcome));
    constexpr double little = 1e-3;
    begin_ = std::lerp(variation_.from, variation_.to, little);
    for (const double value : variation_.values) {
      if (value != variation_.from && std::abs(value - variation_.from) < std::abs(begin_ - variation_.from)) begin_ = value;
    }
    outcome = solve_at(begin_);
    if (!outcome.solved()) return refuse(std::move(outcome));
    if (auto start = start_of(outcome)) return start;
    list_closed_forms();
    return std::nullopt;
  }

  void keep_closed_form(double parameter, Outcome outcome) {
    result_.points.push_back({.parameter = parameter,
                              .requested = !shows_steps(),
                              .solution = {},
                              .closed_form = std::move(outcome.closed_form),
                              .derivatives = {}});
  }

  /// Where the answers stay in closed form there is nothing to follow: every value is a scene of its own.
  void list_closed_forms() {
    constexpr int cells = 20;
    std::vector<double> values = variation_.values;
    for (int i = 1; shows_steps() && i <= cells; ++i) {
      values.push_back(i == cells ? variation_.to
                                  : std::lerp(variation_.from, variation_.to, static_cast<double>(i) / cells));
    }
    for (const double value : values) {
      if (value == variation_.from) continue;
      begin_ = value;
      Outcome outcome = solve_at(value);
      if (!outcome.solved()) {
        refuse(std::move(outcome));
        return;
      }
      if (outcome.closed_form) {
        keep_closed_form(value, std::move(outcome));
      } else {
        result_.points.push_back(solve_from(*start_of(outcome), value));
        result_.points.back().requested = !shows_steps();
      }
    }
    conclude("", true);
  }

  std::nullopt_t refuse(Outcome outcome) {
    result_.status = result_.points.empty() ? outcome.status : Outcome::Status::failed;
    result_.message = fmt::format("at {} = {:g}: {}", variation_.name, begin_, outcome.message);
    return std::nullopt;
  }

  void follow(BranchStart start) {
    constexpr int most_restarts = 20;
    for (int restarts = 0;; ++restarts) {
      Branch branch = trace_from(start);
      verify(branch);
      if (branch.reached || branch.points.empty()) return finish(branch);
      // Looking for where to take it up again costs scenes solved from themselves alone; that must not take for ever.
      constexpr double most_seconds = 5.0;
      const bool ends = branch.exhausted || back_at_start(branch) || restarts == most_restarts ||
                        thread_seconds() - began_ > most_seconds;
      const auto again = ends ? std::nullopt : beyond(branch);
      if (!again) return finish(branch);
      refused_.reset();
      last_fold_.reset();
      start = *again;
    }
  }

  [[nodiscard]] bool back_at_start(const Branch& branch) const { return branch.points.back().parameter == variation_.from; }

  Branch trace_from(const BranchStart& start) {
    TraceOptions options{.tolerance = std::clamp(1e-3 * scene_.options.accuracy, 1e-12, 1e-9), .landings = {}, .method = scene_.options.method};
    const double low = std::min(begin_, goal_), high = std::max(begin_, goal_);
    for (const double value : variation_.values) {
      if (value >= low && value <= high) options.landings.push_back(value);
    }
    // Every value asked for is a point of its own besides the steps that the branch needs.
    constexpr int most_points = 300, most_steps = 300000, steps_per_value = 4000;
    const auto count = static_cast<int>(options.landings.size());
    options.max_points = most_points + count;
    options.max_integration_steps = most_steps + static_cast<long>(steps_per_value) * count;
    Branch branch = trace(start.problem, start.parameters, start.y, variation_.name, goal_, options, scene_.restructure);
    result_.branch_points += static_cast<int>(branch.points.size());
    result_.event_iterations += branch.event_iterations;
    result_.follow_cost.add(branch.cost);
    result_.cost.add(branch.cost);
    return branch;
  }

  /// Solves the points to be shown. A branch of the equations may leave the solutions where the problem has no guard for it:
  /// then it ends at the last point that is one, which may lie between two that are shown.
  void verify(Branch& branch) {
    std::vector<VariedPoint> shown;
    if (!examine(branch, shows_steps() || !branch.reached, shown)) examine(branch, true, shown);
    for (VariedPoint& point : shown) result_.points.push_back(std::move(point));
    for (const BranchEvent& event : branch.events) result_.events.push_back(stated(event));
  }

  static VariedEvent stated(const BranchEvent& event) {
    return {describe(event.kind),
            event.name,
            event.point.parameter,
            event.error_bound,
            value_of(event.point.reports, "final_time"),
            event.before,
            event.after};
  }

  /// Solves every point, or those asked for; cuts the branch at the first that is no solution. Steps close to an event may not
  /// be known to the accuracy: after a few no more are tried. False, with nothing done, if a point is no solution and not
  /// every one before it was looked at.
  bool examine(Branch& branch, bool every, std::vector<VariedPoint>& shown) {
    constexpr int patience = 3;
    int in_a_row = 0, left_out = 0;
    std::size_t good = 0;
    good_.reset();
    shown.clear();
    for (std::size_t i = 0; i < branch.points.size(); ++i) {
      const BranchPoint& point = branch.points[i];
      if (!every && !point.requested && i > 0) continue;
      if (!point.requested && in_a_row >= patience) {
        ++left_out;
        continue;
      }
      VariedPoint solved = solve_point(branch, i);
      if (solved.solution.status == Solution::Status::refused) {
        if (!every) return false;
        refused_ = std::move(solved);
        cut(branch, i == 0 ? 0 : good + 1);
        break;
      }
      const bool unknown = solved.solution.status == Solution::Status::failed;
      in_a_row = unknown ? in_a_row + 1 : 0;
      if (!unknown) good = i;
      if (solved.solution.solved()) good_ = {i, solved};
      if (unknown && !point.requested) ++left_out;
      if (point.requested || (shows_steps() && !unknown)) shown.push_back(std::move(solved));
    }
    if (shows_steps()) unknown_ += left_out;
    if (!branch.reached && good_) hold_fold_back(branch);
    return true;
  }

  /// A fold beyond the last point that was solved is an event only if the branch is not taken up again: it is held back.
  void hold_fold_back(Branch& branch) {
    const auto doubtful = [&](const BranchEvent& e) { return e.kind == EventKind::fold && e.position > good_->first; };
    const auto first = std::find_if(branch.events.begin(), branch.events.end(), doubtful);
    if (first == branch.events.end()) return;
    last_fold_ = stated(*first);
    std::erase_if(branch.events, doubtful);
  }

  void cut(Branch& branch, std::size_t length) {
    branch.points.resize(length);
    std::erase_if(branch.events, [&](const BranchEvent& e) { return e.kind != EventKind::fold && e.position >= length; });
    branch.reached = false;
    branch.message = fmt::format("from {} = {:.12g} on: {}", variation_.name, refused_->parameter,
                                 refused_->solution.message);
  }

  VariedPoint solve_point(const Branch& branch, std::size_t i) {
    const BranchPoint& point = branch.points[i];
    const auto before = std::count_if(branch.events.begin(), branch.events.end(),
                                      [&](const BranchEvent& e) { return e.position <= i; });
    const Stretch& stretch = branch.stretches[point.stretch];
    std::vector<double> parameters = stretch.parameters;
    parameters[stretch.place] = point.parameter;
    VariedPoint result = solve_from({stretch.problem, parameters, point.y}, point.parameter);
    if (scene_.restate && result.solution.status == Solution::Status::refused) {
      if (const auto anew = scene_.restate(result.solution)) result = solve_from(*anew, point.parameter);
    }
    result.events_before = result_.events.size() + static_cast<std::size_t>(before);
    result.requested = point.requested;
    result.iterations = point.iterations;
    return result;
  }

  VariedPoint solve_from(const BranchStart& start, double parameter) {
    Shooting shooting(start.problem);
    shooting.set_parameters(start.parameters);
    VariedPoint result{.parameter = parameter,
                       .solution = solve(shooting, start.y, scene_.options),
                       .closed_form = std::nullopt,
                       .derivatives = {}};
    result_.cost.add(result.solution.cost);
    if (!result.solution.solved()) return result;
    try {
      result.derivatives = derivatives(shooting, result.solution.y, variation_.name);
      if (scene_.judge) result.objection = scene_.judge(result.solution);
    } catch (const LeftDomain& error) {
      result.objection = fmt::format("not examined further: {}", error.what());
    }
    return result;
  }

  /// Where the branch is taken up again, in the direction in which it was going: the extremal of a scene beyond its end that
  /// is nearest to what the end leads to expect.
  std::optional<BranchStart> beyond(const Branch& branch) {
    if (!good_) return std::nullopt;
    const BranchPoint& last = branch.points[good_->first];
    const auto folds = std::count_if(branch.events.begin(), branch.events.end(), [&](const BranchEvent& e) {
      return e.kind == EventKind::fold && e.position <= good_->first;
    });
    const double direction = (goal_ > begin_) == (folds % 2 == 0) ? 1.0 : -1.0;
    goal_ = (variation_.to > variation_.from) == (direction > 0.0) ? variation_.to : variation_.from;
    const double range = std::abs(variation_.to - variation_.from);
    constexpr double shortest = 1e-4, longest = 1e-2;
    distance_ = std::abs(last.parameter - begin_) > 10.0 * distance_ * range ? shortest
                                                                             : std::min(longest, 10.0 * distance_);
    for (double distance = distance_; distance <= longest; distance *= 10.0) {
      const double value = last.parameter + direction * distance * range;
      if ((goal_ - value) * direction <= 0.0) return std::nullopt;
      const Outcome outcome = solve_at(value);
      const auto start = nearest_start(outcome, good_->second, value);
      if (!start) continue;
      const bool limit = !branch.events.empty() && branch.events.back().kind == EventKind::limit;
      const std::string before = structure_name(*branch.stretches.back().problem), after = structure_name(*start->problem);
      if (limit && before == after) continue;  // not yet beyond
      fill(good_->second, value);
      if (limit) {
        // The scene solved cold has the structure that the model could not name.
        result_.events.back().kind = describe(branch.events.back().announced);
        result_.events.back().after = after;
      } else {
        result_.events.push_back(
            {"restart", "the problem is stated anew", value, distance * range, std::nullopt, before, after});
      }
      begin_ = value;
      return start;
    }
    return std::nullopt;
  }

  /// Values asked for that lie between the last point of a part of the branch and the first of the next, which lands on none
  /// of them.
  void fill(const VariedPoint& last, double next) {
    std::vector<double> values = variation_.values;
    if ((next > last.parameter) != (variation_.to > variation_.from)) std::reverse(values.begin(), values.end());
    for (const double value : values) {
      const double low = std::min(last.parameter, next), high = std::max(last.parameter, next);
      const bool there = std::any_of(result_.points.begin(), result_.points.end(), [&](const VariedPoint& p) {
        return p.parameter == value && p.events_before >= last.events_before;
      });
      if (there || !(value > low && value < high)) continue;
      const auto start = nearest_start(solve_at(value), last, value);
      VariedPoint point{.parameter = value, .solution = {}, .closed_form = std::nullopt, .derivatives = {}};
      if (start) {
        point = solve_from(*start, value);
      } else {
        point.solution.message = "no solution that the branch leads to was found here";
      }
      const bool event_beyond = !result_.events.empty() &&
                                (result_.events.back().parameter - value) * (next - last.parameter) > 0.0;
      point.events_before = result_.events.size() - (event_beyond ? 1 : 0);
      point.requested = true;
      result_.points.push_back(std::move(point));
    }
  }

  std::optional<BranchStart> nearest_start(const Outcome& outcome, const VariedPoint& point, double value) const {
    const Solution* nearest = nearest_extremal(outcome, point, value);
    if (nearest == nullptr) return std::nullopt;
    if (nearest == &outcome.solution) return start_of(outcome);
    return BranchStart{nearest->problem, nearest->parameters, nearest->y};
  }

  void finish(const Branch& branch) {
    if (last_fold_) result_.events.push_back(std::move(*last_fold_));
    if (refused_) {
      refused_->events_before = result_.events.size();
      result_.points.push_back(std::move(*refused_));
    }
    const bool arrived = branch.reached && goal_ == variation_.to;
    std::string message = goal_ == variation_.to
                              ? branch.message
                              : "the branch turns back at a fold: there is no solution of this family beyond";
    if (!arrived) {
      const Outcome target = solve_at(variation_.to);
      if (target.status == Outcome::Status::infeasible)
        message += fmt::format("; at {:g}: {}", variation_.to, target.message);
    }
    conclude(message, arrived);
  }

  void conclude(const std::string& message, bool arrived) {
    result_.message = message;
    const auto add_remark = [&](const std::string& remark) {
      result_.message += (result_.message.empty() ? "" : "; ") + remark;
    };
    if (unknown_ > 0)
      add_remark(fmt::format("{} steps close to an event are left out: they are not known to the accuracy", unknown_));
    const auto refused = std::count_if(result_.points.begin(), result_.points.end(),
                                       [](const VariedPoint& p) { return !p.closed_form && !p.solution.solved(); });
    if (refused > 0)
      add_remark(
          fmt::format("{} of {} points could not be solved to the accuracy or verified", refused, result_.points.size()));
    result_.status = arrived && refused == 0 ? Outcome::Status::solved : Outcome::Status::failed;
  }

  const VariedScene& scene_;
  const Variation& variation_;
  double began_ = 0.0;               ///< CPU time at the start of the run
  double begin_ = 0.0, goal_ = 0.0;  ///< of the part of the branch that is being followed
  double distance_ = 1e-4;           ///< to the next place at which the branch is taken up again, by the whole range
  int unknown_ = 0;                  ///< steps that could not be solved to the accuracy
  std::optional<std::pair<std::size_t, VariedPoint>> good_;  ///< the last point of the branch that was solved, and its place
  std::optional<VariedEvent> last_fold_;                     ///< beyond the last point of a branch that was cut
  std::optional<VariedPoint> refused_;                       ///< the root that is no solution at which the branch was cut
  VariedOutcome result_;
};

}  // namespace

VariedOutcome follow_variation(const VariedScene& scene) { return Follower(scene).run(); }

}  // namespace costate::tools
