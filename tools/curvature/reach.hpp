/// \file
/// What holds for every motion of a scene, not only for those a search has met: how high a bead can get, and where no motion is the
/// fastest.
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

/// An infimum of the time that no motion attains: braking at once to a lower speed, then flying freely.
struct Braking {
  double time;   ///< the infimum, in units of v₀/g
  double speed;  ///< to brake to, in units of v₀
};

/// The infimum of a scene whose end point lies below the free flight that starts with its slope θ₀; nothing for other scenes, free
/// slopes, or tan θ₀ > μ.
///
/// A wire only pushes up, so seen from a body that falls freely beside the bead no motion with |θ| ≤ π/2 gets to the right of the
/// ray along θ₀: the velocity across it, to the right, is r = v sin(θ₀ − θ) − g t cos θ₀, with r(0) = 0. Where θ > θ₀, r < 0; where
/// 0 ≤ θ₀ − θ ≤ π/2,
///
///     r' = K sin(θ₀ − θ) − h cos(θ₀ − θ) ≤ 0,
///
/// and beyond π/2, which |θ| ≤ π/2 leaves only if θ₀ > 0, r' ≤ 0 still holds since −cos/sin ≤ tan θ₀ ≤ μ ≤ |K|/h. At the end this
/// says b + g t_f²/2 ≥ a tan θ₀: t_f ≥ T* = √(2 (a tan θ₀ − b)/g), with equality only for r ≡ 0, the free flight at v₀, which
/// passes above the end point. Yet t_f comes as close to T* as one likes: a normal force h → ∞ brakes like −|β|h³ and turns like h/v,
/// so it brings the speed to a/(T* cos θ₀) < v₀ in a time and with a turn that vanish; from there on the bead flies.
[[nodiscard]] std::optional<Braking> braking_infimum(const ScaledScene& scene);

}  // namespace costate::curvature
