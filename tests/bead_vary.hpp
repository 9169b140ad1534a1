/// \file
/// What --vary must do on every tool of a bead: each point is what the scene alone gives.
#pragma once

#include "run_tool.hpp"

#include <cmath>

namespace costate::tools {

class BeadVary : public ToolTest {
 protected:
  BeadVary() : ToolTest(COSTATE_TOOL) {}

  /// Varies a number in four values and compares each point with the scene solved alone.
  void expect_points_of_scenes(const std::string& name, double from, double to) {
    const nlohmann::json branch = solved_json({"--vary", fmt::format("{}={}:{}:4", name, from, to)});
    ASSERT_EQ(branch.at("points").size(), 4u) << name;
    for (const nlohmann::json& point : branch.at("points")) {
      const double parameter = point.at("parameter").get<double>();
      const nlohmann::json alone = solved_json({"--" + name, fmt::format("{:.17g}", parameter)});
      const nlohmann::json& time = point.at("quantities").at("final_time");
      const double bound = time.at("error_bound").get<double>() + alone.at("error_bound").at("final_time").get<double>() +
                           1e-15;
      EXPECT_NEAR(time.at("value").get<double>(), alone.at("final_time").get<double>(), bound) << name << ' ' << parameter;
    }
  }
};

}  // namespace costate::tools
