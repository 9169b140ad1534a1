/// \file
/// Following a solution in one parameter: through folds, and through changes of its arc structure.
///
/// A branch is a curve of solutions u = (y, p) of R(y; p) = 0, followed by its arclength in scaled unknowns (Keller, Numerical
/// solution of bifurcation and nonlinear eigenvalue problems, 1977; Allgower & Georg, Introduction to Numerical Continuation
/// Methods, 2003, §§2, 6). The tangent is the null vector of (R_y, R_p), whose columns come from sensitivities; a fold is a point
/// where its component in p vanishes, and no obstacle. Where a guard of the problem (see Guard) vanishes the structure is wrong
/// beyond: the place is solved for, the model says what the structure is there, and the branch goes on with it.
#pragma once

#include <costate/shooting/shooting.hpp>
#include <costate/shooting/solution.hpp>

#include <functional>
#include <optional>

namespace costate {

/// A result along a branch, and its derivative with respect to the parameter: d/dp = ∂/∂p + ∂/∂y dy/dp.
struct BranchReport {
  std::string name;
  std::string unit;
  double value = 0.0;
  double derivative = 0.0;  ///< infinite at a fold
};

struct BranchPoint {
  double parameter = 0.0;              ///< p
  Eigen::VectorXd y;                   ///< unknowns of the stretch's problem
  Eigen::VectorXd tangent;             ///< du/ds, unit length in scaled unknowns; p comes last
  std::vector<BranchReport> unknowns;  ///< y with dy/dp, named
  std::vector<BranchReport> reports;   ///< final time, switching times, …
  std::size_t stretch = 0;             ///< the part of the branch it belongs to
  bool requested = false;              ///< the parameter has a value that was asked for
  int iterations = 0;                  ///< of Newton's method
};

/// A part of a branch with one arc structure.
struct Stretch {
  std::shared_ptr<const Problem> problem;
  std::vector<double> parameters;  ///< of the problem; the followed one varies
  std::size_t place = 0;           ///< of the followed parameter
};

struct BranchEvent {
  EventKind kind = EventKind::fold;
  EventKind announced =
      EventKind::fold;  ///< what the guard that vanishes stands for; `kind` is limit if no structure follows
  std::string name;     ///< what vanishes there
  BranchPoint point;
  std::string before, after;  ///< names of the structures on both sides; `after` is empty where the branch ends
  double error_bound =
      0.0;  ///< of its parameter: what locating it again with integrations a hundred times tighter has changed
  std::size_t position = 0;  ///< points of the branch before it
};

struct Branch {
  std::vector<Stretch> stretches;
  std::vector<BranchPoint> points;  ///< in order of the arclength, the start first
  std::vector<BranchEvent> events;
  bool reached = false;    ///< the wanted end was reached
  bool exhausted = false;  ///< it was given up because a budget of the options was spent
  std::string message;     ///< why it ended early
  Cost cost;
  long event_iterations = 0;  ///< of Newton's method, those spent on locating events and entering structures
};

/// A structure to go on with, after a guard has vanished.
struct Successor {
  std::shared_ptr<const Problem> problem;
  Eigen::VectorXd y;    ///< near its solution at which the guard `opening` has the value `size`
  std::string opening;  ///< the guard of the new problem that vanishes at the event and is positive beyond
  double size = 0.0;    ///< value of that guard at the first point of the new stretch
};

/// Where a structure ends: handed to the model.
struct Junction {
  const Problem& problem;
  const std::vector<double>& parameters;
  const Eigen::VectorXd& y;
  const Shot& shot;                       ///< arcs and guards there
  const std::vector<std::size_t>& zeros;  ///< places of the guards that vanish, the first to do so first
};

/// What the structure is beyond a junction: candidates, the likeliest first; none if the model knows no solution there.
using Restructure = std::function<std::vector<Successor>(const Junction& junction)>;

struct TraceOptions {
  double tolerance = 1e-11;        ///< of the integrations; Newton's corrections end at 100 times that
  std::vector<double> landings{};  ///< values of the parameter to land on exactly
  double first_step = 0.05;        ///< arclength, in units of the scaled unknowns and of |to − from|
  double largest_step =
      0.1;  ///< in the parameter, by |to − from|; the arclength is bounded by curvature and convergence alone
  double smallest_step = 1e-7;
  bool through_folds = true;  ///< else the branch ends at the first fold
  int max_points = 2000;
  int max_events = 50;
  int max_iterations = 8;                ///< of Newton's method at one point
  long max_steps = 4000;                 ///< of the integrator, per arc
  long max_integration_steps = 2000000;  ///< of the whole branch
  Method method = Method::adams;
};

/// Follows the solution near y at the parameters of the shooting until the named parameter has the value `to`, which is landed on
/// exactly. A branch that comes back to the parameter it started from, beyond a fold, ends there. Failure to go on is a Branch
/// that has not `reached`, with what was found.
/// \throws BadInput for an unknown parameter, a start of the wrong size, values that are not finite, or `to` equal to the start.
[[nodiscard]] Branch trace(std::shared_ptr<const Problem> problem, const std::vector<double>& parameters,
                           const Eigen::VectorXd& y, const std::string& parameter, double to,
                           const TraceOptions& options = {}, const Restructure& restructure = {});

/// Goes on from a point of a branch, in the direction of its tangent (or against it), whether that leads to `to` or not: a branch that
/// comes back to where it started ends there.
[[nodiscard]] Branch restart(const Branch& branch, std::size_t point, double to, const TraceOptions& options = {},
                             const Restructure& restructure = {}, bool backward = false);

/// Derivatives of the reports with respect to a named parameter at a solution y of the shooting's problem at its present
/// parameters: d/dp = ∂/∂p − ∂/∂y R_y⁻¹ R_p, exact, from sensitivities. \throws BadInput for an unknown parameter, LeftDomain if the
/// problem cannot be evaluated there.
[[nodiscard]] std::vector<BranchReport> derivatives(Shooting& shooting, const Eigen::VectorXd& y,
                                                    const std::string& parameter);

/// Names of the arcs of a problem's structure, joined: "saturated-free-saturated".
[[nodiscard]] std::string structure_name(const Problem& problem);

}  // namespace costate
