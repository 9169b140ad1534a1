/// \file
/// A scene along a varied number: what every tool does for --vary.
#pragma once

#include "command_line.hpp"
#include "output.hpp"

#include <costate/shooting/branch.hpp>
#include <costate/shooting/solve.hpp>

namespace costate::tools {

/// What a tool knows of its scenes.
struct VariedScene {
  Variation variation;
  std::function<Heading()> heading;  ///< of the scene as it is now
  std::function<Outcome()> solve;    ///< the scene as it is now, from itself alone
  /// The problem to follow the scene's solution with. Empty, or nothing returned: the problem of the outcome.
  std::function<std::optional<BranchStart>(const Outcome&)> start{};
  Restructure restructure{};
  /// Why a solved extremal is no minimum after all; empty if nothing is known.
  /// The problem stated anew at a root whose arcs are no longer the right ones for it, with the same unknowns.
  std::function<std::optional<BranchStart>(const Solution& refused)> restate{};
  std::function<std::string(const Solution&)> judge{};
  SolveOptions options{};
};

/// A point of the branch that is shown: solved and verified by itself.
struct VariedPoint {
  double parameter = 0.0;
  std::size_t events_before = 0;  ///< events that come before it
  bool requested = false;
  Solution solution;  ///< empty where a closed form is the answer
  std::optional<ClosedForm> closed_form;
  std::string objection{};          ///< why the extremal is no minimum, if that is known
  std::vector<BranchReport> derivatives;  ///< of the branch's reports
  int iterations = 0;
};

/// An event of the branch, or the place where it was taken up again from a scene solved cold.
struct VariedEvent {
  std::string kind;
  std::string name;
  double parameter = 0.0;
  double error_bound = 0.0;
  std::optional<double> final_time;
  std::string before, after;
};

struct VariedOutcome {
  Outcome::Status status = Outcome::Status::failed;
  std::string message;
  std::vector<VariedPoint> points;
  std::vector<VariedEvent> events;
  int branch_points = 0;  ///< that were followed, shown or not
  long event_iterations = 0;  ///< of Newton's method, on events
  Cost follow_cost;       ///< of following the branch
  Cost cost;              ///< of everything
};

/// The extremal of a scene that continues a branch from a point of it to another value of the parameter; null if none is near what the
/// point leads to expect.
[[nodiscard]] const Solution* nearest_extremal(const Outcome& outcome, const VariedPoint& point, double value);

/// Follows a scene. Each point shown is solved by itself to the wanted accuracy, from the branch's. Where the branch cannot
/// be followed further (another statement of the problem is needed there) it is taken up again a little beyond, from the
/// scene solved cold, if the final time there is what the branch leads to expect. Solved if `to` was reached and every point
/// was.
[[nodiscard]] VariedOutcome follow_variation(const VariedScene& scene);

/// Follows, prints as the flags ask, and returns the exit status.
int deliver_variation(const VariedScene& scene, const CommandLine& line);

[[nodiscard]] nlohmann::ordered_json to_json(const VariedScene& scene, const VariedOutcome& outcome);
void print_table(const VariedScene& scene, const VariedOutcome& outcome);
/// Header, and one line a point; why a point is no minimum, or no solution, is its objection. Events have no line.
[[nodiscard]] std::string csv_text(const VariedScene& scene, const VariedOutcome& outcome);

}  // namespace costate::tools
