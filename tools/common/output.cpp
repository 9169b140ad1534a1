#include "output.hpp"

#include "command_line.hpp"

#include <costate/error.hpp>

#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <fmt/format.h>
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

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
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
      const Eigen::VectorXd both = arc.trajectory.at(arc.own(t));
      const Eigen::Index n = arc.record.state.size();
      const ArcPoint point{&arc.record, t, both.head(n), both.tail(both.size() - n)};
      text += fmt::format("{:.17g},{}", t, solution.problem->structure()[static_cast<std::size_t>(arc.record.arc)]);
      for (const double value : solution.problem->observe(point, solution.parameters)) text += fmt::format(",{:.17g}", value);
      text += '\n';
    }
  }
  return text;
}

}  // namespace

nlohmann::ordered_json to_json(const Result& result) {
  ordered_json scene, unknowns = ordered_json::object(), bounds = ordered_json::object(), limits = ordered_json::object();
  for (const SceneValue& value : result.scene) scene[value.name] = number_or_null(value.value);
  for (const SceneValue& limit : result.limits) limits[limit.name] = number_or_null(limit.value);
  ordered_json switching = ordered_json::array(), switching_bounds = ordered_json::array();
  ordered_json final_time = nullptr, certificate = nullptr;
  if (result.solution != nullptr) {
    final_time = (*result.solution)["final_time"].value;
    bounds["final_time"] = (*result.solution)["final_time"].error_bound;
    for (const Quantity& quantity : result.solution->reports) {
      if (!is_switching_time(quantity)) continue;
      switching.push_back(quantity.value);
      switching_bounds.push_back(quantity.error_bound);
    }
    bounds["switching_times"] = switching_bounds;
    for (const std::string& name : result.unknowns) {
      unknowns[name] = (*result.solution)[name].value;
      bounds[name] = (*result.solution)[name].error_bound;
    }
    certificate = certificate_json(result.solution->certificate);
  }
  return {{"schema", "costate/1"},
          {"model", result.model},
          {"scene", std::move(scene)},
          {"status", result.status},
          {"structure", result.structure},
          {"final_time", std::move(final_time)},
          {"switching_times", std::move(switching)},
          {"unknowns", std::move(unknowns)},
          {"limits", std::move(limits)},
          {"error_bound", std::move(bounds)},
          {"certificate", std::move(certificate)},
          {"cost",
           {{"seconds", result.cost.seconds},
            {"steps", result.cost.steps},
            {"rhs_evaluations", result.cost.rhs_evaluations},
            {"sensitivity_evaluations", result.cost.sensitivity_evaluations},
            {"newton_iterations", result.cost.newton_iterations}}},
          {"message", result.message}};
}

void print_table(const Result& result) {
  fmt::print("{}\n  status          {}\n", result.title, result.status);
  if (result.solution != nullptr) {
    const Solution& solution = *result.solution;
    fmt::print("  arcs            {}\n\n", joined(result.structure));
    fmt::print("  {:<14}  {:>22}  {:<6}  {}\n", "quantity", "value", "unit", "error bound");
    for (const Quantity& quantity : solution.reports) {
      fmt::print("  {:<14}  {:>22.15g}  {:<6}  {:.1e}\n", quantity.name, quantity.value, quantity.unit, quantity.error_bound);
    }
  }
  for (const SceneValue& limit : result.limits) {
    if (limit.value) fmt::print("  {:<14}  {:>22.15g}  {:<6}\n", limit.name, *limit.value, limit.unit);
  }
  if (result.solution != nullptr) {
    fmt::print("\n  condition of the shooting system {:.2g}, largest residual {:.1e}, {} integration steps, {:.1f} ms\n",
               result.solution->certificate.condition, result.solution->certificate.largest_residual, result.cost.steps,
               1e3 * result.cost.seconds);
  }
  if (!result.message.empty()) fmt::print("  {}\n", result.message);
}

int deliver(const Result& result, bool json, bool quiet, const std::string& csv) {
  const bool solved = result.status == "solved";
  if (!csv.empty() && solved) write_csv(*result.solution, csv);
  if (json) {
    fmt::print("{}\n", to_json(result).dump(2));
  } else if (!quiet && csv != "-" && solved) {
    print_table(result);
  }
  if (!solved && !json) fmt::print(stderr, "costate-{}: {}: {}\n", result.model, result.status, result.message);
  return solved ? exit_solved : result.status == "infeasible" ? exit_infeasible : exit_failed;
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

void write_csv(const Solution& solution, const std::string& file, int points) {
  const std::string text = csv_text(solution, points);
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
