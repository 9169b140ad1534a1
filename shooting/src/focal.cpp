#include <costate/shooting/focal.hpp>

#include <algorithm>
#include <cmath>

namespace costate {

namespace {

/// The family moved on to t.
Front advanced(const FocalLeg& leg, const Front& from, double t) {
  const FlowEnd& end = leg.flow->run(from.t, t, from.state, leg.p, {from.state_directions, leg.parameter_directions});
  return {t,
          end.state,
          from.quadrature + end.quadrature,
          end.state_directions,
          from.quadrature_directions + end.quadrature_directions,
          end.state_rate,
          end.quadrature_rate};
}

/// Bisection between a front at which the determinant has the given sign and a t at which it has the other.
Front crossing(const FocalLeg& leg, Front low, double high, double sign, double tolerance) {
  // Arcs of some units in the last place of t are too short to integrate.
  const double width = std::max(std::abs(high - low.t) * tolerance, 1e-14 * std::abs(high));
  while (std::abs(high - low.t) > width) {
    const double middle = 0.5 * (low.t + high);
    Front between = advanced(leg, low, middle);
    if (sign * leg.determinant(between) < 0.0) {
      high = middle;
    } else {
      low = std::move(between);
    }
  }
  return low;
}

}  // namespace

void FocalScan::follow(const FocalLeg& leg) {
  for (const double node : leg.nodes) {
    front_ = advanced(leg, front_, node);
    const double value = leg.determinant(front_);
    if (std::abs(value) <= options_.noise) continue;
    if (sign_ * value < 0.0) found_.push_back(crossing(leg, significant_, node, sign_, options_.tolerance));
    sign_ = value < 0.0 ? -1.0 : 1.0;
    significant_ = front_;
  }
}

}  // namespace costate
