/// The contract of costate-normal-friction on its command line.
#include "run_tool.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace costate::tools {
namespace {

class NormalTool : public ToolTest {
 protected:
  NormalTool() : ToolTest(COSTATE_TOOL) {}
};

TEST_F(NormalTool, BadInputIsStatusTwoAndSaysWhatIsAdmissible) {
  const std::vector<BadInput> cases{
      {{"--x", "0"}, {"--x", "0", "1e-06", "1e+06", "m"}},
      {{"--x", "-3"}, {"--x", "-3", "1e-06"}},
      {{"--y", "nan"}, {"--y", "nan", "-1e+06", "1e+06", "m"}},
      {{"--y", "1e300"}, {"--y", "1e300", "1e+06"}},
      {{"--speed", "0"}, {"--speed", "0", "1e-06", "m/s"}},
      {{"--speed", "-2"}, {"--speed", "-2", "1e-06", "m/s"}},
      {{"--speed", "inf"}, {"--speed", "inf", "m/s"}},
      {{"--mu", "-0.1"}, {"--mu", "-0.1", "0", "1000"}},
      {{"--beta", "1e4"}, {"--beta", "1e4", "-1000", "1000", "s^4/m^2"}},
      {{"--gravity", "0"}, {"--gravity", "0", "1e-06", "m/s^2"}},
      {{"--accuracy", "1e-30"}, {"--accuracy", "1e-30", "1e-12"}},
      {{"--slope", "1"}, {"--slope"}},
      {{"--mu", "0,3"}, {"--mu", "0,3", "not a number"}},
      {{"stray"}, {"stray"}},
  };
  expect_refusals(cases);
}

TEST_F(NormalTool, EndOutOfReachIsStatusThreeAndNamesTheLimit) {
  const Ended got = run({"--x", "1.5", "--y", "1", "--speed", "4", "--mu", "0.3", "--beta", "-0.001"});
  EXPECT_EQ(got.status, 3);
  EXPECT_EQ(got.out, "");
  EXPECT_TRUE(contains(got.err, "y_max = 0.366326530612")) << got.err;  // 16/19.6 − 0.45
  EXPECT_TRUE(contains(got.err, "y = 1 m")) << got.err;
}

TEST_F(NormalTool, JsonHasTheSameKeysWhateverBecameOfTheScene) {
  const Arguments keys{"schema",   "model",  "scene", "engine",       "status",      "structure", "final_time", "switching_times",
                       "unknowns", "limits", "error_bound", "certificate", "cost",      "message"};
  const std::vector<std::pair<Arguments, std::string>> cases{{{}, "solved"},
                                                             {{"--beta", "0", "--mu", "0"}, "solved"},
                                                             {{"--beta", "0", "--mu", "3"}, "solved"},
                                                             {{"--y", "100"}, "infeasible"},
                                                             {{"--beta", "-1000"}, "failed"}};
  for (const auto& [scene, word] : cases) {
    Arguments arguments = scene;
    arguments.push_back("--json");
    const Ended got = run(arguments);
    const json result = json::parse(got.out);
    EXPECT_EQ(result.size(), keys.size()) << got.out;
    for (const std::string& key : keys) EXPECT_TRUE(result.contains(key)) << key;
    EXPECT_EQ(result["schema"], "costate/1");
    EXPECT_EQ(result["model"], "normal-friction");
    EXPECT_EQ(result["status"], word);
    for (const char* key : {"x", "y", "speed", "mu", "beta", "gravity"})
      EXPECT_TRUE(result["scene"][key].is_number()) << key;
    EXPECT_TRUE(result["limits"]["y_max"].is_number());
    const bool solved = word == "solved";
    EXPECT_EQ(got.status, solved ? 0 : word == "infeasible" ? 3 : 4);
    EXPECT_EQ(result["message"].get<std::string>().empty(), solved);
    EXPECT_EQ(result["limits"]["N_min"].is_number(), solved);
    EXPECT_EQ(result["final_time"].is_number(), solved);
    for (const char* key : {"lambda_x", "lambda_y", "lambda_v0", "theta1", "theta2"}) {
      EXPECT_EQ(result["unknowns"].contains(key), solved) << key;
      EXPECT_EQ(result["error_bound"].contains(key), solved) << key;
    }
  }
}

TEST_F(NormalTool, DefaultSceneIsACaseOfThePaper) {
  const json result = solved_json({"--accuracy", "1e-11"});
  EXPECT_NEAR(result["final_time"].get<double>(), 0.276551082766443, 1e-11);
  EXPECT_NEAR(result["unknowns"]["theta1"].get<double>(), -1.43607497357263, 1e-10);
  EXPECT_NEAR(result["unknowns"]["theta2"].get<double>(), -1.03494641360104, 1e-10);
  EXPECT_EQ(result["structure"], json::array({"sliding"}));
  EXPECT_EQ(result["certificate"]["verdict"], "extremal");
  EXPECT_EQ(result["certificate"]["checks"].size(), 4U);
  for (const json& check : result["certificate"]["checks"]) EXPECT_TRUE(check["holds"].get<bool>()) << check;
}

TEST_F(NormalTool, CornerIsASwitchingTime) {
  const json result = solved_json({"--x", "1", "--y", "-1", "--speed", "1", "--mu", "0.893", "--beta", "-0.00338"});
  EXPECT_EQ(result["structure"], json::array({"sliding", "sliding", "sliding"}));
  ASSERT_EQ(result["switching_times"].size(), 2U);
  EXPECT_LT(result["switching_times"][0], result["switching_times"][1]);
  EXPECT_LT(result["switching_times"][1], result["final_time"]);
}

TEST_F(NormalTool, HelpStatesFlagsAndConventions) {
  const Ended got = run({"--help"});
  EXPECT_EQ(got.status, 0);
  for (const char* word : {"--x", "--y", "--speed", "--mu", "--beta", "--gravity", "--accuracy", "--json", "--csv",
                           "--quiet", "--version", "[9.8]", "s^4/m^2", "lambda_v0", "y up", "N_min", "Exit status"}) {
    EXPECT_TRUE(contains(got.out, word)) << word;
  }
}

TEST_F(NormalTool, QuietPrintsNothing) {
  EXPECT_EQ(run({"--quiet"}).out, "");
  const Ended infeasible = run({"--quiet", "--y", "100"});
  EXPECT_EQ(infeasible.status, 3);
  EXPECT_FALSE(infeasible.err.empty()) << "a failure is still explained";
}

/// The numbers of a CSV line; the second column is a word.
std::vector<double> numbers(const std::string& line) {
  std::vector<double> values;
  std::istringstream words(line);
  int column = 0;
  for (std::string word; std::getline(words, word, ','); ++column) {
    if (column != 1) values.push_back(std::stod(word));
  }
  return values;
}

// Integrated and in closed form alike: from (0, 0) at v₀ to the end point, λv = 0 there, the energy that friction leaves.
TEST_F(NormalTool, CsvIsTheMotion) {
  for (const char* beta : {"-0.001", "0"}) {
    const Ended got = run({"--x", "3", "--y", "-2", "--speed", "2", "--mu", "0.3", "--beta", beta, "--csv", "-"});
    ASSERT_EQ(got.status, 0) << got.err;
    std::istringstream lines(got.out);
    std::string header, line;
    std::getline(lines, header);
    EXPECT_EQ(header, "t [s],arc,x [m],y [m],v [m/s],theta [rad],lambda_x [s/m],lambda_y [s/m],lambda_v [s^2/m],N [m/s^2]");
    std::vector<std::vector<double>> rows;
    while (std::getline(lines, line)) rows.push_back(numbers(line));
    ASSERT_GT(rows.size(), 100U);
    EXPECT_EQ(rows.front()[0], 0.0);
    EXPECT_NEAR(rows.front()[3], 2.0, 1e-9);
    EXPECT_NEAR(rows.back()[1], 3.0, 1e-7);
    EXPECT_NEAR(rows.back()[2], -2.0, 1e-7);
    EXPECT_NEAR(rows.back()[7], 0.0, 1e-8);
    double work = 0.0;
    for (std::size_t i = 1; i < rows.size(); ++i) {
      EXPECT_GT(rows[i][0], rows[i - 1][0]);
      EXPECT_GT(rows[i][4], rows[i - 1][4]) << "the slope turns monotonically";
      const auto pull = [&](const std::vector<double>& r) { return -0.3 * r[8] + std::stod(beta) * r[8] * r[8] * r[8]; };
      const double length = std::hypot(rows[i][1] - rows[i - 1][1], rows[i][2] - rows[i - 1][2]);
      work += 0.5 * (pull(rows[i]) + pull(rows[i - 1])) * length;
    }
    const double v = rows.back()[3];
    // The trapezoidal rule over 200 cells: 1/12 of the cell squared.
    EXPECT_NEAR(0.5 * v * v, 0.5 * 4.0 + 9.8 * 2.0 + work, 1e-3);
  }
}

}  // namespace
}  // namespace costate::tools
