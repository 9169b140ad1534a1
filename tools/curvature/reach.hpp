/// \file
/// How high a bead can get: a bound that holds for every motion, not only for those a search has met.
#pragma once

#include "curvature/transcription.hpp"

namespace costate::curvature {

/// No motion whose inclination stays within ±π/2 reaches the end point's vertical above this height; in the scene's lengths v₀²/g.
///
/// h³ lies above its tangent at any c ≥ 0, h³ ≥ 3c²h − 2c³, so K ≤ −μ'h + 2|β|c³ with μ' = μ + 3|β|c². In z = v² e^{2μ'θ} the turning
/// rate drops out, as in Coulomb's case:
///
///     dz/ds ≤ −2g φ(θ),   φ = e^{2μ'θ} (sin θ + μ' cos θ − 2|β|c³/g).
///
/// If the line p cos θ + q sin θ touches φ from below at the slope of the chord, z_f ≤ z₀ − 2g (p a + q b), whatever the path; and
/// z_f > 0. The best c is close to the normal force on a straight wire, where all this is sharp.
[[nodiscard]] double reach_bound(const ScaledScene& scene);

}  // namespace costate::curvature
