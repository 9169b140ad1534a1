/// \file
/// The scene of a bead without friction, delivered in closed form.
#pragma once

#include "common/outcome.hpp"

namespace costate::bead {

/// The fastest motion without friction from (0, 0), left at `speed`, to (a, b), y up: solved by a cycloid, or infeasible because
/// the bead has not the energy to rise to b. Quantities: final_time, lambda_x, lambda_y, lambda_v0, theta1, theta2.
[[nodiscard]] tools::Outcome cycloid_outcome(double a, double b, double speed, double gravity);

}  // namespace costate::bead
