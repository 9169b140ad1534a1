#include "branch_run.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace costate::tools {

namespace {

void add(Cost& sum, const Cost& cost) {
  sum.seconds += cost.seconds;
  sum.steps += cost.steps;
  sum.rhs_evaluations += cost.rhs_evaluations;
  sum.sensitivity_evaluations += cost.sensitivity_evaluations;
  sum.newton_iterations += cost.newton_iterations;
}

std::optional<double> value_of(const std::vector<BranchReport>& reports, const std::string& name) {
  const auto found = std::find_if(reports.begin(), reports.end(), [&](const BranchReport& r) { return r.name == name; });
  return found == reports.end() ? std::nullopt : std::optional(found->value);
}

class Follower {
 public:
  explicit Follower(const VariedScene& scene) : scene_(scene), variation_(scene.variation) {}

  VariedOutcome run() {
    const double began = thread_seconds();
    if (const auto start = first()) follow(*start);
    result_.cost.seconds = thread_seconds() - began;
    return std::move(result_);
  }

 private:
  bool shows_steps() const { return variation_.values.empty(); }

  Outcome solve_at(double value) {
    variation_.store(value);
    Outcome outcome = scene_.solve();
    add(result_.cost, outcome.cost);
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
    result_.points.push_back({.parameter = begin_,
                              .requested = !shows_steps(),
                              .solution = {},
                              .closed_form = std::move(outcome.closed_form),
                              .derivatives = {}});
    constexpr double little = 1e-3;
    begin_ = std::lerp(variation_.from, variation_.to, little);
    for (const double value : variation_.values) {
      if (value != variation_.from && std::abs(value - variation_.from) < std::abs(begin_ - variation_.from)) begin_ = value;
    }
    outcome = solve_at(begin_);
    if (!outcome.solved()) return refuse(std::move(outcome));
    return start_of(outcome);
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
      const auto again = branch.exhausted || back_at_start(branch) || restarts == most_restarts ? std::nullopt
                                                                                                : beyond(branch);
      if (!again) return finish(branch);
      refused_.reset();
      start = *again;
    }
  }

  [[nodiscard]] bool back_at_start(const Branch& branch) const { return branch.points.back().parameter == variation_.from; }

  Branch trace_from(const BranchStart& start) {
    TraceOptions options{.tolerance = std::clamp(1e-3 * scene_.options.accuracy, 1e-12, 1e-9),
                         .max_points = 300 + static_cast<int>(variation_.values.size()),
                         .max_integration_steps = 300000};
    const double low = std::min(begin_, goal_), high = std::max(begin_, goal_);
    for (const double value : variation_.values) {
      if (value >= low && value <= high) options.landings.push_back(value);
    }
    Branch branch = trace(start.problem, start.parameters, start.y, variation_.name, goal_, options, scene_.restructure);
    result_.branch_points += static_cast<int>(branch.points.size());
    result_.event_iterations += branch.event_iterations;
    add(result_.follow_cost, branch.cost);
    add(result_.cost, branch.cost);
    return branch;
  }

  /// Solves the points to be shown. A branch of the equations may leave the solutions where the problem has no guard for it: then it ends
  /// at the last point that is one. Steps close to an event may not be known to the accuracy: after a few no more are tried.
  void verify(Branch& branch) {
    constexpr int patience = 3;
    int in_a_row = 0;
    std::size_t good = 0;
    good_.reset();
    std::vector<VariedPoint> shown;
    for (std::size_t i = 0; i < branch.points.size(); ++i) {
      const BranchPoint& point = branch.points[i];
      if (!shows_steps() && !point.requested && i > 0) continue;
      if (!point.requested && in_a_row >= patience) {
        ++unknown_;
        continue;
      }
      VariedPoint solved = solve_point(branch, i);
      if (solved.solution.status == Solution::Status::refused) {
        refused_ = std::move(solved);
        cut(branch, i == 0 ? 0 : good + 1);
        break;
      }
      const bool unknown = solved.solution.status == Solution::Status::failed;
      in_a_row = unknown ? in_a_row + 1 : 0;
      if (!unknown) good = i;
      if (solved.solution.solved()) good_ = {i, solved};
      if (unknown && !point.requested) ++unknown_;
      if (point.requested || (shows_steps() && !unknown)) shown.push_back(std::move(solved));
    }
    for (VariedPoint& point : shown) result_.points.push_back(std::move(point));
    for (const BranchEvent& event : branch.events) {
      result_.events.push_back({describe(event.kind), event.name, event.point.parameter, event.error_bound,
                                value_of(event.point.reports, "final_time"), event.before, event.after});
    }
  }

