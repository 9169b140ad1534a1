/// A branch as a table for people, as JSON and as CSV.
#include "branch_run.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace costate::tools {

namespace {

using nlohmann::ordered_json;

ordered_json finite_or_null(double value) { return std::isfinite(value) ? ordered_json(value) : ordered_json(nullptr); }

bool solved(const VariedPoint& point) { return point.closed_form || point.solution.solved(); }

std::string structure_of(const VariedPoint& point) {
  if (point.closed_form) return point.closed_form->name;
  return point.solution.problem ? structure_name(*point.solution.problem) : "";
}

const std::vector<Quantity>& quantities(const VariedPoint& point) {
  return point.closed_form ? point.closed_form->quantities : point.solution.reports;
}

const Quantity* quantity(const VariedPoint& point, const std::string& name) {
  const auto& all = quantities(point);
  const auto found = std::find_if(all.begin(), all.end(), [&](const Quantity& q) { return q.name == name; });
  return found == all.end() ? nullptr : &*found;
}

/// d/dp of a quantity; not a number where the branch does not have it.
double derivative(const VariedPoint& point, const std::string& name) {
  const auto found = std::find_if(point.derivatives.begin(), point.derivatives.end(),
                                  [&](const BranchReport& r) { return r.name == name; });
  return found == point.derivatives.end() ? std::nan("") : found->derivative + 0.0;  // no negative zero
}

void print_event(const VariedScene& scene, const VariedEvent& event) {
  fmt::print("  -- {} at {} = {:.12g}{}{}: {}{}{}\n", event.kind, scene.variation.name, event.parameter,
             scene.variation.unit.empty() ? "" : " ", scene.variation.unit, event.name,
             event.before == event.after ? "" : fmt::format("; {} -> ", event.before),
             event.before == event.after ? ""
             : event.after.empty()       ? "none known"
                                         : event.after);
}

/// A cell of a CSV line: quoted where it holds a comma or a quote.
std::string cell(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + '"';
}

double per_point(double amount, const VariedOutcome& outcome) { return amount / std::max(1, outcome.branch_points); }

}  // namespace

ordered_json to_json(const VariedScene& scene, const VariedOutcome& outcome) {
  const Heading heading = scene.heading();
  ordered_json values = ordered_json::object();
  for (const SceneValue& value : heading.scene)
    values[value.name] = value.value ? ordered_json(*value.value) : ordered_json(nullptr);
  values.erase(scene.variation.name);
  ordered_json points = ordered_json::array(), events = ordered_json::array();
  for (const VariedPoint& point : outcome.points) {
    ordered_json results = ordered_json::object();
    if (solved(point)) {
      for (const Quantity& q : quantities(point)) {
        results[q.name] = {{"value", q.value},
                           {"error_bound", finite_or_null(q.error_bound)},
                           {"derivative", finite_or_null(derivative(point, q.name))},
                           {"unit", q.unit}};
      }
    }
    points.push_back({{"parameter", point.parameter},
                      {"status", solved(point) ? "solved" : "refused"},
                      {"structure", structure_of(point)},
                      {"requested", point.requested},
                      {"objection", point.objection},
                      {"quantities", std::move(results)},
                      {"iterations", point.iterations},
                      {"events_before", point.events_before},
                      {"message", point.solution.message}});
  }
  for (const VariedEvent& event : outcome.events) {
    events.push_back({{"kind", event.kind},
                      {"name", event.name},
                      {"parameter", event.parameter},
                      {"error_bound", finite_or_null(event.error_bound)},
                      {"final_time", event.final_time ? finite_or_null(*event.final_time) : ordered_json(nullptr)},
                      {"before", event.before},
                      {"after", event.after}});
  }
  return {{"schema", "costate-branch/1"},
          {"model", heading.model},
          {"scene", std::move(values)},
          {"engine", engine_name(scene.options.method)},
          {"vary",
           {{"name", scene.variation.name},
            {"unit", scene.variation.unit},
            {"from", scene.variation.from},
            {"to", scene.variation.to},
            {"count", scene.variation.count ? ordered_json(*scene.variation.count) : ordered_json(nullptr)}}},
          {"status", status_name(outcome.status)},
          {"points", std::move(points)},
          {"events", std::move(events)},
          {"cost",
           {{"points", outcome.branch_points},
            {"newton_iterations_on_events", outcome.event_iterations},
            {"newton_iterations_per_point",
             per_point(static_cast<double>(outcome.follow_cost.newton_iterations - outcome.event_iterations), outcome)},
            {"steps_per_point", per_point(static_cast<double>(outcome.follow_cost.steps), outcome)},
            {"seconds_per_point", per_point(outcome.follow_cost.seconds, outcome)},
            {"seconds", outcome.cost.seconds}}},
          {"message", outcome.message}};
}

