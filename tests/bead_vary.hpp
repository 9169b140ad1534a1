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
  void expect_points_of_scenes(const std::string& name, double from, double to, const Arguments& scene = {}) {
    Arguments vary = scene;
    vary.insert(vary.end(), {"--vary", fmt::format("{}={}:{}:4", name, from, to)});
    const json branch = solved_json(vary);
    EXPECT_EQ(branch.at("vary").at("count"), 4);
    for (const json& event : branch.at("events")) EXPECT_NE(event.at("kind"), "fold") << name;
    ASSERT_EQ(branch.at("points").size(), 4u) << name;
    for (const json& point : branch.at("points")) {
      const double parameter = point.at("parameter").get<double>();
      Arguments single = scene;
      single.insert(single.end(), {"--" + name, fmt::format("{:.17g}", parameter)});
      const json alone = solved_json(single);
      const json& time = point.at("quantities").at("final_time");
      const double bound = time.at("error_bound").get<double>() + alone.at("error_bound").at("final_time").get<double>() +
                           1e-15;
      EXPECT_NEAR(time.at("value").get<double>(), alone.at("final_time").get<double>(), bound) << name << ' ' << parameter;
      // The costates are the derivatives of the final time with respect to the end point.
      if ((name != "x" && name != "y") || time.at("derivative").is_null()) continue;
      const json& costate = point.at("quantities").at("lambda_" + name);
      EXPECT_NEAR(time.at("derivative").get<double>(), costate.at("value").get<double>(), 1e-7) << name << ' ' << parameter;
    }
  }
};

}  // namespace costate::tools
