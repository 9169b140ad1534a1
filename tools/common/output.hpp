/// \file
/// What every tool prints: a table for people, one JSON object for programs, a trajectory as CSV.
#pragma once

#include "outcome.hpp"

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace costate::tools {

class CommandLine;

/// What a tool says about itself and the scene it was given.
struct Heading {
  std::string model;                  ///< name of the model, "disk"
  std::string title;                  ///< what it is, for people
  std::vector<SceneValue> scene;      ///< as given
  std::vector<std::string> unknowns;  ///< names of the quantities that are the scene's unknowns
};

/// `method`: what integrated.
[[nodiscard]] nlohmann::ordered_json to_json(const Heading& heading, const Outcome& outcome, Method method);
void print_table(const Heading& heading, const Outcome& outcome);

[[nodiscard]] const char* status_name(Outcome::Status status);

/// The exit status that belongs to an outcome.
[[nodiscard]] int exit_status(Outcome::Status status);

/// Prints as the flags ask and returns the exit status that belongs to the outcome.
int deliver(const Heading& heading, const Outcome& outcome, const CommandLine& line);

/// \throws BadInput naming flag and file if the file cannot be created or replaced.
void check_writable(const std::string& flag, const std::string& file);

/// The trajectory of a solution: time, name of the arc's kind and the problem's columns, about `points` rows, each arc with both
/// its ends.
[[nodiscard]] std::string csv_text(const Solution& solution, int points = 200);
[[nodiscard]] std::string csv_text(const ClosedForm& closed_form);
/// Writes a text to a file, whole or not at all. "-" is standard output.
void write_csv(const std::string& text, const std::string& file);

}  // namespace costate::tools
