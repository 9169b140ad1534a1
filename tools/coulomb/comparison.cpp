#include "comparison.hpp"

#include "common/command_line.hpp"

#include <algorithm>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace costate::coulomb {

namespace {

nlohmann::ordered_json row_json(const Compared& row) {
  nlohmann::ordered_json json{{"curve", row.name}, {"status", row.outcome.solved() ? "arrives" : "does not arrive"}};
  if (row.outcome.solved()) {
    for (const Quantity& q : row.outcome.quantities()) json[q.name] = q.value;
    json["error_bound"] = row.outcome["final_time"].error_bound;
  } else {
    json["final_time"] = nullptr;
  }
  for (const tools::SceneValue& limit : row.outcome.limits) {
    if (limit.name == "mu_finish") json[limit.name] = limit.value.value();
  }
  json["message"] = row.outcome.message;
  return json;
}

}  // namespace

int deliver_comparison(const tools::Heading& heading, const std::vector<Compared>& all, const tools::CommandLine& line) {
  const tools::Outcome& optimum = all.front().outcome;
  if (line.json) {
    nlohmann::ordered_json object = tools::to_json(heading, optimum, line.method());
    for (const Compared& row : all) object["curves"].push_back(row_json(row));
    fmt::print("{}\n", object.dump(2));
    return tools::exit_status(optimum.status);
  }
  if (!optimum.solved()) return tools::deliver(heading, optimum, line);
  if (!line.quiet) {
    const double least = optimum["final_time"].value;
    fmt::print("{}\n\n  {:<10}  {:>22}  {:>12}  {:>16}\n", heading.title, "curve", "final time [s]", "slower by [%]",
               "end speed [m/s]");
    for (const Compared& row : all) {
      if (!row.outcome.solved()) {
        fmt::print("  {:<10}  {}\n", row.name, row.outcome.message);
        continue;
      }
      const double time = row.outcome["final_time"].value;
      const double slower = std::max(0.0, 100.0 * (time / least - 1.0));  // equal times differ by their errors
      fmt::print("  {:<10}  {:>22.15g}  {:>13.6f}  {:>16.9g}\n", row.name, time, slower, row.outcome["end_speed"].value);
    }
  }
  return tools::exit_status(optimum.status);
}

}  // namespace costate::coulomb
