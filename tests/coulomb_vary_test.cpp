/// costate-coulomb --vary: the flags, and a branch whose derivatives are known.
#include "run_tool.hpp"

#include <cmath>

namespace costate::tools {
namespace {

class CoulombVary : public ToolTest {
 protected:
  CoulombVary() : ToolTest(COSTATE_TOOL) {}
};

/// The point at a value of the parameter.
json point_at(const json& branch, double parameter) {
  for (const json& point : branch.at("points")) {
    if (point.at("parameter") == parameter) return point;
  }
  ADD_FAILURE() << "no point at " << parameter;
  return {};
}

double value(const json& point, const char* name, const char* what = "value") {
  return point.at("quantities").at(name).at(what).get<double>();
}

// dT/dμ at μ = 1 of the reference: −∫H_μ dt by quadrature, 15 digits. Without friction the answer is the cycloid.
TEST_F(CoulombVary, DerivativeOfTheDescentTime) {
  const json branch = solved_json({"--vary", "mu=0:1.249", "--at", "1", "--drop", "5", "--span", "4"});
  ASSERT_EQ(branch.at("points").size(), 3u);
  EXPECT_NEAR(value(point_at(branch, 1.0), "final_time", "derivative"), 2.50194066654002, 1e-8);
  EXPECT_TRUE(branch.at("events").empty());
  EXPECT_LE(branch.at("cost").at("newton_iterations_per_point").get<double>(), 6.0);
  const json frictionless = solved_json({"--mu", "0", "--drop", "5", "--span", "4"});
  const json first = point_at(branch, 0.0);
  EXPECT_NEAR(value(first, "final_time"), frictionless.at("final_time").get<double>(),
              value(first, "final_time", "error_bound") + 1e-14);
}

TEST_F(CoulombVary, EveryPointIsWhatTheSceneAloneGives) {
  const json branch = solved_json({"--vary", "drop=6:4.5:4"});
  ASSERT_EQ(branch.at("points").size(), 4u);
  EXPECT_EQ(branch.at("points")[0].at("parameter"), 6.0);
  EXPECT_EQ(branch.at("points")[3].at("parameter"), 4.5);
  EXPECT_FALSE(branch.at("scene").contains("drop")) << "it has no one value";
  for (const json& point : branch.at("points")) {
    EXPECT_TRUE(point.at("requested"));
    const json alone = solved_json({"--drop", fmt::format("{:.17g}", point.at("parameter").get<double>())});
    for (const auto& [name, unknown] : alone.at("unknowns").items()) {
      const double bound = value(point, name.c_str(), "error_bound") + alone.at("error_bound").at(name).get<double>();
      EXPECT_NEAR(value(point, name.c_str()), unknown.get<double>(), bound + 1e-15) << name;
    }
    // ∂T/∂H = λy
    EXPECT_NEAR(value(point, "final_time", "derivative"), value(point, "lambda_y"), 1e-9);
  }
}

TEST_F(CoulombVary, TheLimitEndsItAndIsNamed) {
  const Ended got = run({"--vary", "mu=0.5:2", "--json"});
  EXPECT_EQ(got.status, 4);
  const json branch = json::parse(got.out);
  EXPECT_EQ(branch.at("status"), "failed");
  EXPECT_GT(branch.at("points").size(), 5u) << "what was found is kept";
  EXPECT_TRUE(contains(branch.at("message"), "mu_max")) << branch.at("message");
  for (const json& point : branch.at("points")) EXPECT_LT(point.at("parameter").get<double>(), 1.25);
  EXPECT_FALSE(contains(got.out, "nan"));
}

// Towards the limit the unknowns run away, which is not a fold, whichever number leads there.
TEST_F(CoulombVary, TheLimitIsNoFold) {
  for (const char* vary : {"drop=5:-5:4", "span=1:100:100", "mu=0:1.3:4"}) {
    const Ended got = run({"--vary", vary, "--json"});
    EXPECT_EQ(got.status, 4) << vary;
    const json branch = json::parse(got.out);
    EXPECT_TRUE(branch.at("events").empty()) << branch.at("events").dump();
    EXPECT_TRUE(contains(branch.at("message"), "mu_max")) << branch.at("message");
    const json& points = branch.at("points");
    ASSERT_GE(points.size(), 1u);
    const double sense = points.back().at("parameter") >= points.front().at("parameter") ? 1.0 : -1.0;
    for (std::size_t i = 1; i < points.size(); ++i) {
      EXPECT_GT(sense * (points[i].at("parameter").get<double>() - points[i - 1].at("parameter").get<double>()), 0.0);
    }
  }
}

TEST_F(CoulombVary, QuietLeavesTheStatusAndWhy) {
  const Ended fine = run({"--vary", "mu=0:1:3", "--quiet"});
  EXPECT_EQ(fine.status, 0);
  EXPECT_EQ(fine.out + fine.err, "");
  const Ended short_of_it = run({"--vary", "mu=0:2:3", "--quiet"});
  EXPECT_EQ(short_of_it.status, 4);
  EXPECT_EQ(short_of_it.out, "");
  EXPECT_TRUE(contains(short_of_it.err, "mu_max")) << short_of_it.err;
}

TEST_F(CoulombVary, AStartWithoutASolutionIsStatus3) {
  const Ended got = run({"--vary", "mu=2:0.5"});
  EXPECT_EQ(got.status, 3);
  EXPECT_EQ(got.out, "");
  EXPECT_TRUE(contains(got.err, "at mu = 2")) << got.err;
}

TEST_F(CoulombVary, TableAndCsvShowTheSamePoints) {
  const Ended table = run({"--vary", "mu=0.1:0.3:3"});
  EXPECT_EQ(table.status, 0) << table.err;
  for (const char* part : {"mu", "final_time [s]", "d/dmu", "lambda_x", "sliding", "points followed", "Newton iterations"}) {
    EXPECT_TRUE(contains(table.out, part)) << part;
  }
  const fs::path file = folder() / "branch.csv";
  const Ended csv = run({"--vary", "mu=0.1:0.3:3", "--csv", file.string(), "--quiet"});
  EXPECT_EQ(csv.status, 0) << csv.err;
  EXPECT_EQ(csv.out, "");
  std::istringstream lines(contents(file));
  std::string line;
  std::getline(lines, line);
  EXPECT_EQ(line.substr(0, 27), "mu [],status,arcs,objection");
  const auto columns = std::count(line.begin(), line.end(), ',');
  int rows = 0;
  for (; std::getline(lines, line); ++rows) EXPECT_EQ(std::count(line.begin(), line.end(), ','), columns) << line;
  EXPECT_EQ(rows, 3);
}

TEST_F(CoulombVary, BadInputIsNamed) {
  expect_refusals({{{"--vary", "nu=0:1"}, {"nu=0:1", "drop, span, gravity, mu"}},
                   {{"--vary", "mu"}, {"NAME=FROM:TO"}},
                   {{"--vary", "mu="}, {"NAME=FROM:TO", "0 … 1e+06"}},
                   {{"--vary", "mu=0.1"}, {"NAME=FROM:TO"}},
                   {{"--vary", "mu=0:1:2:3"}, {"NAME=FROM:TO"}},
                   {{"--vary", "mu=0:x"}, {"mu", "'x' is not a number", "0 … 1e+06"}},
                   {{"--vary", "mu=nan:1"}, {"mu", "nan"}},
                   {{"--vary", "mu=0:1e300"}, {"1e300", "0 … 1e+06"}},
                   {{"--vary", "mu=-1:1"}, {"-1", "0 … 1e+06"}},
                   {{"--vary", "mu=0.5:0.5"}, {"must differ"}},
                   {{"--vary", "mu=0:1:1"}, {"COUNT '1'", "2 … 10000"}},
                   {{"--vary", "mu=0:1:2.5"}, {"COUNT '2.5'"}},
                   {{"--vary", "mu=0:1:"}, {"COUNT ''"}},
                   {{"--vary", "mu=0:1", "--mu", "0.3"}, {"--vary mu", "--mu", "exclude"}},
                   {{"--vary", "mu=0:1", "--at", "2"}, {"--at 2", "0 … 1"}},
                   {{"--vary", "mu=0:1", "--at", "0.5,"}, {"--at ''"}},
                   {{"--at", "0.5"}, {"--at needs --vary"}},
                   {{"--vary", "epsilon=0:1"}, {"epsilon", "one of drop, span, gravity, mu\n"}},
                   {{"--vary", "mu=0:1", "--curve", "kurilin"}, {"--curve kurilin"}},
                   {{"--vary", "mu=0:1", "--compare"}, {"--compare"}}});
}

}  // namespace
}  // namespace costate::tools
