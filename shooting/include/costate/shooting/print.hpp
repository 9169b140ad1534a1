/// \file
/// A solution as text, for programs that solve one problem.
#pragma once

#include <costate/shooting/solution.hpp>

namespace costate {

/// Every unknown and report on a line of its own, "name  value  +- bound  unit", with as many digits as a double has; of a solution
/// that is not `solved`, nothing.
[[nodiscard]] std::string results(const Solution& solution);

/// Prints the results, or on standard error why there are none. Returns what `main` should: 0 if it is solved, else 1.
int print(const Solution& solution);

}  // namespace costate
