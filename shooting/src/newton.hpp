/// \file
/// Newton's method damped by natural levels: what it does depends on the unknowns alone, not on how the equations are
/// scaled.
///
/// With the correction Δ = −J(y)⁻¹R(y) a damping λ ∈ (0, 1] is admissible if the simplified correction Δ̄ = −J(y)⁻¹R(y +
/// λΔ), the one that follows with the same Jacobian, is shorter: ‖Δ̄‖ ≤ (1 − λ/4)‖Δ‖. λ is predicted from what the last step
/// told of the Lipschitz constant of J, and corrected within the step by
///
///     λ ← ½λ²‖Δ‖ / ‖Δ̄ − (1 − λ)Δ‖.
///
/// Against a line search on ‖R‖ it does not creep along the valleys of an ill-conditioned J, and sees after a few
/// evaluations when it leads nowhere. Reference: P. Deuflhard, Newton Methods for Nonlinear Problems, 2004, §3.3.2,
/// algorithm NLEQ-ERR.
#pragma once

#include "staircase.hpp"

#include <costate/nonlinear.hpp>
#include <costate/problem.hpp>
#include <costate/shooting/shooting.hpp>

namespace costate {

/// Equations R(y) = 0 as a damped Newton method sees them, of any structure inside. Vectors are in the unknowns' own units.
class NewtonSystem {
 public:
  NewtonSystem() = default;
  NewtonSystem(const NewtonSystem&) = delete;
  NewtonSystem& operator=(const NewtonSystem&) = delete;
  virtual ~NewtonSystem() = default;
  /// R(y), every row in units of its scale. \throws LeftDomain
  virtual Eigen::VectorXd residual(const Eigen::VectorXd& y) = 0;
  /// Factors J at the point of the last residual, for `correction`. False where that fails.
  virtual bool linearize() = 0;
  /// −J⁻¹r for the J factored last and any r as `residual` gives it. Not finite if J is singular.
  virtual Eigen::VectorXd correction(const Eigen::VectorXd& r) = 0;
};

/// Limits that iterates do not cross: a step that would is cut to nine tenths of the way. Where the start itself is beyond a
/// limit that limit does not hold.
struct Bounds {
  Eigen::VectorXd lower, upper;
  /// Those of a shooting's unknowns; nodes have none.
  static Bounds of(const Shooting& shooting);
  /// The largest share ≤ 1 of a step from y that stays within.
  [[nodiscard]] double share(const Eigen::VectorXd& y, const Eigen::VectorXd& step) const;
};

struct NaturalOptions {
  double residual_tolerance = 1e-5;  ///< converged when max |Rᵢ| is below
  double step_tolerance = 1e-8;      ///< … or ‖Δ‖, in scaled unknowns
  bool relative = false;             ///< lengths are measured in the larger of an unknown's scale and magnitude
  double noise = 1e-3;    ///< a Δ shorter than this that cannot be damped into a contraction is lost in noise: small_step
  double max_step = 5.0;  ///< bound on the length of λΔ, in scaled unknowns
  double least_damping = 1e-4;  ///< a λ that would have to be smaller: stalled
  int max_iterations = 50;
};

/// Improves y in place; on failure y is the last iterate. The norm is the 2-norm in units of `scale`.
NewtonResult natural_newton(NewtonSystem& system, Eigen::VectorXd& y, const Eigen::VectorXd& scale, const Bounds& bounds,
                            const NaturalOptions& options);

/// The equations of a Shooting, cut or not.
class ShootingSystem final : public NewtonSystem {
 public:
  explicit ShootingSystem(Shooting& shooting)
      : shooting_(shooting), unknown_scales_(shooting.unknown_scales()), row_scales_(shooting.row_scales()) {}
  Eigen::VectorXd residual(const Eigen::VectorXd& y) override;
  bool linearize() override;
  Eigen::VectorXd correction(const Eigen::VectorXd& r) override;
  /// Sign of det J at y, 0 if J is not defined there. Two roots that merge in a fold have opposite ones.
  [[nodiscard]] int orientation(const Eigen::VectorXd& y);

 private:
  Shooting& shooting_;
  Eigen::VectorXd point_, unknown_scales_, row_scales_;
  std::optional<Staircase> factors_;
};

}  // namespace costate
