#include <costate/shooting/focal.hpp>

#include <cmath>

namespace costate {

namespace {

/// The family moved on to t.
Front advanced(Flow& flow, const Front& from, double t, const Eigen::VectorXd& p, const Eigen::MatrixXd& parameter_directions) {
  const FlowEnd& end = flow.run(from.t, t, from.state, p, {from.state_directions, parameter_directions});
  return {t,
          end.state,
          from.quadrature + end.quadrature,
          end.state_directions,
          from.quadrature_directions + end.quadrature_directions,
          end.state_rate,
          end.quadrature_rate};
}

}  // namespace

std::vector<Front> focal_points(Flow& flow, const Front& start, const std::vector<double>& nodes, const Eigen::VectorXd& p,
                                const Eigen::MatrixXd& parameter_directions, const FrontDeterminant& determinant,
                                const FocalOptions& options) {
  std::vector<Front> found;
  Front last = start, significant = start;
  double sign = 0.0;
  for (const double node : nodes) {
    last = advanced(flow, last, node, p, parameter_directions);
    const double value = determinant(last);
    if (std::abs(value) <= options.noise) continue;
    if (sign * value < 0.0) {
      // Bisection from the last front whose sign is known.
      Front low = significant;
      double high = node;
      const double width = std::abs(high - low.t) * options.tolerance;
      while (std::abs(high - low.t) > width) {
        const double middle = 0.5 * (low.t + high);
        if (middle == low.t || middle == high) break;
        Front between = advanced(flow, low, middle, p, parameter_directions);
        if (sign * determinant(between) < 0.0) {
          high = middle;
        } else {
          low = std::move(between);
        }
      }
      found.push_back(std::move(low));
    }
    sign = value < 0.0 ? -1.0 : 1.0;
    significant = last;
  }
  return found;
}

}  // namespace costate
