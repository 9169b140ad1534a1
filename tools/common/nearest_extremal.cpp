/// Which extremal of a scene continues a branch.
#include "branch_run.hpp"

#include <algorithm>
#include <cmath>

namespace costate::tools {

namespace {

/// How far an extremal is from what a point of the branch leads to expect at another value of the parameter: the largest difference of the
/// final time and the costates, which are continuous where arcs come and go, by what may be expected of a straight line.
double mismatch(const Solution& extremal, const VariedPoint& point, double value) {
  double worst = 0.0;
  for (const BranchReport& report : point.derivatives) {
    if (report.name != "final_time" && !report.name.starts_with("lambda")) continue;
    for (const Quantity& found : extremal.reports) {
      if (found.name != report.name) continue;
      const double change = report.derivative * (value - point.parameter);
      const double admitted = 0.5 * std::abs(change) + 1e-3 * std::abs(report.value) + 1e-9;
      worst = std::max(worst, std::abs(found.value - report.value - change) / admitted);
    }
  }
  return worst;
}

}  // namespace

const Solution* nearest_extremal(const Outcome& outcome, const VariedPoint& point, double value) {
  if (outcome.closed_form) return nullptr;
  const Solution* nearest = nullptr;
  double least = 2.0;  // near a fold a straight line is a poor guide
  const auto consider = [&](const Solution& extremal) {
    const double far = mismatch(extremal, point, value);
    if (far > least) return;
    least = far;
    nearest = &extremal;
  };
  if (outcome.solved()) consider(outcome.solution);
  for (const Solution& other : outcome.other_extremals) consider(other);
  return nearest;
}

}  // namespace costate::tools
