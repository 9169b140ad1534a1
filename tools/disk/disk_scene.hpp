/// \file
/// From a scene of the rolling disk to its solution, with no guess asked: the scene decides the arcs.
#pragma once

#include <costate/models/disk.hpp>
#include <costate/shooting/solve.hpp>

#include "common/outcome.hpp"

namespace costate::disk {

/// What became of a scene of the disk.
struct Outcome : tools::Outcome {
  std::optional<double> F_max;  ///< largest and smallest friction coefficient the unlimited solution uses
  std::optional<double> F_min;
  std::optional<double> k_min;  ///< below it no motion with monotone heading exists; known for symmetric scenes
};

/// Solves a scene.
///
/// First the disk with unlimited friction, one free arc, by continuation in the end point from the disk that turns on the
/// spot (x_f = y_f = 0: λx = λy = 0, t_f = |φ_f| L/c₁); a small end heading is approached in several ways and the fastest
/// extremal kept. If the scene has no friction coefficient, or one that never binds, that is the answer. Otherwise the branch in
/// k_f is followed down from where it does not bind, through every change of the arcs (arc_changes).
[[nodiscard]] Outcome solve_scene(const Scene& scene, const SolveOptions& options);

/// How a solved scene is followed: where friction is limited but does not bind, its problem must know the limit all the same.
[[nodiscard]] std::optional<tools::BranchStart> branch_start(const Scene& scene, const tools::Outcome& outcome);

/// The least friction coefficient of a symmetric scene (chord at half the end heading, which is at most π): that of the
/// circular arc at constant speed, c₁² R/(g (R² + L²)), R the circle's radius. Nothing for other scenes.
[[nodiscard]] std::optional<double> least_friction(const Scene& scene);

}  // namespace costate::disk
