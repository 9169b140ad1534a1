/// \file
/// The statement of a shooting problem: named unknowns, named rows, and the function that ties them.
#pragma once

#include <costate/shot.hpp>

#include <limits>

namespace costate {

/// An unknown of the shooting problem, in the units it is solved in.
struct Unknown {
  std::string name;
  double scale = 1.0;                                        ///< a typical magnitude
  double lower = -std::numeric_limits<double>::infinity();  ///< a root with a value at or beyond a limit is no solution
  double upper = std::numeric_limits<double>::infinity();
  double guess = 0.0;  ///< where a solve starts that is given no other start
};

/// One equation of the shooting problem, R = 0.
struct Row {
  std::string name;
  double scale = 1.0;  ///< a typical magnitude of the terms that cancel
};

/// A scene parameter: what a solution can be continued in.
struct Parameter {
  std::string name;
  std::string unit;
  double value = 0.0;
};

/// A column of the trajectory table.
struct Column {
  std::string name;
  std::string unit;
};

/// A condition along an arc, to be met at every point.
struct PathCheck {
  enum class Kind {
    nonnegative,  ///< value ≥ 0: feasibility of a constraint, sign of a multiplier or of a switching function
    zero,         ///< value = 0: an invariant, such as H
  };
  std::string name;
  Kind kind = Kind::zero;
  double value = 0.0;
};

/// A point of an integrated arc.
struct ArcPoint {
  const ArcRecord* record;
  double t;  ///< the problem's time, 0 at the start of the first arc
  Eigen::VectorXd state, quadrature;
  double own;  ///< the arc's own variable of integration, see ArcStart
};

/// Where a solve can begin: the unknowns, and the states along the arcs.
struct Start {
  Eigen::VectorXd unknowns;
  /// z of an arc at a fraction 0 … 1 of the way from its t0 to its t1; nothing where it is not known.
  std::function<std::optional<Eigen::VectorXd>(int arc, double fraction)> state;
};

/// A shooting problem. Implementations hold the fields of their arcs; evaluation never changes them.
class Problem {
 public:
  Problem() = default;
  Problem(const Problem&) = delete;
  Problem& operator=(const Problem&) = delete;
  virtual ~Problem() = default;

  [[nodiscard]] const std::vector<Unknown>& unknowns() const { return unknowns_; }
  [[nodiscard]] const std::vector<Row>& rows() const { return rows_; }
  [[nodiscard]] const std::vector<Parameter>& parameters() const { return parameters_; }
  /// Names of the kinds of the arcs, in order of time.
  [[nodiscard]] const std::vector<std::string>& structure() const { return structure_; }

  /// Place of a named unknown. \throws BadInput if there is none of that name.
  [[nodiscard]] Eigen::Index place_of(const std::string& unknown) const;

  /// The guesses of the unknowns.
  [[nodiscard]] Eigen::VectorXd start() const;

  /// A guess of an arc's integrated state, n values, at a fraction 0 … 1 of the way from its t0 to its t1. With it a solve can put
  /// nodes of multiple shooting on an arc before it can integrate it. Nothing: the arc is integrated from the unknowns.
  [[nodiscard]] virtual std::optional<Eigen::VectorXd> state_guess(int /*arc*/, double /*fraction*/) const { return {}; }

  /// A better start, found by some method of the problem's own that needs no guess; nothing if there is none or it fails. Asked for
  /// where the guesses do not lead to a solution.
  [[nodiscard]] virtual std::optional<Start> search_start(const std::vector<double>& /*parameters*/) const { return {}; }

  /// The shooting function: reads unknowns and parameters, integrates arcs, sets every row, reports results.
  virtual void shoot(Shot& shot) const = 0;

  /// Columns of the trajectory, and their values at a point of an arc. `parameters` are those of the solve.
  [[nodiscard]] virtual std::vector<Column> columns() const = 0;
  [[nodiscard]] virtual std::vector<double> observe(const ArcPoint& point, const std::vector<double>& parameters) const = 0;
  /// What must hold at a point of an arc besides the rows.
  [[nodiscard]] virtual std::vector<PathCheck> check(const ArcPoint& point, const std::vector<double>& parameters) const = 0;

 protected:
  std::vector<Unknown> unknowns_;
  std::vector<Row> rows_;
  std::vector<Parameter> parameters_;
  std::vector<std::string> structure_;
};

}  // namespace costate
