#include "output.hpp"

#include "command_line.hpp"

#include <costate/error.hpp>

#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <system_error>
#include <unistd.h>

namespace costate::tools {

namespace {

using nlohmann::ordered_json;

/// Switching times are the reports t1, t2, …
bool is_switching_time(const Quantity& quantity) {
  return quantity.name.size() > 1 && quantity.name[0] == 't' &&
         quantity.name.find_first_not_of("0123456789", 1) == std::string::npos;
}

ordered_json number_or_null(const std::optional<double>& value) {
  return value ? ordered_json(*value) : ordered_json(nullptr);
}

ordered_json certificate_json(const Certificate& certificate) {
  ordered_json checks = ordered_json::array();
  for (const CheckResult& check : certificate.checks) {
    checks.push_back({{"name", check.name},
                      {"must_be", check.kind == PathCheck::Kind::nonnegative ? "nonnegative" : "zero"},
                      {"worst", check.worst},
                      {"time", check.time},
                      {"tolerance", check.tolerance},
                      {"holds", check.holds()}});
  }
  return {{"verdict", certificate.holds() ? "extremal" : "rejected"},
          {"largest_residual", certificate.largest_residual},
          {"largest_residual_row", certificate.largest_row},
          {"condition", certificate.condition},
          {"checks", std::move(checks)}};
}

/// The quantities of an extremal that are results: final time, switching times, unknowns, with their bounds.
void add_results(ordered_json& into, const Heading& heading, const std::vector<Quantity>& quantities) {
  ordered_json unknowns = ordered_json::object(), bounds = ordered_json::object();
  ordered_json switching = ordered_json::array(), switching_bounds = ordered_json::array();
  const Quantity& final_time = find({&quantities}, "final_time");
  bounds["final_time"] = final_time.error_bound;
  for (const Quantity& quantity : quantities) {
    if (!is_switching_time(quantity)) continue;
    switching.push_back(quantity.value);
    switching_bounds.push_back(quantity.error_bound);
  }
  bounds["switching_times"] = std::move(switching_bounds);
  for (const std::string& name : heading.unknowns) {
    unknowns[name] = find({&quantities}, name).value;
    bounds[name] = find({&quantities}, name).error_bound;
  }
  into["final_time"] = final_time.value;
  into["switching_times"] = std::move(switching);
  into["unknowns"] = std::move(unknowns);
  into["error_bound"] = std::move(bounds);
}

/// Kinds of the arcs of a solved scene.
std::vector<std::string> structure(const Outcome& outcome) {
  if (!outcome.solved()) return {};
  return outcome.closed_form ? std::vector{outcome.closed_form->name} : outcome.solution.problem->structure();
}

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
}

}  // namespace

const char* status_name(Outcome::Status status) {
  switch (status) {
    case Outcome::Status::solved: return "solved";
    case Outcome::Status::infeasible: return "infeasible";
    case Outcome::Status::failed: return "failed";
  }
  return "";
}

ordered_json to_json(const Heading& heading, const Outcome& outcome, Method method) {
  ordered_json scene, limits = ordered_json::object();
  for (const SceneValue& value : heading.scene) scene[value.name] = number_or_null(value.value);
  for (const SceneValue& limit : outcome.limits) limits[limit.name] = number_or_null(limit.value);
  ordered_json json{{"schema", "costate/1"},
                    {"model", heading.model},
                    {"scene", std::move(scene)},
                    {"engine", engine_name(method)},
                    {"status", status_name(outcome.status)},
                    {"structure", structure(outcome)},
                    {"final_time", nullptr},
                    {"switching_times", ordered_json::array()},
                    {"unknowns", ordered_json::object()},
                    {"limits", std::move(limits)},
                    {"error_bound", ordered_json::object()},
                    {"certificate", nullptr}};
  if (outcome.solved()) {
    add_results(json, heading, outcome.quantities());
    if (!outcome.closed_form) json["certificate"] = certificate_json(outcome.solution.certificate);
  }
  if (!outcome.other_extremals.empty()) {
    ordered_json& others = json["other_extremals"] = ordered_json::array();
    for (const Solution& other : outcome.other_extremals) {
      add_results(others.emplace_back(), heading, other.reports);
      others.back()["certificate"] = certificate_json(other.certificate);
      others.back()["message"] = other.message;
    }
  }
  json["cost"] = {{"seconds", outcome.cost.seconds},
                  {"steps", outcome.cost.steps},
                  {"rhs_evaluations", outcome.cost.rhs_evaluations},
                  {"sensitivity_evaluations", outcome.cost.sensitivity_evaluations},
                  {"newton_iterations", outcome.cost.newton_iterations}};
  json["message"] = outcome.message;
  return json;
}

