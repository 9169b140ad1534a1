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

}  // namespace
}  // namespace costate::tools
