/// \file
/// One start of a solve, and what follows where it leads nowhere. Private to the shooting library.
#pragma once

#include "approach.hpp"

namespace costate {

/// \throws BadInput naming an option out of range
void check_random(const RandomStarts& random);

/// Solves from one start, and verifies.
[[nodiscard]] Solution attempt(Shooting& shooting, const Start& start, const SolveOptions& options,
                               Effort effort = Effort::full);

/// Solves from random starts around one, until one leads to a verified solution: that, or else the first root that was refused, or a failed
/// solution without a message. Its counts and cost are those of all starts.
[[nodiscard]] Solution attempt_at_random(Shooting& shooting, const Eigen::VectorXd& around, const SolveOptions& options,
                                         const RandomStarts& random);

}  // namespace costate