  void cut(Branch& branch, std::size_t length) const {
    branch.points.resize(length);
    std::erase_if(branch.events, [&](const BranchEvent& e) { return e.position >= length; });
    branch.reached = false;
    branch.message = fmt::format("from {} = {:.12g} on: {}", variation_.name, refused_->parameter,
                                 refused_->solution.message);
  }

  VariedPoint solve_point(const Branch& branch, std::size_t i) {
    const BranchPoint& point = branch.points[i];
    const auto before = std::count_if(branch.events.begin(), branch.events.end(),
                                      [&](const BranchEvent& e) { return e.position <= i; });
    const Stretch& stretch = branch.stretches[point.stretch];
    Shooting shooting(stretch.problem);
    std::vector<double> parameters = stretch.parameters;
    parameters[stretch.place] = point.parameter;
    shooting.set_parameters(parameters);
    VariedPoint result{.parameter = point.parameter,
                       .events_before = result_.events.size() + static_cast<std::size_t>(before),
                       .requested = point.requested,
                       .solution = solve(shooting, point.y, scene_.options),
                       .closed_form = std::nullopt,
                       .derivatives = {},
                       .iterations = point.iterations};
    add(result_.cost, result.solution.cost);
    if (!result.solution.solved()) return result;
    result.derivatives = derivatives(shooting, result.solution.y, variation_.name);
    if (scene_.judge) result.objection = scene_.judge(result.solution);
    return result;
  }

