/// \file
/// Solving a shooting problem to a wanted accuracy.
#pragma once

#include <costate/shooting/shooting.hpp>
#include <costate/shooting/solution.hpp>

namespace costate {

/// Smallest and largest accuracy that may be asked for.
inline constexpr double finest_accuracy = 1e-12;
inline constexpr double coarsest_accuracy = 1e-3;

/// A path through problems from an easy one to the wanted one: a parameter of the problem goes from a value at which the start is good
/// to its own, in equal ratios if both have the same sign.
struct Homotopy {
  std::string parameter;
  double from = 0.0;
};

/// Seeded random starts. The k-th is drawn, within the domains of the unknowns, from a box of 2ⁿ times the radius, n being how often 2
/// divides k: half of the starts from the smallest box, a quarter from one twice as wide, and so on, so that a solution at any distance
/// is reached, at no more than twice the starts its own box would take for every halving. Boxes are by turns around the start that
/// was asked for and around the guesses that the problem states (around 0, where these are the start).
struct RandomStarts {
  unsigned seed = 1;               ///< the same seed gives the same starts on every machine
  int count = 300;                 ///< at most
  double radius = 1.0;             ///< of the smallest box, in scales of the unknowns
  long max_steps = 1000;           ///< of the integrator, per arc
  long max_total_steps = 3000000;  ///< after these no other start is made
};

struct SolveOptions {
  /// Wanted absolute error (relative above 1) of every unknown and report, within finest_accuracy … coarsest_accuracy.
  double accuracy = 1e-8;
  Method method = Method::adams;
  long max_steps = 20000;           ///< of the integrator, per arc or segment of one
  long max_total_steps = 4000000;  ///< of the integrator, in all: some ten seconds
  int max_iterations = 50;          ///< of Newton's method, per tolerance
  double max_step = 1.0;            ///< of Newton's method, in scaled unknowns
  bool line_search = true;
  std::optional<Homotopy> homotopy{};
  bool multiple = true;  ///< arcs may be cut for multiple shooting
  /// What to try where the start leads to no solution: backward differentiation, if arcs seem stiff; a start of the problem's own
  /// (Problem::search_start); then these. Unless set: none of all that where a start is given, which a caller may have others of; the
  /// defaults where none is.
  std::optional<RandomStarts> random{};
  /// What the message of a failed solve says to try.
  std::string advice = "a start closer to the solution, or continuation from a solved scene";
};

/// Solves R(y) = 0 from the guess `start`.
///
/// Arcs whose states the problem guesses are cut where a segment would magnify errors more than a thousandfold (multiple shooting with
/// nodes placed by the program); Newton's method is damped there, segments that cannot be integrated are cut further, and nodes the
/// solution does not need are dropped. All other arcs stay whole as long as the accuracy is reached.
///
/// Newton's method runs on a ladder of integration tolerances, loose first. The root is then evaluated by an integration
/// fifty times tighter (twenty, where it is as tight as can be), whose Newton correction δ = J⁻¹R is applied, and by a second one
/// at yet another tolerance that follows the states alone. The error bound is |δ|, plus what the two disagree by with a
/// margin, plus what rounding of the rows is worth: an estimate, not a proof. If the bound exceeds the accuracy the tolerance
/// is tightened and the solve goes on (at the tightest the root is corrected once more); if doubles cannot reach it, the status is
/// failed and the message gives the best bound. After that every unknown must lie in its domain and every path check must hold, else
/// the root is refused.
///
/// \throws BadInput for an accuracy out of range, a start of the wrong size, an unknown homotopy parameter, and for a problem that is ill posed: a
/// row that depends on no unknown, or an unknown that no row depends on. Failure to converge is a Solution, not a throw.
[[nodiscard]] Solution solve(std::shared_ptr<const Problem> problem, const Eigen::Ref<const Eigen::VectorXd>& start,
                             const SolveOptions& options = {});

/// The same from the guesses the problem states for its unknowns.
[[nodiscard]] Solution solve(std::shared_ptr<const Problem> problem, const SolveOptions& options = {});

/// The same on an existing Shooting, whose integrators and parameters are used. Its arcs are whole afterwards.
[[nodiscard]] Solution solve(Shooting& shooting, const Eigen::Ref<const Eigen::VectorXd>& start,
                             const SolveOptions& options = {});

/// CPU time of the calling thread, seconds.
[[nodiscard]] double thread_seconds();

}  // namespace costate
