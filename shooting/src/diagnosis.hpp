/// \file
/// What a user needs to know of a system that cannot be solved. Private to the shooting library.
#pragma once

#include "staircase.hpp"

#include <costate/shooting/shooting.hpp>

#include <string>

namespace costate {

/// The three rows that are worst, by name and value.
[[nodiscard]] std::string worst_rows(const Shooting& shooting, const Eigen::VectorXd& residual);

/// The combination of unknowns, each over its scale, that the rows determine least, by name: "0.71 lambda_x - 0.70 lambda_y".
[[nodiscard]] std::string weakest_direction(const Shooting& shooting, const Staircase& jacobian);

/// Looks for rows that depend on no unknown and unknowns that no row depends on, at y and at a point beside it.
/// \throws BadInput naming the first of them
void check_well_posed(Shooting& shooting, const Eigen::VectorXd& y);

}  // namespace costate
