/// \file
/// The flags that scenes of a bead on a wire share. A scene has members x, y, speed, mu, beta and gravity.
#pragma once

#include "common/command_line.hpp"

namespace costate::bead {

/// --x, --y and --speed: where the motion ends, y up, and how fast it starts from (0, 0).
template <class Scene>
void motion_flags(tools::CommandLine& line, Scene& scene) {
  line.number("--x", scene.x, {1e-6, 1e6, "m"}, "End point x, to the right of the start");
  line.number("--y", scene.y, {-1e6, 1e6, "m"}, "End point y, up");
  line.number("--speed", scene.speed, {1e-6, 1e6, "m/s"}, "Speed at the start");
}

/// --mu and --beta, the coefficients of K = −μ s + β s³ within the given ranges, and --gravity.
template <class Scene>
void friction_flags(tools::CommandLine& line, Scene& scene, const tools::Range& mu, const tools::Range& beta) {
  line.number("--mu", scene.mu, mu, "Linear friction coefficient mu");
  line.number("--beta", scene.beta, beta, "Cubic friction coefficient beta: hard if negative, soft if positive");
  line.number("--gravity", scene.gravity, {1e-6, 1e6, "m/s^2"}, "Gravity g");
}

}  // namespace costate::bead
