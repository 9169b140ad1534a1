/// The contract of costate-curvature-friction on its command line.
#include "run_tool.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

namespace costate::tools {
namespace {

class CurvatureTool : public ToolTest {
 protected:
  CurvatureTool() : ToolTest(COSTATE_TOOL) {}
};

TEST_F(CurvatureTool, BadInputIsStatusTwoAndSaysWhatIsAdmissible) {
  const std::vector<BadInput> cases{
      {{"--x", "0"}, {"--x", "0", "1e-06", "1e+06", "m"}},
      {{"--x", "1e300"}, {"--x", "1e300", "1e+06"}},
      {{"--y", "nan"}, {"--y", "nan", "-1e+06", "1e+06", "m"}},
      {{"--speed", "0"}, {"--speed", "0", "1e-06", "m/s"}},
      {{"--speed", "-2"}, {"--speed", "-2", "1e-06", "m/s"}},
      {{"--slope", "2"}, {"--slope", "2", "-1.5707", "1.5707", "rad", "free"}},
      {{"--slope", "steep"}, {"--slope", "steep", "not a number", "free"}},
      {{"--mu", "-0.1"}, {"--mu", "-0.1", "0"}},
      {{"--beta", "inf"}, {"--beta", "inf", "s^4/m^2"}},
      {{"--gravity", "0"}, {"--gravity", "0", "m/s^2"}},
      {{"--accuracy", "1"}, {"--accuracy", "1", "1e-12", "0.001"}},
      {{"--bogus"}, {"--bogus"}},
  };
  expect_refusals(cases);
}

TEST_F(CurvatureTool, SceneWithoutSolutionIsStatusThreeAndNamesTheLimit) {
  const Ended soft = run({"--beta", "1e-3"});
  EXPECT_EQ(soft.status, 3);
  EXPECT_TRUE(contains(soft.err, "Legendre-Clebsch")) << soft.err;
  EXPECT_TRUE(contains(soft.err, "beta = 0.001")) << soft.err;
  const Ended high = run({"--y", "0.3", "--json"});
  EXPECT_EQ(high.status, 3);
  const json result = json::parse(high.out);
  EXPECT_EQ(result["status"], "infeasible");
  EXPECT_TRUE(contains(result["message"].get<std::string>(), "y_max"));
  EXPECT_LT(result["limits"]["y_max"].get<double>(), 0.3);
}

TEST_F(CurvatureTool, SceneWithoutAnAttainedMinimumIsStatusThreeAndNamesTheInfimum) {
  const Ended got = run({"--x", "0.3", "--y", "-20", "--speed", "10"});
  EXPECT_EQ(got.status, 3);
  EXPECT_EQ(got.out, "");
  for (const char* part : {"y_flight", "time_infimum"}) EXPECT_TRUE(contains(got.err, part)) << got.err;
}

// A very fast bead can brake first, which the search does not try: then it must not claim that the end is out of reach.
TEST_F(CurvatureTool, FastBeadIsStatusFour) {
  const Ended got = run({"--speed", "10000"});
  EXPECT_EQ(got.status, 4);
  EXPECT_EQ(got.out, "");
  EXPECT_TRUE(contains(got.err, "; try ")) << got.err;
}

TEST_F(CurvatureTool, JsonNamesTheUnknowns) {
  const Ended got = run({"--slope", "free", "--json"});
  ASSERT_EQ(got.status, 0) << got.err;
  const json result = json::parse(got.out);
  EXPECT_EQ(result["model"], "curvature-friction");
  EXPECT_EQ(result["status"], "solved");
  EXPECT_TRUE(result["scene"]["slope"].is_null());
  EXPECT_NEAR(result["final_time"].get<double>(), 1.15613459653325, 1e-8);
  for (const char* name : {"lambda_x", "lambda_y", "lambda_v0", "lambda_theta0", "h0", "theta1", "theta2"}) {
    EXPECT_TRUE(result["unknowns"].contains(name)) << name;
  }
  EXPECT_NEAR(result["unknowns"]["theta1"].get<double>(), -0.3970552932002723, 1e-8);
}

TEST_F(CurvatureTool, WithoutFrictionTheCycloidHasTheModelsUnknowns) {
  const json result = solved_json({"--mu", "0", "--beta", "0", "--slope", "free"});
  EXPECT_EQ(result["structure"], json::array({"cycloid"}));
  EXPECT_EQ(result["unknowns"]["lambda_theta0"], 0.0);
  // N = 2 g cos θ on a cycloid, twice the weight's share.
  EXPECT_NEAR(result["unknowns"]["h0"].get<double>(), 19.6 * std::cos(result["unknowns"]["theta1"].get<double>()), 1e-13);
}

TEST_F(CurvatureTool, CsvIsTheMotionFromStartToEnd) {
  const std::string file = (folder() / "motion.csv").string();
  const Ended got = run({"--slope", "-0.75", "--csv", file, "--quiet"});
  ASSERT_EQ(got.status, 0) << got.err;
  EXPECT_EQ(got.out, "");
  std::istringstream text(contents(file));
  std::string header, line, last;
  std::getline(text, header);
  EXPECT_TRUE(contains(header, "lambda_theta")) << header;
  double before = -1.0;
  int rows = 0;
  for (; std::getline(text, line); last = line, ++rows) {
    const double t = std::stod(line);
    EXPECT_GE(t, before - 1e-8) << "in order of time, up to the accuracy where two pieces meet";
    before = t;
  }
  EXPECT_GT(rows, 100);
  EXPECT_NEAR(before, 1.1674243025053737, 1e-7);
  EXPECT_TRUE(contains(last, "contact")) << last;
}

}  // namespace
}  // namespace costate::tools
