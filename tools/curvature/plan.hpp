/// \file
/// From a transcribed motion to the shooting problem it is an estimate of.
#pragma once

#include "curvature/transcription.hpp"

#include <costate/models/curvature.hpp>

namespace costate::curvature {

/// The arcs of a transcribed motion, with nodes where backward integration has amplified a disturbance by about `growth`.
///
/// Contact and flight are told apart by the sign of λθ/(λv v) − μ = 3|β̂|η², which the adjoints of the transcription give; junctions
/// lie where it changes, found by interpolation.
[[nodiscard]] Plan make_plan(const ScaledScene& scene, const Transcribed& motion, double growth = 50.0);

/// A plan with the nodes of its contact arcs placed anew, by the same rule, along the arcs as they were integrated: `shot` is an evaluation of the
/// plan's problem.
[[nodiscard]] Plan with_new_nodes(Plan plan, const Shot& shot, double growth);

}  // namespace costate::curvature
