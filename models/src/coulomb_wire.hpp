/// \file
/// What the two sources of the comparison curves share. Private to the models library.
#pragma once

#include <costate/models/coulomb_curves.hpp>

namespace costate::coulomb {

/// \throws BadInput unless H, L, g are positive numbers, μ and ε numbers not below 0.
void check_wire_scene(const Scene& scene, double epsilon);

/// Points of the descent along a curve of the family, at equal times.
[[nodiscard]] std::vector<DescentPoint> kurilin_points(const Scene& scene, const Kurilin& curve, int cells);

}  // namespace costate::coulomb
