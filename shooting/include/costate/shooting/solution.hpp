/// \file
/// What a solve returns: a value, whether it succeeded or not.
#pragma once

#include <costate/problem.hpp>

#include <memory>

namespace costate {

/// A named result with a bound on its absolute error.
struct Quantity {
  std::string name;
  std::string unit;
  double value = 0.0;
  double error_bound = 0.0;
};

/// The first quantity of that name in the lists. \throws BadInput naming what there is.
[[nodiscard]] const Quantity& find(std::initializer_list<const std::vector<Quantity>*> lists, const std::string& name);

/// The worst value of one path condition over all arcs.
struct CheckResult {
  std::string name;
  PathCheck::Kind kind = PathCheck::Kind::zero;
  double worst = 0.0;      ///< smallest value (nonnegative) or largest magnitude (zero)
  double time = 0.0;       ///< where
  double tolerance = 0.0;  ///< admitted violation
  [[nodiscard]] bool holds() const;
};

/// What was verified about a solution after the solve.
struct Certificate {
  double largest_residual = 0.0;  ///< max |Rᵢ| / scale, from an integration tighter than the solve's
  std::string largest_row;        ///< its name
  double condition = 0.0;         ///< 2-norm condition number of the scaled Jacobian
  std::vector<CheckResult> checks;
  [[nodiscard]] bool holds() const;
};

struct Cost {
  double seconds = 0.0;  ///< CPU time of the thread
  long steps = 0;
  long rhs_evaluations = 0;
  long sensitivity_evaluations = 0;
  long newton_iterations = 0;

  /// What integrations have cost.
  void add(const Statistics& statistics) {
    steps += statistics.steps;
    rhs_evaluations += statistics.rhs_evaluations;
    sensitivity_evaluations += statistics.sensitivity_evaluations;
  }
  /// What other work has cost.
  void add(const Cost& other) {
    seconds += other.seconds;
    steps += other.steps;
    rhs_evaluations += other.rhs_evaluations;
    sensitivity_evaluations += other.sensitivity_evaluations;
    newton_iterations += other.newton_iterations;
  }
};

/// One integrated arc of a solution.
struct ArcTrace {
  ArcRecord record;
  double begin = 0.0, end = 0.0;  ///< time from the start of the first arc, in the unit of the reports; begin ≤ end
  double origin = 0.0;            ///< time of the first arc's start on the clock of the records
  Trajectory trajectory;

  /// From the trajectory's own variable to the time of the reports, and back. Where that variable is not the time, the way back
  /// is a search for the point at which the time quadrature, which is monotone, has the wanted value.
  [[nodiscard]] double time(double own) const;
  [[nodiscard]] double own(double time) const;
  /// The arc at a value of its own variable.
  [[nodiscard]] ArcPoint point(double own) const;
};

struct Solution {
  enum class Status {
    solved,
    failed,   ///< no root was found to the accuracy
    refused,  ///< a root was found, but it is no solution: an unknown is outside its domain, or a path check does not hold
  };

  Status status = Status::failed;
  std::string message;  ///< why not, and what to try; empty if solved
  std::shared_ptr<const Problem> problem;
  std::vector<double> parameters;
  Eigen::VectorXd y;                ///< unknowns, in the problem's order
  std::vector<Quantity> unknowns;   ///< the same, named
  std::vector<Quantity> reports;    ///< final time, switching times, …
  int starts = 1;                   ///< made; more than one if the first led to no solution
  int arrived = 0;                  ///< of these, led to a root, refused or not
  int nodes = 0;                    ///< of multiple shooting, at which arcs were cut; 0 is single shooting
  Certificate certificate;
  Cost cost;
  std::vector<ArcTrace> arcs;       ///< in order of time

  [[nodiscard]] bool solved() const { return status == Status::solved; }
  /// A report or unknown by name. \throws BadInput naming what there is.
  [[nodiscard]] const Quantity& operator[](const std::string& name) const;
  [[nodiscard]] double final_time() const;
  /// The problem's columns at time t ∈ [0, final_time()]. \throws BadInput outside.
  [[nodiscard]] std::vector<double> at(double t) const;
  /// The point of the arc that holds at time t; at a junction, of the arc that begins there.
  [[nodiscard]] ArcPoint point(double t) const;
};

}  // namespace costate