void print_table(const VariedScene& scene, const VariedOutcome& outcome) {
  const Heading heading = scene.heading();
  const Variation& variation = scene.variation;
  const std::string parameter = variation.unit.empty() ? variation.name
                                                       : fmt::format("{} [{}]", variation.name, variation.unit);
  fmt::print("{}\n  {:>20}  {:>20}  {:>8}  {:>16}", heading.title, parameter, "final_time [s]", "bound",
             "d/d" + variation.name);
  for (const std::string& name : heading.unknowns) fmt::print("  {:>14}", name);
  fmt::print("  arcs\n");
  std::size_t event = 0;
  const auto events_until = [&](std::size_t end) {
    for (; event < end; ++event) print_event(scene, outcome.events[event]);
  };
  for (const VariedPoint& point : outcome.points) {
    events_until(point.events_before);
    if (!solved(point)) {
      fmt::print("  {:>20.15g}  refused: {}\n", point.parameter, point.solution.message);
      continue;
    }
    const Quantity& time = *quantity(point, "final_time");
    const double slope = derivative(point, "final_time");
    fmt::print("  {:>20.15g}  {:>20.14f}  {:>8.1e}  {:>16}", point.parameter, time.value, time.error_bound,
               std::isnan(slope) ? "-" : fmt::format("{:.10g}", slope));
    for (const std::string& name : heading.unknowns) {
      const Quantity* unknown = quantity(point, name);
      fmt::print("  {:>14}", unknown == nullptr ? "-" : fmt::format("{:.10g}", unknown->value));
    }
    fmt::print("  {}{}{}\n", structure_of(point), point.objection.empty() ? "" : "; ", point.objection);
  }
  events_until(outcome.events.size());
  const double iterations = static_cast<double>(outcome.follow_cost.newton_iterations - outcome.event_iterations);
  fmt::print("\n  {} points followed, {:.1f} Newton iterations, {:.0f} integration steps and {:.2f} ms each;\n",
             outcome.branch_points, per_point(iterations, outcome),
             per_point(static_cast<double>(outcome.follow_cost.steps), outcome),
             1e3 * per_point(outcome.follow_cost.seconds, outcome));
  fmt::print("  {} events, {} Newton iterations on them; {:.0f} ms in all\n", outcome.events.size(),
             outcome.event_iterations, 1e3 * outcome.cost.seconds);
}

std::string csv_text(const VariedScene& scene, const VariedOutcome& outcome) {
  // Switching times come and go with the structure: the columns are those of all points.
  std::vector<Quantity> columns;
  for (const VariedPoint& point : outcome.points) {
    for (const Quantity& q : quantities(point)) {
      if (std::none_of(columns.begin(), columns.end(), [&](const Quantity& c) { return c.name == q.name; }))
        columns.push_back(q);
    }
  }
  std::string text = fmt::format("{} [{}],status,arcs,objection", scene.variation.name, scene.variation.unit);
  for (const Quantity& c : columns) {
    text += fmt::format(",{0} [{1}],{0} bound,d {0}/d {2}", c.name, c.unit, scene.variation.name);
  }
  text += '\n';
  for (const VariedPoint& point : outcome.points) {
    text += fmt::format("{:.17g},{},{},{}", point.parameter, solved(point) ? "solved" : "refused", structure_of(point),
                        cell(solved(point) ? point.objection : point.solution.message));
    for (const Quantity& c : columns) {
      const Quantity* q = solved(point) ? quantity(point, c.name) : nullptr;
      const double slope = derivative(point, c.name);
      text += q == nullptr ? ",,,"
                           : fmt::format(",{:.17g},{:.3g},{}", q->value, q->error_bound,
                                         std::isfinite(slope) ? fmt::format("{:.17g}", slope) : "");
    }
    text += '\n';
  }
  return text;
}

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
