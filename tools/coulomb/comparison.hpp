/// \file
/// The optimum beside the comparison curves: one table, one JSON object.
#pragma once

#include "common/output.hpp"
#include "coulomb_scene.hpp"

namespace costate::coulomb {

/// Prints as the flags ask and returns the exit status of the optimum. The JSON object is that of the optimum with "curves"
/// added.
int deliver_comparison(const tools::Heading& heading, const std::vector<Compared>& all, const tools::CommandLine& line);

}  // namespace costate::coulomb
