/// --vary on the tool of the normal model.
#include "bead_vary.hpp"

namespace costate::tools {
namespace {

class NormalVary : public BeadVary {};

TEST_F(NormalVary, EveryPointIsWhatTheSceneAloneGives) {
  expect_points_of_scenes("mu", 3, 10);
  expect_points_of_scenes("beta", -0.05, 0.02);
  expect_points_of_scenes("y", -12, -6);
}

// β = 0 is in closed form when solved alone, and followed with the shooting problem all the same.
TEST_F(NormalVary, LinearFrictionIsFollowedToo) {
  expect_points_of_scenes("x", 2, 8, {"--beta", "0"});
  expect_points_of_scenes("mu", 0, 5, {"--beta", "0"});
  expect_points_of_scenes("beta", 0, 0.01, {"--mu", "0"});
}

// The fastest path gets a corner at its start where H there has two equal maxima.
TEST_F(NormalVary, CornersAreBornOnTheWay) {
  expect_event_between("beta", -0.13, -0.14);
  expect_event_between("speed", 34, 33, {"--beta", "-0.12"});
}

}  // namespace
}  // namespace costate::tools
