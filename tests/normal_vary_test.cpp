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

}  // namespace
}  // namespace costate::tools
