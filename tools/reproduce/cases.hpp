/// \file
/// What the papers computed, computed again.
#pragma once

#include <costate/shooting/solution.hpp>

#include <map>
#include <string>

namespace costate::reproduce {

/// A scene of a model, by the names of the tool's flags; and a curve, where it is not the optimum that is asked for.
struct Case {
  std::string model;
  std::map<std::string, double> scene;
  std::string curve;
  auto operator<=>(const Case&) const = default;
};

/// Quantities by name. A bead that stops on the way has no final_time.
using Computed = std::map<std::string, Quantity>;

/// Solves cases, each once. \throws std::runtime_error naming the case that has no solution, or a flag or model not known.
class Cases {
 public:
  explicit Cases(double accuracy) : accuracy_(accuracy) {}
  const Computed& operator()(const Case& wanted);

 private:
  [[nodiscard]] Computed solve(const Case& wanted) const;

  double accuracy_;
  std::map<Case, Computed> solved_;
};

}  // namespace costate::reproduce
