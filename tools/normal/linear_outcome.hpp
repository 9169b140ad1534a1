/// \file
/// The scene of a bead with friction in proportion to the normal force, in closed form.
#pragma once

#include <costate/models/normal_friction.hpp>

#include "common/outcome.hpp"

namespace costate::normal_friction {

/// The fastest motion of a scene with β = 0 and v₀² > 2 g (y + μ x): a cycloid in a frame tilted to gravity and friction, or straight
/// along both. Quantities as the reports of make_problem.
[[nodiscard]] tools::Outcome linear_outcome(const Scene& scene);

}  // namespace costate::normal_friction
