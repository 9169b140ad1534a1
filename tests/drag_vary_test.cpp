/// --vary on the tool of the drag model.
#include "bead_vary.hpp"

#include <algorithm>

namespace costate::tools {
namespace {

class DragVary : public BeadVary {};

TEST_F(DragVary, EveryPointIsWhatTheSceneAloneGives) {
  expect_points_of_scenes("mu", 0.1, 0.5);
  expect_points_of_scenes("speed", 2, 6);
  expect_points_of_scenes("y", -2, -0.5);
}

// Without friction the scene alone is in closed form, and the branch starts from it.
TEST_F(DragVary, FrictionMayStartFromNothing) {
  expect_points_of_scenes("mu", 0, 0.5, {"--beta", "0"});
  expect_points_of_scenes("x", 2, 8, {"--mu", "0", "--beta", "0"});
}

TEST_F(DragVary, ObjectionsHoldTogetherInCsv) {
  const Ended got = run({"--vary", "beta=0.003:0.02", "--csv", "-"});
  EXPECT_EQ(got.status, 4);
  std::istringstream lines(got.out);
  std::string header, line;
  std::getline(lines, header);
  const auto columns = std::count(header.begin(), header.end(), ',');
  int objections = 0;
  while (std::getline(lines, line)) {
    bool quoted = false;
    std::ptrdiff_t separators = 0;
    for (const char c : line) {
      if (c == '"') quoted = !quoted;
      separators += c == ',' && !quoted ? 1 : 0;
    }
    EXPECT_EQ(separators, columns) << line;
    objections += contains(line, "not a minimum") ? 1 : 0;
  }
  EXPECT_GE(objections, 2);
}

// With β > 0 the minimum meets the extremal that dives into the thrust, and the branch goes on with that: no minimum.
TEST_F(DragVary, BeyondTheFoldExtremalsAreNamedNoMinima) {
  const Ended got = run({"--vary", "beta=0.003:0.02", "--json"});
  EXPECT_EQ(got.status, 4) << "there is nothing beyond the fold";
  const json branch = json::parse(got.out);
  ASSERT_FALSE(branch.at("events").empty());
  const json& fold = branch.at("events")[0];
  EXPECT_EQ(fold.at("kind"), "fold");
  int beyond = 0;
  for (const json& point : branch.at("points")) {
    if (point.at("status") != "solved") continue;
    const bool second = point.at("events_before") > 0;
    EXPECT_EQ(contains(point.at("objection"), "not a minimum"), second) << point.dump();
    EXPECT_LT(point.at("parameter").get<double>(), fold.at("parameter").get<double>());
    beyond += second ? 1 : 0;
  }
  EXPECT_GE(beyond, 2);
  // The same place as the limit that the scene solved alone names beyond it.
  const json alone = json::parse(run({"--beta", "0.02", "--json"}).out);
  EXPECT_NEAR(alone.at("limits").at("beta_max").get<double>(), fold.at("parameter").get<double>(), 1e-9);
}

// The second extremal of the reference (v₀ = 2, μ = 0.3, β = 0.004) has T = 1.86021418984332; the branch comes to it beyond the fold.
TEST_F(DragVary, BothExtremalsOfTheReferenceLieOnOneBranch) {
  const nlohmann::json branch = nlohmann::json::parse(run({"--vary", "beta=0.003:0.02", "--at", "0.004", "--json"}).out);
  std::vector<nlohmann::json> at;
  for (const nlohmann::json& point : branch.at("points")) {
    if (point.at("parameter") == 0.004) at.push_back(point);
  }
  ASSERT_EQ(at.size(), 2U) << "on either side of the fold";
  EXPECT_NEAR(at[0].at("quantities").at("final_time").at("value").get<double>(), 1.46879215211720, 1e-8);
  EXPECT_EQ(at[0].at("objection"), "");
  EXPECT_NEAR(at[1].at("quantities").at("final_time").at("value").get<double>(), 1.86021418984332, 1e-8);
  EXPECT_TRUE(contains(at[1].at("objection"), "not a minimum")) << at[1].at("objection");
}

}  // namespace
}  // namespace costate::tools
