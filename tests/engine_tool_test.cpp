/// Every tool with either engine: the same results within their bounds.
#include "run_tool.hpp"

namespace costate::tools {
namespace {

struct Scene {
  std::string name;
  Arguments words;  ///< the tool and its flags
};

std::ostream& operator<<(std::ostream& out, const Scene& scene) { return out << scene.name; }

class EitherEngine : public testing::TestWithParam<Scene> {
 protected:
  static json solved(const std::string& engine) {
    Arguments words = GetParam().words;
    words.insert(words.end(), {"--engine", engine, "--json"});
    Runner tool(words.front());
    const Ended got = tool.run({words.begin() + 1, words.end()});
    EXPECT_EQ(got.status, 0) << got.err;
    json result = json::parse(got.out);
    EXPECT_EQ(result["engine"], engine);
    return result;
  }

 private:
  struct Runner : ToolTest {
    explicit Runner(const std::string& tool) : ToolTest(std::string(COSTATE_TOOLS) + "/costate-" + tool) {}
    using ToolTest::run;
    void TestBody() override {}
  };
};

double difference(const json& a, const json& b) { return std::abs(a.get<double>() - b.get<double>()); }
double sum(const json& a, const json& b) { return a.get<double>() + b.get<double>(); }

using EitherEngineSolves = EitherEngine;
TEST_P(EitherEngineSolves, TheSceneAlike) {
  const json a = solved("cvodes"), b = solved("rk87");
  const json &a_bound = a["error_bound"], &b_bound = b["error_bound"];
  EXPECT_EQ(a["structure"], b["structure"]);
  EXPECT_LE(difference(a["final_time"], b["final_time"]), sum(a_bound["final_time"], b_bound["final_time"]));
  ASSERT_EQ(a["switching_times"].size(), b["switching_times"].size());
  for (std::size_t i = 0; i < a["switching_times"].size(); ++i) {
    EXPECT_LE(difference(a["switching_times"][i], b["switching_times"][i]),
              sum(a_bound["switching_times"][i], b_bound["switching_times"][i]));
  }
  for (const auto& [name, value] : a["unknowns"].items()) {
    EXPECT_LE(difference(value, b["unknowns"][name]), sum(a_bound[name], b_bound[name])) << name;
  }
  EXPECT_LT(b["cost"]["steps"], a["cost"]["steps"]) << "one of the two was not what integrated";
}
INSTANTIATE_TEST_SUITE_P(
    Tools, EitherEngineSolves,
    testing::Values(Scene{"disk", {"disk"}}, Scene{"disk_coarse", {"disk", "--accuracy", "1e-5"}},
                    Scene{"disk_limited", {"disk", "--friction", "0.0525"}},
                    Scene{"disk_loaded", {"disk", "--friction", "0.051", "--accuracy", "1e-10"}},
                    Scene{"coulomb", {"coulomb"}}, Scene{"coulomb_with_friction", {"coulomb", "--mu", "0.4"}},
                    Scene{"normal", {"normal-friction"}},
                    Scene{"normal_stiffening",
                          {"normal-friction", "--x", "1.5", "--y", "-1", "--speed", "4", "--mu", "0.3", "--beta", "-0.001"}},
                    Scene{"curvature", {"curvature-friction"}},
                    Scene{"curvature_free", {"curvature-friction", "--slope", "free", "--accuracy", "1e-10"}},
                    Scene{"drag", {"drag"}}, Scene{"drag_fine", {"drag", "--accuracy", "1e-10"}}),
    [](const auto& test) { return test.param.name; });

using EitherEngineFollows = EitherEngine;
TEST_P(EitherEngineFollows, TheBranchAlike) {
  const json a = solved("cvodes"), b = solved("rk87");
  std::size_t compared = 0;
  for (const json& here : a["points"]) {
    for (const json& there : b["points"]) {
      if (here["parameter"] != there["parameter"]) continue;
      ++compared;
      for (const auto& [name, quantity] : here["quantities"].items()) {
        const json& other = there["quantities"][name];
        EXPECT_LE(difference(quantity["value"], other["value"]), sum(quantity["error_bound"], other["error_bound"]))
            << name << " at " << here["parameter"];
      }
    }
  }
  EXPECT_GE(compared, 5U) << "the values asked for";
}
INSTANTIATE_TEST_SUITE_P(Tools, EitherEngineFollows,
                         testing::Values(Scene{"disk", {"disk", "--vary", "friction=0.06:0.0525:5"}},
                                         Scene{"drag", {"drag", "--vary", "mu=0.3:0.2:5"}}),
                         [](const auto& test) { return test.param.name; });

class EngineFlag : public ToolTest {
 protected:
  EngineFlag() : ToolTest(std::string(COSTATE_TOOLS) + "/costate-disk") {}
};

TEST_F(EngineFlag, OnlyWhatThereIs) {
  expect_refusals({{{"--engine", "rk8"}, {"--engine", "rk8", "cvodes", "rk87"}}, {{"--engine", ""}, {"--engine", "rk87"}}});
  EXPECT_TRUE(contains(run({"--help"}).out, "--engine"));
  EXPECT_EQ(solved_json({})["engine"], "cvodes") << "the default";
}

}  // namespace
}  // namespace costate::tools
