/// The contract of costate-drag on its command line.
#include "run_tool.hpp"

#include <algorithm>
#include <chrono>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

namespace costate::tools {
namespace {

class DragTool : public ToolTest {
 protected:
  DragTool() : ToolTest(COSTATE_TOOL) {}
};

TEST_F(DragTool, BadInputIsStatusTwoAndSaysWhatIsAdmissible) {
  const std::vector<BadInput> cases{{{"--x", "0"}, {"--x", "0", "1e-06", "1e+06", "m"}},
                                    {{"--x", "-1"}, {"--x", "-1", "1e-06", "m"}},
                                    {{"--x", "nan"}, {"--x", "nan", "1e-06"}},
                                    {{"--y", "1e300"}, {"--y", "1e300", "-1e+06", "1e+06"}},
                                    {{"--y", "inf"}, {"--y", "inf", "-1e+06"}},
                                    {{"--speed", "0"}, {"--speed", "0", "1e-06", "m/s"}},
                                    {{"--speed", "-2"}, {"--speed", "-2", "m/s"}},
                                    {{"--mu", "-0.1"}, {"--mu", "-0.1", "0", "1/s"}},
                                    {{"--beta", "1e300"}, {"--beta", "1e300", "s/m^2"}},
                                    {{"--gravity", "0"}, {"--gravity", "0", "m/s^2"}},
                                    {{"--accuracy", "0"}, {"--accuracy", "0", "1e-12"}},
                                    {{"--slope", "1"}, {"--slope"}},
                                    {{"--csv", folder().string()}, {"--csv"}}};
  expect_refusals(cases);
}

TEST_F(DragTool, EndPointAboveReachIsStatusThreeAndNamesTheLimit) {
  const Ended got = run({"--y", "0.2"});
  EXPECT_EQ(got.status, 3);
  EXPECT_EQ(got.out, "");
  EXPECT_TRUE(contains(got.err, "y_max = 0.19635825")) << got.err;
  const Ended as_json = run({"--y", "0.2", "--json"});
  EXPECT_EQ(as_json.status, 3);
  const json result = json::parse(as_json.out);
  EXPECT_EQ(result["status"], "infeasible");
  EXPECT_NEAR(result["limits"]["y_max"].get<double>(), 0.196358256738939, 1e-12);
  EXPECT_TRUE(result["final_time"].is_null());
}

TEST_F(DragTool, SoftFrictionWithoutALocalMinimumIsStatusThreeAndNamesTheLimit) {
  const Arguments scene{"--x", "7.5", "--y", "-1.6", "--speed", "1.9", "--mu", "0.28"};
  Arguments soft = scene;
  soft.insert(soft.end(), {"--beta", "0.014", "--json"});
  const Ended got = run(soft);
  EXPECT_EQ(got.status, 3) << got.out;
  const double beta_max = json::parse(got.out)["limits"]["beta_max"].get<double>();
  for (const double part : {0.99, 1.01}) {  // the limit separates what is solved from what is not
    Arguments near = scene;
    near.insert(near.end(), {"--beta", fmt::format("{}", part * beta_max), "--quiet"});
    EXPECT_EQ(run(near).status, part < 1.0 ? 0 : 3) << part;
  }
}

TEST_F(DragTool, JsonHoldsUnknownsLimitsAndOtherExtremals) {
  const Ended got = run({"--json", "--accuracy", "1e-10"});
  ASSERT_EQ(got.status, 0) << got.err;
  EXPECT_EQ(got.err, "");
  const json result = json::parse(got.out);
  EXPECT_EQ(result["schema"], "costate/1");
  EXPECT_EQ(result["model"], "drag");
  EXPECT_EQ(result["status"], "solved");
  for (const char* key : {"x", "y", "speed", "mu", "beta", "gravity"}) EXPECT_TRUE(result["scene"][key].is_number()) << key;
  for (const char* key : {"lambda_x", "lambda_y", "lambda_v0", "theta1", "theta2", "v_f"}) {
    EXPECT_TRUE(result["unknowns"][key].is_number()) << key;
    EXPECT_GT(result["error_bound"][key].get<double>(), 0.0) << key;
  }
  EXPECT_NEAR(result["final_time"].get<double>(), 1.4687921521171958, 1e-10);
  EXPECT_EQ(result["certificate"]["verdict"], "extremal");
  ASSERT_EQ(result["other_extremals"].size(), 1U);
  EXPECT_TRUE(contains(result["other_extremals"][0]["message"], "not a minimum"));
  EXPECT_NEAR(result["other_extremals"][0]["final_time"].get<double>(), 1.860214189843321, 2e-10);
}

TEST_F(DragTool, TableSaysWhyOtherExtremalsAreNotTheAnswer) {
  const Ended got = run({});
  EXPECT_EQ(got.status, 0);
  EXPECT_TRUE(contains(got.out, "focal point at t = 1.2611")) << got.out;
  EXPECT_TRUE(contains(got.out, "not a minimum")) << got.out;
}

TEST_F(DragTool, WithoutFrictionNothingIsIntegrated) {
  const Ended got = run({"--mu", "0", "--beta", "0", "--json"});
  ASSERT_EQ(got.status, 0);
  const json result = json::parse(got.out);
  EXPECT_NEAR(result["final_time"].get<double>(), 1.3195056806149265, 1e-14);
  EXPECT_EQ(result["structure"], json::array({"cycloid"}));
  EXPECT_EQ(result["cost"]["steps"], 0);
  EXPECT_TRUE(result["certificate"].is_null());
}

TEST_F(DragTool, CsvRunsFromTheStartToTheEnd) {
  const std::string file = (folder() / "a.csv").string();
  ASSERT_EQ(run({"--csv", file, "--quiet"}).status, 0);
  std::istringstream lines(contents(file));
  std::string header, line, first, last;
  std::getline(lines, header);
  EXPECT_EQ(header, "t [s],arc,x [m],y [m],v [m/s],theta [rad],lambda_x [s/m],lambda_y [s/m],lambda_v [s^2/m]");
  double before = -1.0;
  while (std::getline(lines, line)) {
    if (first.empty()) first = line;
    last = line;
    const double t = std::stod(line);
    EXPECT_GE(t, before);
    before = t;
  }
  const auto numbers = [](const std::string& row) {
    std::vector<double> values;
    std::istringstream cells(row);
    for (std::string cell; std::getline(cells, cell, ',');)
      values.push_back(cell.find_first_of("0123456789") == std::string::npos ? 0.0 : std::stod(cell));
    return values;
  };
  const std::vector<double> start = numbers(first), end = numbers(last);
  EXPECT_NEAR(start[2], 0.0, 1e-8);
  EXPECT_NEAR(start[3], 0.0, 1e-8);
  EXPECT_NEAR(start[4], 2.0, 1e-8);
  EXPECT_NEAR(end[2], 6.0, 1e-8);
  EXPECT_NEAR(end[3], -1.0, 1e-8);
  EXPECT_NEAR(end[8], 0.0, 1e-8);
}

// Whatever the scene: an exit status of the contract, in time, and no number that is none.
TEST_F(DragTool, ExtremeScenesEndInTime) {
  const std::vector<Arguments> scenes{{"--x", "1e6", "--y", "-1e6"},
                                      {"--x", "1e6", "--y", "-1"},
                                      {"--x", "1e-6", "--y", "-1e6"},
                                      {"--x", "1e-6", "--y", "0"},
                                      {"--speed", "1e6"},
                                      {"--speed", "1e-6"},
                                      {"--speed", "1e-6", "--beta", "0"},
                                      {"--mu", "1e6"},
                                      {"--mu", "1e6", "--beta", "-1e6"},
                                      {"--mu", "0", "--beta", "1e6"},
                                      {"--mu", "0", "--beta", "1e-12"},
                                      {"--mu", "1e-12", "--beta", "0"},
                                      {"--beta", "-1e6"},
                                      {"--gravity", "1e-6"},
                                      {"--gravity", "1e6"}};
  for (Arguments arguments : scenes) {
    arguments.push_back("--json");
    const auto began = std::chrono::steady_clock::now();
    const Ended got = run(arguments);
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - began;
    const std::string line = fmt::format("{}\n{}{}", fmt::join(arguments, " "), got.out, got.err);
    EXPECT_TRUE(got.status == 0 || got.status == 3 || got.status == 4) << line;
    EXPECT_LT(took.count(), 10.0) << line;
    const json result = json::parse(got.out);
    EXPECT_EQ(result["final_time"].is_number(), got.status == 0) << line;
    EXPECT_EQ(result["message"].get<std::string>().empty(), got.status == 0) << line;
  }
}

TEST_F(DragTool, HelpStatesTheConventions) {
  const Ended got = run({"--help"});
  EXPECT_EQ(got.status, 0);
  for (const char* part : {"--x", "--y", "--speed", "--mu", "--beta", "--gravity", "y up", "H = -1", "lambda_v = 0"}) {
    EXPECT_TRUE(contains(got.out, part)) << part;
  }
}

}  // namespace
}  // namespace costate::tools
