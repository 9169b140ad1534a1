/// \file
/// What became of a scene, whatever the model.
#pragma once

#include <costate/shooting/solution.hpp>

#include <optional>
#include <string>
#include <vector>

namespace costate::tools {

/// A named number of a scene or of what limits it; none where it was left out or is not known.
struct SceneValue {
  std::string name;
  std::string unit;
  std::optional<double> value;
};

/// Rows of numbers under named columns, in order of time; the first column is the time, in s.
struct Table {
  std::vector<Column> columns;
  std::vector<std::vector<double>> rows;
};

/// A scene whose solution is known in closed form: nothing was integrated.
struct ClosedForm {
  std::string name;  ///< "cycloid"
  std::vector<Quantity> quantities;  ///< as the reports of a Solution, final_time among them
  Table trajectory;
  std::string note = "in closed form: nothing was integrated";  ///< how it was found, for people
};

/// What became of a scene. If solved, exactly one of `solution` (solved) and `closed_form` holds the answer.
struct Outcome {
  enum class Status { solved, infeasible, failed };

  Status status = Status::failed;
  std::string message;  ///< why not solved, or empty
  Solution solution;
  std::optional<ClosedForm> closed_form;
  std::vector<SceneValue> limits;  ///< thresholds of the scene, such as the friction above which it has no solution
  std::vector<Solution> other_extremals;  ///< further roots of the scene that satisfy the first-order conditions, fastest first
  Cost cost;                              ///< of everything done

  [[nodiscard]] bool solved() const { return status == Status::solved; }
  /// All that was computed: reports of the solution, or quantities of the closed form.
  [[nodiscard]] const std::vector<Quantity>& quantities() const {
    return closed_form ? closed_form->quantities : solution.reports;
  }
  /// One of them by name. \throws BadInput naming what there is.
  [[nodiscard]] const Quantity& operator[](const std::string& name) const { return find({&quantities()}, name); }
};

/// Where a branch starts: a shooting problem and its unknowns at a solution.
struct BranchStart {
  std::shared_ptr<const Problem> problem;
  std::vector<double> parameters;
  Eigen::VectorXd y;
};

}  // namespace costate::tools