  /// Where the branch is taken up again, in the direction in which it was going: the extremal of a scene beyond its end that is
  /// nearest to what the end leads to expect.
  std::optional<BranchStart> beyond(const Branch& branch) {
    const auto end = last_known(branch);
    if (!end) return std::nullopt;
    const BranchPoint& last = branch.points[end->first];
    const double direction = last.tangent.tail(1)[0] < 0.0 ? -1.0 : 1.0;
    goal_ = (variation_.to > variation_.from) == (direction > 0.0) ? variation_.to : variation_.from;
    const double range = std::abs(variation_.to - variation_.from);
    constexpr double shortest = 1e-4, longest = 1e-2;
    distance_ = std::abs(last.parameter - begin_) > 10.0 * distance_ * range ? shortest
                                                                             : std::min(longest, 10.0 * distance_);
    for (double distance = distance_; distance <= longest; distance *= 10.0) {
      const double value = last.parameter + direction * distance * range;
      if ((goal_ - value) * direction <= 0.0) return std::nullopt;
      const Outcome outcome = solve_at(value);
      const auto start = nearest_extremal(outcome, end->second, value);
      if (!start) continue;
      const bool limit = !branch.events.empty() && branch.events.back().kind == EventKind::limit;
      const std::string before = structure_name(*branch.stretches.back().problem), after = structure_name(*start->problem);
      if (limit && before == after) continue;  // not yet beyond
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

  /// The last point of a branch that can be solved by itself: where unknowns become singular the very last ones cannot.
  std::optional<std::pair<std::size_t, VariedPoint>> last_known(const Branch& branch) {
    if (shows_steps()) return good_;
    for (std::size_t back = 1; back <= branch.points.size(); back *= 2) {
      const std::size_t i = branch.points.size() - back;
      if (good_ && i <= good_->first) return good_;
      VariedPoint point = solve_point(branch, i);
      if (point.solution.solved()) return std::pair{i, std::move(point)};
    }
    return good_;
  }

  /// How far an extremal is from what a point of the branch leads to expect at another value of the parameter: the largest difference of
  /// the final time and the costates, which are continuous where arcs come and go, by what may be expected of a straight line.
  static double mismatch(const Solution& extremal, const VariedPoint& point, double value) {
    double worst = 0.0;
    for (const BranchReport& report : point.derivatives) {
      if (report.name != "final_time" && !report.name.starts_with("lambda")) continue;
      for (const Quantity& found : extremal.reports) {
        if (found.name != report.name) continue;
        const double change = report.derivative * (value - point.parameter);
        const double admitted = 0.5 * std::abs(change) + 1e-3 * std::abs(report.value) + 1e-9;
        worst = std::max(worst, std::abs(found.value - report.value - change) / admitted);
      }
    }
    return worst;
  }

  std::optional<BranchStart> nearest_extremal(const Outcome& outcome, const VariedPoint& point, double value) const {
    if (outcome.closed_form) return std::nullopt;
    std::optional<BranchStart> nearest;
    double least = 2.0;  // near a fold a straight line is a poor guide
    const auto consider = [&](const Solution& extremal, const auto& start) {
      const double far = mismatch(extremal, point, value);
      if (far > least) return;
      least = far;
      nearest = start();
    };
    if (outcome.solved()) consider(outcome.solution, [&] { return start_of(outcome); });
    for (const Solution& other : outcome.other_extremals) {
      consider(other, [&] { return std::optional(BranchStart{other.problem, other.parameters, other.y}); });
    }
    return nearest;
  }

  void finish(const Branch& branch) {
    if (refused_) {
      refused_->events_before = result_.events.size();
      result_.points.push_back(std::move(*refused_));
    }
    const auto refused = std::count_if(result_.points.begin(), result_.points.end(),
                                       [](const VariedPoint& p) { return !p.closed_form && !p.solution.solved(); });
    result_.message = branch.message;
    if (unknown_ > 0) {
      result_.message += fmt::format("{}{} steps close to an event are left out: they are not known to the accuracy",
                                     result_.message.empty() ? "" : "; ", unknown_);
    }
    if (goal_ != variation_.to)
      result_.message = "the branch turns back at a fold: there is no solution of this family beyond";
    if (!branch.reached || goal_ != variation_.to) {
      const Outcome target = solve_at(variation_.to);
      if (target.status == Outcome::Status::infeasible)
        result_.message += fmt::format("; at {:g}: {}", variation_.to, target.message);
    }
    if (refused > 0) {
      result_.message += fmt::format("{}{} of {} points could not be solved to the accuracy or verified",
                                     result_.message.empty() ? "" : "; ", refused, result_.points.size());
    }
    const bool arrived = branch.reached && goal_ == variation_.to;
    result_.status = arrived && refused == 0 ? Outcome::Status::solved : Outcome::Status::failed;
  }

  const VariedScene& scene_;
  const Variation& variation_;
  double begin_ = 0.0, goal_ = 0.0;  ///< of the part of the branch that is being followed
  double distance_ = 1e-4;           ///< to the next place at which the branch is taken up again, by the whole range
  int unknown_ = 0;                  ///< steps that could not be solved to the accuracy
  std::optional<std::pair<std::size_t, VariedPoint>> good_;  ///< the last point of the branch that was solved, and its place
  std::optional<VariedPoint> refused_;                       ///< the root that is no solution at which the branch was cut
  VariedOutcome result_;
};

}  // namespace

VariedOutcome follow_variation(const VariedScene& scene) { return Follower(scene).run(); }

int deliver_variation(const VariedScene& scene, const CommandLine& line) {
  const VariedOutcome outcome = follow_variation(scene);
  scene.variation.store(scene.variation.from);
  if (!line.csv.empty() && !outcome.points.empty()) write_csv(csv_text(scene, outcome), line.csv);
  if (line.json) {
    fmt::print("{}\n", to_json(scene, outcome).dump(2));
  } else if (!line.quiet && line.csv != "-" && !outcome.points.empty()) {
    print_table(scene, outcome);
  }
  if (outcome.status != Outcome::Status::solved && !line.json) {
    fmt::print(stderr, "costate-{}: {}: {}\n", scene.heading().model, status_name(outcome.status), outcome.message);
  }
  return exit_status(outcome.status);
}

}  // namespace costate::tools
