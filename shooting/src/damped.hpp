/// \file
/// Newton's method with damping, from far away. Private to the shooting library.
///
/// A step λΔ, Δ = −J⁻¹R, is judged by the next simplified correction Δ̄ = −J⁻¹R(y + λΔ): the natural level function, which knows no
/// scaling of the rows, must fall by a factor of 1 − λ/4, and λ is predicted from how nonlinear the last step was
/// (Deuflhard, Newton Methods for Nonlinear Problems, 2004, §§3.3, 7.1: algorithm NLEQ-ERR, and its use in multiple shooting).
#pragma once

#include <costate/shooting/shooting.hpp>

namespace costate {

struct DampedOptions {
  double tolerance = 1e-4;  ///< of the last full correction, in scaled unknowns
  int max_iterations = 100;
  double first_damping = 1.0;
  double least_damping = 1e-4;
};

struct DampedResult {
  bool converged = false;
  int iterations = 0;
  std::string message{};                  ///< why not
  std::optional<SegmentPlace> blocked{};  ///< the segment that could not be integrated, if that was it
};

/// Improves y in place. Unknowns with a limit keep a tenth of their distance from it at every step.
[[nodiscard]] DampedResult damped_newton(Shooting& shooting, Eigen::VectorXd& y, const DampedOptions& options);

}  // namespace costate
