/// \file
/// A direct method: where the search for an extremal starts from. Nothing here reaches the user: its answer is an estimate.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace costate::curvature {

/// A scene without units: lengths v₀²/g, times v₀/g.
struct ScaledScene {
  double x, y;
  std::optional<double> slope;
  double mu, beta;  ///< μ, β̂ = β g² < 0
};

/// Values at a node of the transcription, in units of v₀ and g.
struct TranscribedNode {
  double tau;  ///< ∫ dt/v
  double time, theta, log_v, eta;
  double along, turn;  ///< λv v and λθ
  double bound;        ///< multiplier of η ≥ 0
};

/// A local minimum of the transcribed problem.
struct Transcribed {
  bool converged = false;
  std::vector<TranscribedNode> nodes;
  double time = 0.0;
  double y = 0.0;  ///< where it ends
  double lambda_x = 0.0, lambda_y = 0.0;
  double miss = 0.0;  ///< distance left to the end point, as a fraction of its own
  int iterations = 0;
};

enum class Goal {
  fastest,  ///< to the end point
  highest,  ///< anywhere on the end point's vertical
};

struct TranscriptionOptions {
  Goal goal = Goal::fastest;
  int cells = 40;
  int max_iterations = 150;
};

/// Where the control of a transcription starts from: η on the cells of τ, and θ(0).
struct ControlGuess {
  std::vector<double> tau, eta;
  double slope;
  double miss = 0.0;
};

/// Simple controls (η piecewise linear in τ) that come nearest to the end point, the nearest first.
[[nodiscard]] std::vector<ControlGuess> simple_controls(const ScaledScene& scene);

/// Simple controls that reach the end point's vertical, the highest first.
[[nodiscard]] std::vector<ControlGuess> high_controls(const ScaledScene& scene);

/// The fastest (or highest) motion with η ≥ 0 piecewise linear on cells of τ.
///
/// In τ, dt = v dτ, the scene has no scale of its own: θ' = η − cos θ, (ln v)' = k(η) − sin θ, however small v₀ is beside v_f. The
/// unknowns are the η at the nodes, the length in τ and, if free, θ(0); the motion follows from them, stably, so the problem has
/// two equality constraints and is solved by Newton's method in their null space with exact second derivatives, made definite by a
/// shift, a barrier for η ≥ 0 (Nocedal & Wright, Numerical Optimization, 2nd ed. 2006, ch. 18–19), and a line search. Every accepted
/// step descends, which the equations of the extremal, a saddle, do not offer.
[[nodiscard]] Transcribed transcribe(const ScaledScene& scene, const ControlGuess& guess,
                                     const TranscriptionOptions& options);

/// The same motion on `cells` cells chosen so that η and θ change equally in each.
[[nodiscard]] ControlGuess regrid(const Transcribed& coarse, int cells);

}  // namespace costate::curvature
