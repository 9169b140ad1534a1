/// \file
/// How the arcs of the bead with curvature-coupled friction change along a branch.
#pragma once

#include <costate/models/curvature.hpp>
#include <costate/shooting/branch.hpp>

namespace costate::curvature {

/// What the arcs are beyond a junction where a guard vanishes at the start of the motion (see Restructure), the slope there being
/// given:
///
/// - where h(0) = 0 in contact a flight is born, and where μ λv v = λθ in flight a contact arc;
/// - a first arc without length is left out.
///
/// Nothing for an arc inside or at the end: between two contact arcs h has a kink at zero rather than a flight of no length, and the
/// variable of integration of the contact arc runs off (dt = v η dω).
[[nodiscard]] std::vector<Successor> arc_changes(const Scene& scene, const Junction& at);

}  // namespace costate::curvature
