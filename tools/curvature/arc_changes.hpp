/// \file
/// How the arcs of the bead with curvature-coupled friction change along a branch.
#pragma once

#include <costate/models/curvature.hpp>
#include <costate/shooting/branch.hpp>

namespace costate::curvature {

/// What the arcs are beyond a junction where a guard vanishes (see Restructure):
///
/// - at the start, the slope being given: where h = 0 in contact a flight is born, and where μ λv v = λθ in flight a contact arc; a first
///   arc without length is left out;
/// - at the end of a flight: where λθ/(λv v) reaches μ a contact arc is born. There r = 3|β̂|η² = λθ/(λv v) − μ, and by H_u = 0
///   differentiated r = r_f − cos θ_f (1 + μ²) s to first order in the time s left (units of v_f and g), so the length of that arc in ω is
///   6|β̂|η_f/(cos θ_f (1 + μ²)).
///
/// Nothing for an arc inside: between two contact arcs h has a kink at zero rather than a flight of no length, and the variable of
/// integration of the contact arc runs off (dt = v η dω). Nothing for the death of a last contact arc: its equations are singular there.
[[nodiscard]] std::vector<Successor> arc_changes(const Scene& scene, const Junction& at);

}  // namespace costate::curvature
