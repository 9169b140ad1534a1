/// \file
/// How corners of the bead's path come and go along a branch.
#pragma once

#include <costate/models/normal_friction.hpp>
#include <costate/shooting/branch.hpp>

namespace costate::normal_friction {

/// What the arcs are beyond a junction where a guard vanishes (see Restructure):
///
/// - −H_θθ inside an arc: a corner is born there, small, between two maxima of H; the arc is cut in two;
/// - the jump at a corner: the two arcs are one again;
/// - H at the start less its other maximum: an arc with that slope is born at the start, and a corner after it;
/// - the turn of the first arc: the motion starts with the second.
///
/// None where −H_θθ vanishes at an end of an arc: another maximum of H is higher before that.
[[nodiscard]] std::vector<Successor> corner_changes(const Scene& scene, const Junction& at);

}  // namespace costate::normal_friction
