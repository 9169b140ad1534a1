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

  /// One event between the values, at the same place whichever way it is met, and the scenes on either side of it, solved alone, have
  /// the structures that it names.
  void expect_event_between(const std::string& name, double from, double to, const Arguments& scene = {}) {
    const auto event = [&](double a, double b) {
      Arguments vary = scene;
      vary.insert(vary.end(), {"--vary", fmt::format("{}={}:{}:2", name, a, b)});
      const json branch = solved_json(vary);
      EXPECT_EQ(branch.at("events").size(), 1u) << name;
      return branch.at("events").at(0);
    };
    const json up = event(from, to), down = event(to, from);
    const double place = up.at("parameter").get<double>();
    EXPECT_NEAR(place, down.at("parameter").get<double>(), 1e-10 * std::max(1.0, std::abs(place)));
    EXPECT_EQ(up.at("before"), down.at("after"));
    EXPECT_EQ(up.at("after"), down.at("before"));
    const double beside = 1e-3 * (to - from);
    for (const auto& [value, structure] :
         {std::pair{place - beside, up.at("before")}, std::pair{place + beside, up.at("after")}}) {
      Arguments single = scene;
      single.insert(single.end(), {"--" + name, fmt::format("{:.17g}", value)});
      std::string arcs;
      const json alone = solved_json(single);
      for (const json& arc : alone.at("structure")) arcs += (arcs.empty() ? "" : "-") + arc.get<std::string>();
      EXPECT_EQ(arcs, structure.get<std::string>()) << name << ' ' << value;
    }
  }
};

}  // namespace costate::tools
