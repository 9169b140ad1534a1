/// \file
/// From a direct solution to a sequence of arcs.
///
/// Every step of the grid is given to one arc, in their order, so that the sum over the steps of
///
///     min(1, Σ ((uᵢ − u_arc(q̄ᵢ, λᵢ))/scale)² + d²)
///
/// is least, found by dynamic programming; d measures how far c is from 0 for an arc along a state constraint, and how far H_u is from 0 for a
/// singular one. A law that cannot be evaluated costs 1. A touched constraint is placed where its multiplier is.
///
/// Along a constraint of order r the costates of indirect adjoining differ from the direct ones: with M₀(t) the sum of the multipliers
/// after t and M₁(t) = ∫ M₀ from t to the exit, λ_indirect = λ_direct + M₀ ∂c/∂q (+ M₁ ∂c'/∂q if r = 2), by parts from Σ ηᵢ c(tᵢ); the jumps at
/// the entry are M₀ and M₁ there.
///
/// Reference: Hartl, Sethi & Vickson, SIAM Review 37 (1995) 181–218, §§4–6.
#pragma once

#include "direct_phase.hpp"

namespace costate {

/// A direct solution told apart into arcs.
struct DirectArcs {
  struct Piece {
    double duration = 0.0;
    Eigen::MatrixXd points;           ///< (q, λ) at the middle of its steps (2n × steps)
    std::vector<double> multipliers;  ///< of the jump at its start, as many as that has
  };
  std::vector<Piece> pieces;
  double cost = 0.0;  ///< the sum above, per step: 0 is a perfect match
};

[[nodiscard]] DirectArcs split(const ExtremalStatement& statement, const DirectData& data, const DirectSolution& solution);

}  // namespace costate
