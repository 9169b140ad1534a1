/// \file
/// All extremals of a scene with drag, found without a guess.
#pragma once

#include <costate/models/drag.hpp>

#include <vector>

namespace costate::drag {

/// The extremals of a scene, fastest first, good to five digits or more: guesses for the shooting problem.
///
/// Each family of orbits is a sheet over two coordinates, and (ln x, asinh(y/x)) of where its orbits end is a map of the
/// plane. The map is laid over a fixed grid. Newton's method with exact derivatives starts in every triangle of the grid
/// whose image holds the wanted end point, and at the nodes that come closest to it. The orbits are quadratures
/// (drag_orbits.hpp), here by Gauss's rule on panels that grow away from the ends of the path: some microseconds each. What
/// lies between the nodes of the grid unnoticed (a pair of extremals in one triangle) or outside the grid is not found.
[[nodiscard]] std::vector<Guess> find_extremals(const Scene& scene);

}  // namespace costate::drag
