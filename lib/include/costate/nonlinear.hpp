/// \file
/// Systems of nonlinear equations R(y) = 0 with an exact Jacobian, solved by KINSOL (Hindmarsh et al. 2005).
#pragma once

#include <Eigen/Core>
#include <Eigen/LU>
#include <memory>
#include <string>

namespace costate {

/// R: ℝᴺ → ℝᴺ. The solver asks for the Jacobian only at the point where it last asked for the residual.
///
/// Newton's linear systems are the system's own: one with structure overrides `factorise` and `solve`, and need not form a dense
/// Jacobian; the default does, and decomposes it by LU with partial pivoting.
class NonlinearSystem {
 public:
  NonlinearSystem() = default;
  NonlinearSystem(const NonlinearSystem&) = delete;
  NonlinearSystem& operator=(const NonlinearSystem&) = delete;
  virtual ~NonlinearSystem() = default;

  [[nodiscard]] virtual Eigen::Index size() const = 0;
  /// \throws LeftDomain where R is not defined: the step that led there is shortened.
  virtual void residual(const Eigen::VectorXd& y, Eigen::VectorXd& r) = 0;
  virtual void jacobian(const Eigen::VectorXd& y, Eigen::MatrixXd& j) = 0;

  /// Makes ready to solve with the Jacobian at y; false if it is not finite or exactly singular.
  virtual bool factorise(const Eigen::VectorXd& y);
  /// x with J x = r, J the last one factorised.
  virtual void solve(const Eigen::VectorXd& r, Eigen::VectorXd& x) const { x = dense_.solve(r); }

 private:
  Eigen::PartialPivLU<Eigen::MatrixXd> dense_;
};

struct NewtonOptions {
  double residual_tolerance = 1e-9;  ///< stop when max |Rᵢ| / row_scaleᵢ is below
  double step_tolerance = 1e-14;     ///< … or when max |Δyⱼ| / unknown_scaleⱼ is
  double max_step = 1.0;             ///< bound on the scaled 2-norm of one step
  int max_iterations = 50;
  bool line_search = true;           ///< otherwise full steps, shortened only at the border of the domain
};

/// How an iteration ended; each but `internal` says something about the problem.
enum class Termination {
  converged,          ///< scaled residual ≤ residual_tolerance
  small_step,         ///< the step fell below step_tolerance first
  stalled,            ///< the line search found no decrease
  iteration_limit,    ///< max_iterations reached
  step_limit,         ///< five steps in a row at max_step: diverging, or max_step too small
  left_domain,        ///< R is not defined near the iterate, however short the step
  singular_jacobian,  ///< the linear solve broke down
};
[[nodiscard]] const char* describe(Termination termination);

struct NewtonResult {
  Termination termination = Termination::converged;
  int iterations = 0;
  long residual_evaluations = 0;
  double residual_norm = 0.0;  ///< scaled 2-norm of R at the last point
  std::string message{};       ///< of the last excursion from the domain, if any
  [[nodiscard]] bool converged() const { return termination == Termination::converged; }
};

/// KINSOL for systems of one size; its memory is kept between solves. Newton's method with the exact Jacobian at every step.
class Kinsol {
 public:
  explicit Kinsol(Eigen::Index size);
  ~Kinsol();
  Kinsol(Kinsol&&) noexcept;
  Kinsol& operator=(Kinsol&&) noexcept;

  /// Improves y in place. Scales are typical magnitudes of the unknowns and admissible errors of the rows (all positive).
  /// Exceptions of the system other than LeftDomain pass through.
  NewtonResult solve(NonlinearSystem& system, Eigen::VectorXd& y, const Eigen::VectorXd& unknown_scale,
                     const Eigen::VectorXd& row_scale, const NewtonOptions& options);

 private:
  struct Memory;
  std::unique_ptr<Memory> memory_;
};

}  // namespace costate
