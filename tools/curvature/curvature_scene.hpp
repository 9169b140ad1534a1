/// \file
/// The bead with curvature-coupled friction, from its scene alone to the answer.
#pragma once

#include "common/outcome.hpp"

#include <costate/models/curvature.hpp>
#include <costate/shooting/solve.hpp>

namespace costate::curvature {

[[nodiscard]] tools::Outcome solve_scene(const Scene& scene, const SolveOptions& options);

}  // namespace costate::curvature