void print_table(const Heading& heading, const Outcome& outcome) {
  fmt::print("{}\n  status          {}\n", heading.title, status_name(outcome.status));
  if (outcome.solved()) {
    fmt::print("  arcs            {}\n\n", joined(structure(outcome)));
    fmt::print("  {:<14}  {:>22}  {:<6}  {}\n", "quantity", "value", "unit", "error bound");
    for (const Quantity& quantity : outcome.quantities()) {
      fmt::print("  {:<14}  {:>22.15g}  {:<6}  {:.1e}\n", quantity.name, quantity.value, quantity.unit, quantity.error_bound);
    }
  }
  for (const SceneValue& limit : outcome.limits) {
    if (limit.value) fmt::print("  {:<14}  {:>22.15g}  {:<6}\n", limit.name, *limit.value, limit.unit);
  }
  for (const Solution& other : outcome.other_extremals) {
    fmt::print("  another extremal, no minimum or slower: final time {:.15g} s ({})\n", other["final_time"].value, other.message);
  }
  if (outcome.solved() && outcome.closed_form) {
    fmt::print("\n  {}\n", outcome.closed_form->note);
  } else if (outcome.solved()) {
    fmt::print("\n  condition of the shooting system {:.2g}, largest residual {:.1e}, {} integration steps, {:.1f} ms\n",
               outcome.solution.certificate.condition, outcome.solution.certificate.largest_residual, outcome.cost.steps,
               1e3 * outcome.cost.seconds);
  }
  if (!outcome.message.empty()) fmt::print("  {}\n", outcome.message);
}

int exit_status(Outcome::Status status) {
  switch (status) {
    case Outcome::Status::solved: return exit_solved;
    case Outcome::Status::infeasible: return exit_infeasible;
    case Outcome::Status::failed: return exit_failed;
  }
  return exit_failed;
}

int deliver(const Heading& heading, const Outcome& outcome, const CommandLine& line) {
  if (!line.csv.empty() && outcome.solved()) {
    write_csv(outcome.closed_form ? csv_text(*outcome.closed_form) : csv_text(outcome.solution), line.csv);
  }
  if (line.json) {
    fmt::print("{}\n", to_json(heading, outcome, line.method()).dump(2));
  } else if (!line.quiet && line.csv != "-" && outcome.solved()) {
    print_table(heading, outcome);
  }
  if (!outcome.solved() && !line.json) {
    fmt::print(stderr, "costate-{}: {}: {}\n", heading.model, status_name(outcome.status), outcome.message);
  }
  return exit_status(outcome.status);
}

void check_writable(const std::string& flag, const std::string& file) {
  if (file == "-") return;
  namespace fs = std::filesystem;
  std::error_code ignored;
  const fs::path path(file);
  const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  if (fs::exists(path, ignored) && !fs::is_regular_file(path, ignored)) {
    throw BadInput(fmt::format("{} {} is not a regular file: a file name in a folder that can be written is needed", flag, file));
  }
  if (!fs::is_directory(folder, ignored) || ::access(folder.c_str(), W_OK) != 0) {
    throw BadInput(fmt::format("{} {} cannot be written: {} is not a folder that can be written", flag, file, folder.string()));
  }
}

std::string csv_text(const Solution& solution, int points) {
  std::string text = "t [s],arc";
  for (const Column& column : solution.problem->columns()) text += fmt::format(",{} [{}]", column.name, column.unit);
  text += '\n';
  for (const ArcTrace& arc : solution.arcs) {
    const double share = (arc.end - arc.begin) / solution.final_time();
    const int cells = std::max(2, static_cast<int>(points * share + 0.5));
    for (int i = 0; i <= cells; ++i) {
      // Both ends of an arc belong to it: a control may jump at a junction, and the row then stands twice.
      const double t = i == cells ? arc.end : arc.begin + (arc.end - arc.begin) * i / cells;
      text += fmt::format("{:.17g},{}", t, solution.problem->structure()[static_cast<std::size_t>(arc.record.arc)]);
      for (const double value : solution.problem->observe(arc.point(arc.own(t)), solution.parameters)) text += fmt::format(",{:.17g}", value);
      text += '\n';
    }
  }
  return text;
}

std::string csv_text(const ClosedForm& closed_form) {
  std::string text = "t [s],arc";
  const Table& table = closed_form.trajectory;
  for (std::size_t i = 1; i < table.columns.size(); ++i) {
    text += fmt::format(",{} [{}]", table.columns[i].name, table.columns[i].unit);
  }
  text += '\n';
  for (const std::vector<double>& row : table.rows) {
    text += fmt::format("{:.17g},{}", row[0], closed_form.name);
    for (std::size_t i = 1; i < row.size(); ++i) text += fmt::format(",{:.17g}", row[i]);
    text += '\n';
  }
  return text;
}

void write_csv(const std::string& text, const std::string& file) {
  if (file == "-") {
    fmt::print("{}", text);
    return;
  }
  // Written beside and renamed: a reader sees the old file or the whole new one.
  const std::string partial = fmt::format("{}.{}.partial", file, ::getpid());
  std::FILE* out = std::fopen(partial.c_str(), "w");
  const bool written = out != nullptr && std::fwrite(text.data(), 1, text.size(), out) == text.size();
  const bool closed = out != nullptr && std::fclose(out) == 0;
  if (!written || !closed || std::rename(partial.c_str(), file.c_str()) != 0) {
    std::remove(partial.c_str());
    throw std::system_error(errno, std::generic_category(), fmt::format("--csv {}", file));
  }
}

}  // namespace costate::tools
