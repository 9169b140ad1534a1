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

}  // namespace
}  // namespace costate::tools
