/// \file
/// Roots of a shooting problem fast and without a certificate: for sweeps, real time, and as the first part of a certified solve.
///
/// Newton's method with the exact Jacobian, damped by natural levels (P. Deuflhard, Newton Methods for Nonlinear Problems, 2004,
/// §§3.3.2, 2.1.1), on a ladder of integration tolerances. With the corrections Δₖ = −J(yₖ)⁻¹R(yₖ) and what the Jacobian of the last
/// step makes of the residual after it, Δ̄ₖ₊₁ = −J(yₖ)⁻¹R(yₖ₊₁), the contraction
///
///     c = ‖Δ̄ₖ₊₁‖ / ‖Δₖ‖²      predicts      ‖yₖ₊₁ − y*‖ ≈ c‖Δₖ‖²  and  ‖Δₖ₊₁‖ ≈ c‖Δₖ‖²:
///
/// an integration need be no more accurate than the step taken from it, and none is needed to confirm the last one. Where the known
/// Jacobian is good enough for the last correction, which then has an error of about 2c‖Δₖ‖‖Δ̄ₖ₊₁‖, the states alone are integrated.
#pragma once

#include <costate/shooting/shooting.hpp>

#include <span>

namespace costate {

struct LocateOptions {
  double accuracy = 1e-8;         ///< wanted of every unknown, in units of the larger of its scale and magnitude
  double first_tolerance = 3e-2;  ///< of the integrations from a start
  /// Of the last integration, where an error of the rows by it moves the unknowns by as much; less where it moves them by more, and
  /// for multistep methods, whose errors add up to some ten times their tolerance.
  double tolerance_per_accuracy = 2.0;
  Method method = Method::adams;
  long max_steps = 20000;     ///< of the integrator, per arc
  double longest_step = 0.0;  ///< see FlowOptions
  int max_iterations = 50;    ///< corrections from one start
  double max_step = 5.0;      ///< bound on the length of a correction
};

struct Located {
  Termination termination = Termination::converged;
  Eigen::VectorXd y;        ///< the root, or where the search ended
  int iterations = 0;       ///< corrections
  double correction = 0.0;  ///< length of the last
  double tolerance = 0.0;   ///< of the last integration
  /// Estimated from the contraction and the tolerance of the last integration. It is no bound: a solve gives one.
  double error = 0.0;
  Statistics statistics{};  ///< what it has cost
  std::string message{};    ///< of the last excursion from the domain, if any
  [[nodiscard]] bool converged() const { return termination == Termination::converged; }
};

/// Looks for roots of one shooting, whose arcs are cut or not; the largest of |yⱼ| / max(scaleⱼ, |yⱼ|) is the length of y. Limits of
/// the unknowns are not crossed: a step that would is cut to nine tenths of the way, and a search that only a limit keeps from a root
/// has `stalled`; so has one that led to a root at or beyond a limit from a start there. All memory is kept, and with up to eight
/// unknowns and whole arcs none is allocated from the second root on, but for what is returned.
class Locator {
 public:
  /// The shooting must outlive the locator, and is left with flow options of its choice.
  /// \throws BadInput for an option out of range
  explicit Locator(Shooting& shooting, const LocateOptions& options = {});
  ~Locator();

  /// From a start that may be rough. A failure is a Located that has not converged.
  /// \throws BadInput for a start of the wrong size or with a value that is not finite
  [[nodiscard]] Located find(const Eigen::Ref<const Eigen::VectorXd>& start);
  /// From a prediction: at the last tolerance at once, and by the Jacobian of the root before as long as that does. Ends with `stalled`
  /// where corrections do not contract or would cross a limit: find() may succeed.
  [[nodiscard]] Located correct(const Eigen::Ref<const Eigen::VectorXd>& prediction);

 private:
  class Search;
  std::unique_ptr<Search> search_;
};

/// One root, from a start.
[[nodiscard]] Located locate(Shooting& shooting, const Eigen::Ref<const Eigen::VectorXd>& start,
                             const LocateOptions& options = {});

/// Roots for a sequence of values of a parameter, each predicted by the polynomial through those before, of the order that did best
/// so far. Ends with the first value at which no root is found. The shooting is left at the last value.
/// \throws BadInput as Locator does, for an unknown parameter, and for values that are not finite
[[nodiscard]] std::vector<Located> locate_along(Shooting& shooting, const Eigen::Ref<const Eigen::VectorXd>& start,
                                                const std::string& parameter, std::span<const double> values,
                                                const LocateOptions& options = {});

}  // namespace costate
