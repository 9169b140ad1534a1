/// costate-disk --vary: events in their places, and output that is whole where a branch ends.
#include "run_tool.hpp"

#include <cmath>

namespace costate::tools {
namespace {

class DiskVary : public ToolTest {
 protected:
  DiskVary() : ToolTest(COSTATE_TOOL) {}
};

TEST_F(DiskVary, ArcsAreBornAndDieOnTheWay) {
  const json branch = solved_json({"--vary", "friction=0.07:0.05099", "--at", "0.0525"});
  ASSERT_EQ(branch.at("events").size(), 2u);
  const json &birth = branch.at("events")[0], &death = branch.at("events")[1];
  EXPECT_EQ(birth.at("kind"), "arc birth");
  EXPECT_NEAR(birth.at("parameter").get<double>(), 0.0658188864305, 1e-9);
  EXPECT_EQ(death.at("kind"), "arc death");
  EXPECT_NEAR(death.at("parameter").get<double>(), 0.0523739648549646, 1e-9);
  ASSERT_EQ(branch.at("points").size(), 3u);
  const json& middle = branch.at("points")[1];
  EXPECT_EQ(middle.at("parameter"), 0.0525);
  EXPECT_EQ(middle.at("structure"), "saturated-free-saturated");
  EXPECT_EQ(middle.at("events_before"), 1);
  EXPECT_NEAR(middle.at("quantities").at("final_time").at("value").get<double>(), 2.2133252145652510, 1e-9);
  EXPECT_NEAR(middle.at("quantities").at("t1").at("value").get<double>(), 1.0855647258861120, 1e-9);
  EXPECT_LE(branch.at("cost").at("newton_iterations_per_point").get<double>(), 6.0);
}

TEST_F(DiskVary, TableHasTheEventsBetweenThePoints) {
  const Ended got = run({"--vary", "friction=0.07:0.052:4"});
  EXPECT_EQ(got.status, 0) << got.err;
  const auto birth = got.out.find("-- arc birth at friction = 0.0658188864305");
  const auto death = got.out.find("-- arc death at friction = 0.052373964855");
  ASSERT_NE(birth, std::string::npos) << got.out;
  ASSERT_NE(death, std::string::npos) << got.out;
  EXPECT_LT(got.out.find("0.07 "), birth);
  EXPECT_LT(birth, got.out.find("0.064 "));
  EXPECT_LT(got.out.find("0.058 "), death);
  EXPECT_LT(death, got.out.find("0.052 "));
}

TEST_F(DiskVary, BelowTheLeastFrictionTheOutputIsWhole) {
  const Ended got = run({"--vary", "friction=0.06:0.03:31", "--json"});
  EXPECT_EQ(got.status, 4);
  const json branch = json::parse(got.out);
  ASSERT_FALSE(branch.at("points").empty());
  for (const json& point : branch.at("points")) EXPECT_GT(point.at("parameter").get<double>(), 0.0509858);
  EXPECT_EQ(branch.at("events").back().at("kind"), "limit");
  EXPECT_NEAR(branch.at("events").back().at("parameter").get<double>(), 0.050985810648896412, 1e-9);
  EXPECT_TRUE(contains(branch.at("message"), "k_min")) << branch.at("message");
}

TEST_F(DiskVary, HeadingZeroIsNoValueToShow) {
  expect_refusals({{{"--vary", "heading=-1:1:3"}, {"heading", "0 is among", "rad, not 0"}},
                   {{"--vary", "heading=0:1"}, {"heading 0", "rad, not 0"}}});
}

// Along x with a limit that binds on a part of the way only; without one the disk has a single arc throughout.
TEST_F(DiskVary, OtherNumbersMoveTheArcsToo) {
  const json limited = solved_json({"--vary", "x=1:1.6:4", "--friction", "0.066"});
  ASSERT_FALSE(limited.at("events").empty());
  EXPECT_EQ(limited.at("events")[0].at("kind"), "arc birth");
  EXPECT_EQ(limited.at("points").front().at("structure"), "free");
  EXPECT_NE(limited.at("points").back().at("structure"), "free");
  const json alone = solved_json({"--x", "1.6", "--friction", "0.066"});
  EXPECT_NEAR(limited.at("points").back().at("quantities").at("final_time").at("value").get<double>(),
              alone.at("final_time").get<double>(), 1e-8);
  EXPECT_TRUE(solved_json({"--vary", "x=1:1.6:4"}).at("events").empty());
}

}  // namespace
}  // namespace costate::tools
