/// The contract of costate-coulomb on its command line.
#include "run_tool.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>
#include <numbers>

namespace costate::tools {
namespace {

class CoulombTool : public ToolTest {
 protected:
  CoulombTool() : ToolTest(COSTATE_TOOL) {}
};

TEST_F(CoulombTool, BadInputIsStatusTwoAndSaysWhatIsAdmissible) {
  const std::vector<BadInput> cases{
      {{"--span", "0"}, {"--span", "0", "1e-06", "1e+06", "m"}},
      {{"--span", "-4"}, {"--span", "-4", "1e-06", "m"}},
      {{"--span", "1e300"}, {"--span", "1e300", "1e+06", "m"}},
      {{"--drop", "nan"}, {"--drop", "nan", "-1e+06", "m"}},
      {{"--drop", "1e300"}, {"--drop", "1e300", "1e+06", "m"}},
      {{"--drop", "1e-300", "--mu", "0"}, {"drop = 1e-300 m", "4e-15 m"}},
      {{"--drop", "1e-15", "--curve", "circle"}, {"drop = 1e-15 m", "4e-15 m"}},
      {{"--gravity", "0"}, {"--gravity", "0", "1e-06", "m/s^2"}},
      {{"--mu", "-0.1"}, {"--mu", "-0.1", "0", "1e+06"}},
      {{"--mu", "inf"}, {"--mu", "inf", "1e+06"}},
      {{"--mu", "a lot"}, {"--mu", "a lot", "not a number"}},
      {{"--epsilon", "-1"}, {"--epsilon", "-1", "0", "1000"}},
      {{"--curve", "ellipse"}, {"--curve", "ellipse", "optimal", "kurilin", "gladkov"}},
      {{"--curve"}, {"--curve", "optimal", "circle"}},
      {{"--curve", ""}, {"--curve", "''", "optimal"}},
      {{"--compare", "--curve", "circle"}, {"--compare", "--curve"}},
      {{"--compare", "--csv", "-"}, {"--compare", "--csv"}},
      {{"--accuracy", "1e-13"}, {"--accuracy", "1e-13", "1e-12"}},
      {{"--friction", "0.1"}, {"--friction"}},
  };
  expect_refusals(cases);
}

TEST_F(CoulombTool, SceneBeyondTheLimitIsStatusThreeAndNamesIt) {
  for (const Arguments& arguments :
       {Arguments{"--mu", "1.25"}, {"--mu", "7"}, {"--mu", "1e6"}, {"--mu", "2", "--compare"}}) {
    const Ended got = run(arguments);
    EXPECT_EQ(got.status, 3) << got.err;
    EXPECT_EQ(got.out, "");
    EXPECT_TRUE(contains(got.err, "mu_max = H/L = 1.25")) << got.err;
  }
  for (const Arguments& arguments :
       {Arguments{"--drop", "-3"}, {"--drop", "0", "--mu", "0"}, {"--drop", "-3", "--curve", "circle"}}) {
    const Ended got = run(arguments);
    EXPECT_EQ(got.status, 3) << got.err;
    EXPECT_TRUE(contains(got.err, "mu_max")) << got.err;
  }
  const Ended got = run({"--mu", "1.25", "--json"});
  EXPECT_EQ(got.status, 3);
  const json result = json::parse(got.out);
  EXPECT_EQ(result["status"], "infeasible");
  EXPECT_EQ(result["limits"]["mu_max"], 1.25);
  EXPECT_TRUE(result["final_time"].is_null());
  EXPECT_TRUE(result["unknowns"].empty());
}

TEST_F(CoulombTool, BeadThatStopsIsStatusThreeAndSaysWhere) {
  const Arguments scene{"--drop", "1", "--span", "1", "--mu", "0.7", "--curve"};
  for (const auto& [curve, limit] : {std::pair{"circle", "0.603342"}, {"gladkov", "0.5"}}) {
    Arguments arguments = scene;
    arguments.emplace_back(curve);
    const Ended got = run(arguments);
    EXPECT_EQ(got.status, 3) << got.err;
    EXPECT_EQ(got.out, "");
    EXPECT_TRUE(contains(got.err, fmt::format("mu_finish = {}", limit))) << got.err;
    arguments.emplace_back("--json");
    const json result = json::parse(run(arguments).out);
    EXPECT_NEAR(result["limits"]["mu_finish"].get<double>(), std::stod(limit), 5e-7);
  }
  Arguments circle = scene;
  circle.emplace_back("circle");
  EXPECT_TRUE(contains(run(circle).err, "x = 0.8778026")) << run(circle).err;
}

TEST_F(CoulombTool, JsonHasTheReferenceValuesAndTheContract) {
  const json result = solved_json({"--mu", "1", "--accuracy", "1e-11"});
  for (const char* key : {"schema", "model", "scene", "engine", "status", "structure", "final_time", "switching_times",
                          "unknowns", "limits", "error_bound", "certificate", "cost", "message"}) {
    EXPECT_TRUE(result.contains(key)) << key;
  }
  EXPECT_EQ(result.size(), 14U);
  EXPECT_EQ(result["model"], "coulomb");
  EXPECT_EQ(result["structure"], json::array({"sliding"}));
  for (const char* name : {"drop", "span", "gravity", "mu"}) EXPECT_TRUE(result["scene"][name].is_number()) << name;
  EXPECT_NEAR(result["final_time"].get<double>(), 2.1457917862219165, 1e-11);
  const json& unknowns = result["unknowns"];
  EXPECT_NEAR(unknowns["lambda_x"].get<double>() * 4.0 + unknowns["lambda_y"].get<double>() * 5.0, 0.5 * 2.1457917862219165,
              1e-10);
  EXPECT_NEAR(unknowns["lambda_v0"].get<double>(), 1.0 / 9.81, 1e-15);
  EXPECT_NEAR(unknowns["alpha0"].get<double>(), std::numbers::pi / 2, 1e-15);
  EXPECT_NEAR(unknowns["alphaF"].get<double>(), 0.3118899575501721, 1e-11);
  for (const auto& [name, bound] : result["error_bound"].items()) {
    if (name == "switching_times") continue;
    EXPECT_LE(bound.get<double>(), 1e-11) << name;
  }
  EXPECT_EQ(result["certificate"]["verdict"], "extremal");
  EXPECT_LT(result["certificate"]["condition"].get<double>(), 4.0);
  EXPECT_EQ(result["limits"]["mu_max"], 1.25);
}

TEST_F(CoulombTool, WithoutFrictionNothingIsIntegrated) {
  const json result = solved_json({"--mu", "0", "--drop", "1", "--span", "1"});
  EXPECT_EQ(result["structure"], json::array({"cycloid"}));
  EXPECT_NEAR(result["final_time"].get<double>(), 0.5828954631547426, 1e-14);
  EXPECT_EQ(result["cost"]["rhs_evaluations"], 0);
  EXPECT_EQ(result["cost"]["steps"], 0);
  EXPECT_TRUE(result["certificate"].is_null());
  EXPECT_NEAR(result["unknowns"]["alphaF"].get<double>(), 0.36479075483813395, 1e-14);
  // y down: its costate is minus that of the cycloid, and the identity of the times holds.
  EXPECT_NEAR(result["unknowns"]["lambda_x"].get<double>() + result["unknowns"]["lambda_y"].get<double>(),
              0.5 * 0.5828954631547426, 1e-14);
}

TEST_F(CoulombTool, KurilinsConstants) {
  const json result = solved_json({"--mu", "1", "--curve", "kurilin"});
  EXPECT_NEAR(result["unknowns"]["alpha0"].get<double>(), 1.28111004226931, 1e-13);
  EXPECT_NEAR(result["unknowns"]["alphaF"].get<double>(), 0.594738988045211, 1e-13);
  EXPECT_NEAR(result["unknowns"]["C"].get<double>(), 194.619875352234, 1e-9);
  EXPECT_GT(result["final_time"].get<double>(), 2.1457917862219165 * 1.005);
}

TEST_F(CoulombTool, ComparisonHasTheOptimumFirst) {
  const Arguments scene{"--drop", "1", "--span", "1", "--mu", "0.7", "--compare"};
  const json result = solved_json(scene);
  std::vector<std::string> names;
  for (const json& row : result["curves"]) {
    names.push_back(row["curve"]);
    const bool arrives = row["status"] == "arrives";
    EXPECT_EQ(arrives, row["curve"] != "circle" && row["curve"] != "gladkov");
    EXPECT_EQ(row["final_time"].is_number(), arrives);
    EXPECT_EQ(row["message"].get<std::string>().empty(), arrives);
    if (!arrives) continue;
    EXPECT_GE(row["final_time"].get<double>(), result["final_time"].get<double>());
  }
  EXPECT_EQ(names, (std::vector<std::string>{"optimal", "kurilin", "cycloid", "parabola", "circle", "gladkov"}));
  const Ended table = run(scene);
  EXPECT_EQ(table.status, 0);
  for (const std::string& name : names) EXPECT_TRUE(contains(table.out, name)) << table.out;
  for (const char* part : {"0.9053473276", "stops at x = 0.8778026", "slower"})
    EXPECT_TRUE(contains(table.out, part)) << table.out;
}

/// Every row of a CSV, as numbers; the arc's name as 0.
std::vector<std::vector<double>> rows_of(const std::string& text) {
  std::vector<std::vector<double>> rows;
  std::istringstream lines(text);
  std::string line;
  std::getline(lines, line);
  while (std::getline(lines, line)) {
    std::istringstream words(line);
    rows.emplace_back();
    for (std::string word; std::getline(words, word, ',');)
      rows.back().push_back(rows.back().size() == 1 ? 0.0 : std::stod(word));
  }
  return rows;
}

TEST_F(CoulombTool, TrajectoryEndsWhereItShould) {
  for (const Arguments& extra : {Arguments{},
                                 {"--mu", "0"},
                                 {"--curve", "kurilin"},
                                 {"--curve", "circle"},
                                 {"--curve", "gladkov"},
                                 {"--curve", "parabola"},
                                 {"--curve", "cycloid"},
                                 {"--mu", "1.2499"}}) {
    const std::string file = (folder() / "path.csv").string();
    Arguments arguments{"--csv", file, "--quiet"};
    arguments.insert(arguments.end(), extra.begin(), extra.end());
    const Ended got = run(arguments);
    ASSERT_EQ(got.status, 0) << got.err;
    const std::string text = contents(file);
    EXPECT_EQ(text.rfind("t [s],arc,x [m],y [m],v [m/s],alpha [rad]", 0), 0U) << text.substr(0, 100);
    const auto rows = rows_of(text);
    ASSERT_GT(rows.size(), 90U);
    for (const std::size_t i : {0, 2, 3, 4}) EXPECT_EQ(rows.front()[i], 0.0) << i << ": it starts at rest";
    EXPECT_NEAR(rows.back()[2], 4.0, 1e-7);
    EXPECT_NEAR(rows.back()[3], 5.0, 1e-7);
    for (std::size_t i = 1; i < rows.size(); ++i) {
      EXPECT_GT(rows[i][0], rows[i - 1][0]);
      EXPECT_LE(rows[i][5], rows[i - 1][5] + 1e-12) << "the wire bends up";
      for (const double value : rows[i]) EXPECT_TRUE(std::isfinite(value));
    }
  }
}

TEST_F(CoulombTool, HelpNamesFlagsAndConventions) {
  const Ended got = run({"--help"});
  EXPECT_EQ(got.status, 0);
  for (const char* part :
       {"--drop m", "--span m", "--gravity m/s^2", "--mu", "--curve", "--epsilon", "--compare", "--accuracy", "--json",
        "--csv", "--quiet", "--version", "y is measured down", "lambda_v0 = 1/g", "mu_max = drop/span", "Exit status"}) {
    EXPECT_TRUE(contains(got.out, part)) << part;
  }
  EXPECT_EQ(run({"--version"}).out.rfind("costate-coulomb ", 0), 0U);
}

}  // namespace
}  // namespace costate::tools
