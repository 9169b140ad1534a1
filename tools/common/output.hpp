/// \file
/// What every tool prints: a table for people, one JSON object for programs, a trajectory as CSV.
#pragma once

#include <costate/shooting/solution.hpp>

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

namespace costate::tools {

/// A scene value as given; none if left out.
struct SceneValue {
  std::string name;
  std::string unit;
  std::optional<double> value;
};

/// A result of a tool, whatever the model.
struct Result {
  std::string model;                         ///< name of the model, "disk"
  std::string title;                         ///< what it is, for people
  std::vector<SceneValue> scene;
  std::string status;                        ///< solved, infeasible or failed
  std::vector<std::string> structure;        ///< kinds of the arcs; empty unless solved
  const Solution* solution = nullptr;        ///< set if solved
  std::vector<std::string> unknowns;         ///< names of the reports that are the scene's unknowns
  std::vector<SceneValue> limits;            ///< F_max, k_min, …
  Cost cost;
  std::string message;
};

[[nodiscard]] nlohmann::ordered_json to_json(const Result& result);
void print_table(const Result& result);

/// Prints as the flags ask and returns the exit status that belongs to the result's status.
int deliver(const Result& result, bool json, bool quiet, const std::string& csv);

/// \throws BadInput naming flag and file if the file cannot be created or replaced.
void check_writable(const std::string& flag, const std::string& file);
/// The trajectory, about `points` rows, each arc with both its ends; whole or not at all. "-" is standard output.
void write_csv(const Solution& solution, const std::string& file, int points = 200);

}  // namespace costate::tools
