/// --vary on the tool of the curvature model.
#include "bead_vary.hpp"

namespace costate::tools {
namespace {

class CurvatureVary : public BeadVary {};

TEST_F(CurvatureVary, EveryPointIsWhatTheSceneAloneGives) {
  expect_points_of_scenes("mu", 0.1, 0.3);
  expect_points_of_scenes("slope", -1.2, -0.8);
  expect_points_of_scenes("x", 3, 5);
}

// On the way a flight is born at the start, where the parameter has an extremum along the equations but the solution no
// fold.
TEST_F(CurvatureVary, FlightIsBornOnTheWay) {
  expect_points_of_scenes("slope", -1, -0.3);
  const json branch = solved_json({"--vary", "slope=-0.77:-0.76:21"});
  EXPECT_EQ(branch.at("points").size(), 21u) << "none is lost where the flight is born";
  EXPECT_EQ(branch.at("points").front().at("structure"), "contact");
  EXPECT_EQ(branch.at("points").back().at("structure"), "ballistic-contact");
}

TEST_F(CurvatureVary, WithoutFrictionTheCycloidsAreListed) {
  expect_points_of_scenes("x", 3, 5, {"--mu", "0", "--beta", "0", "--slope", "free"});
  const Ended table = run({"--vary", "x=3:5:3", "--mu", "0", "--beta", "0", "--slope", "free"});
  EXPECT_EQ(table.status, 0) << table.err;
  EXPECT_TRUE(contains(table.out, "cycloid"));
  EXPECT_FALSE(contains(table.out, "nan")) << table.out;
}

TEST_F(CurvatureVary, BadInputIsNamed) {
  expect_refusals({{{"--vary", "slope=free:1"}, {"slope", "'free' is not a number", "rad"}},
                   {{"--vary", "slope=-1:1.6"}, {"slope 1.6", "-1.5707 … 1.5707 rad"}},
                   {{"--vary", "h=0:1"}, {"x, y, speed, slope, mu, beta, gravity"}}});
}

TEST_F(CurvatureVary, FlightsAreBornWhereTheyDie) {
  expect_event_between("slope", -0.8, -0.7);
  expect_event_between("x", 2.4, 2.1);
}

}  // namespace
}  // namespace costate::tools
