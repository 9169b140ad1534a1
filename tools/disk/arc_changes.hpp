/// \file
/// How the arcs of the rolling disk change along a branch.
#pragma once

#include <costate/models/disk.hpp>
#include <costate/shooting/branch.hpp>

namespace costate::disk {

/// What the arcs are beyond a junction where guards vanish (see Restructure):
///
/// - an arc without duration is left out. A free arc leaves its neighbours in contact, a switch of V'; a saturated one between two
///   free arcs makes them one; a boundary arc between two saturated ones leaves a switch.
/// - where the friction that a free arc uses touches the limit, at its end or inside, a saturated arc is born;
/// - where λ_V would change its sign on a saturated arc, at its end or at a switch, a free arc is born;
/// - where V' reaches zero on a saturated arc, at the end of the motion or at a switch, a boundary arc is born.
///
/// Guards that vanish together (a symmetric scene) are obeyed together; those of an arc without duration do not count. An arc
/// is born short; the equations have a regular limit as its duration vanishes, so its first duration need only be small, not
/// accurate.
[[nodiscard]] std::vector<Successor> arc_changes(const Scene& scene, const Junction& at);

}  // namespace costate::disk
