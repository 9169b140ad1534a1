/// \file
/// What holds at a corner of the bead with normal-force friction. Private to the models library.
#pragma once

#include <costate/models/normal_friction.hpp>

#include <array>

namespace costate::normal_friction {

/// Two numbers that vanish where v and λv are the same on both sides of a corner, at τ = `before` and τ = `after`.
///
/// Where the jump J = θ_after − θ_before is not small: the ratios of v and of λv across it less 1, over J, with which they vanish. Where it is,
/// these say nearly the same, and what tells them apart is lost to rounding. By d(v/v_f)/dθ = f Γ/q² and dλv/dθ = −cos τ Γ/q², and with
/// the mean slope's values (index m), they are then
///
///     q_m/J ∫ (f f_m + cos τ cos τ_m)/(f_m² + cos² τ_m) Γ/q² dθ,   1/J³ ∫ (f cos τ_m − f_m cos τ) Γ/q² dθ,
///
/// in which f cos τ_m − f_m cos τ = −sin(θ − θ_m) D has the factor θ − θ_m exactly:
///
///     D = l + cubic (cos² θ sin θ₂ + cos θ_m cos τ sin(θ + θ_m)),   l = x sin θ₂ − y cos θ₂.
///
/// Both are even in J and regular at 0, where they say that Γ = 0 and dΓ/dθ ∼ 0: a corner dies where it would be born.
[[nodiscard]] std::array<Jet, 2> corner_rows(const Push<Jet>& push, const Jet& theta2, const Jet& before, const Jet& after);

}  // namespace costate::normal_friction
