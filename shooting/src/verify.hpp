/// \file
/// Is a root of the shooting equations a solution of the problem?
#pragma once

#include <costate/shooting/shooting.hpp>
#include <costate/shooting/solution.hpp>

namespace costate {

/// Checks the domain of every unknown at a point of the shooting, integrates the arcs anew with dense output into `solution.arcs`, and evaluates every
/// path check along them into `solution.certificate`. Returns the reason why the root is no solution, or nothing.
[[nodiscard]] std::string verify_root(Shooting& shooting, const Eigen::VectorXd& point, double accuracy, Solution& solution);

}  // namespace costate
