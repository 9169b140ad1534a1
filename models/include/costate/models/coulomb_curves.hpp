/// \file
/// Descent along given wires with Coulomb friction: the comparison curves of Kurilin, arXiv:2501.18622 (2025), here [K].
///
/// From rest at (0, 0) to (L, H), y down, b the slope from straight down. Along a wire that bends up, b grows and
///
///     v² e^{2μb} = 2g ∫ e^{2μb} (dy − μ dx),   T = ∫ ds/v.
///
/// The integrand of the first changes its sign at most once, so v vanishes inside the wire only if it would be imaginary at
/// the end.
#pragma once

#include <costate/models/coulomb.hpp>

#include <optional>
#include <vector>

namespace costate::coulomb {

enum class Curve {
  kurilin,   ///< see Kurilin
  cycloid,   ///< [K] (15): the brachistochrone without friction, its cusp at the start
  parabola,  ///< [K] (50): y/H = (1 + ε)(x/L) − ε(x/L)², ε ≥ 0
  circle,    ///< an arc that starts straight down, of radius (L² + H²)/(2L); a quarter circle if H = L
  gladkov,  ///< [14] of [K]: x = k ∫ sin²b e^{−4μb} db, y = k ∫ sin b cos b e^{−4μb} db from b = 0; exists iff 2μ ≤ H/L
};
inline constexpr Curve curves[] = {Curve::kurilin, Curve::cycloid, Curve::parabola, Curve::circle, Curve::gladkov};
[[nodiscard]] const char* name_of(Curve curve);

/// A point of a descent. SI units; α is the slope below the horizontal.
struct DescentPoint {
  double t, x, y, v, alpha;
};

/// What becomes of the bead on a wire.
struct Descent {
  enum class End {
    arrives,
    stops,     ///< before the end, at (stop_x, stop_y)
    no_curve,  ///< the family has no curve through both points
  };
  End end = End::no_curve;
  double final_time = 0.0, end_speed = 0.0;                       ///< if it arrives
  double time_bound = 0.0, speed_bound = 0.0, angle_bound = 0.0;  ///< of the errors of times, speeds and slopes
  double alpha0 = 0.0, alphaF = 0.0;                              ///< slopes of the wire at both ends
  double stop_x = 0.0, stop_y = 0.0;
  double limit = 0.0;  ///< the coefficient from which on the bead does not arrive (gladkov: above which there is no curve)
};

/// The descent of a scene along a curve. \throws BadInput unless H, L, g are positive, μ ≥ 0 and ε ≥ 0.
[[nodiscard]] Descent descend(Curve curve, const Scene& scene, double epsilon = 0.6);

/// Points of a descent that arrives, `cells` + 1 of them. \throws BadInput as descend, or if it does not arrive.
[[nodiscard]] std::vector<DescentPoint> descent_points(Curve curve, const Scene& scene, double epsilon = 0.6,
                                                       int cells = 100);

/// The curve that [K] takes for the brachistochrone: its slope turns at a constant rate, α' = −ω, while the bead slides down
/// it from rest. With θ = b − b₀ and tan m = μ,
///
///     v = (g/ω) V,  V = sin(b + 2m) − e^{−μθ} sin(b₀ + 2m),   x = (g/ω²) ∫ V sin b db,   g(y − μx) = v²/2 + μ ∫ v² db.
///
/// Both ends leave one parameter free; b₀ is where the time is stationary in it. C = 2g/ω² in [K].
struct Kurilin {
  double alpha0, alphaF;  ///< rad
  double C;               ///< m
  double final_time, end_speed;
  double angle_bound;     ///< of the errors of the slopes, rad
  double time_bound;      ///< of the relative error of the time, in which b₀ is stationary
  double relative_bound;  ///< of the relative errors of C and the speed
};

/// The fastest curve of that family; none if μ ≥ H/L. \throws BadInput as descend.
[[nodiscard]] std::optional<Kurilin> kurilin(const Scene& scene);

}  // namespace costate::coulomb
