#include "opinions.hpp"

#include <cmath>
#include <limits>

namespace costate {

Opinions::Opinions(const Shooting& shooting, const Staircase& jacobian, const Eigen::VectorXd& correction,
                   const Eigen::VectorXd& second_residual, double margin)
    : jacobian_(jacobian),
      correction_(correction),
      row_scales_(shooting.row_scales()),
      disagreement_(row_scales_.size()),
      margin_(margin) {
  const Eigen::VectorXd scaled = second_residual.cwiseQuotient(row_scales_).cwiseAbs();
  Eigen::Index first = 0;
  const auto spread = [&](Eigen::Index count) {
    if (count > 0) disagreement_.segment(first, count).setConstant(scaled.segment(first, count).maxCoeff());
    first += count;
  };
  spread(shooting.border());
  for (const int size : shooting.node_sizes()) spread(size);
  disagreement_ = disagreement_.cwiseProduct(row_scales_);
}

Quantity Opinions::quantity(const std::string& name, const std::string& unit, const Eigen::VectorXd& gradient, double loose,
                            double tight, double at_corrected) const {
  constexpr double rounding = 8.0 * std::numeric_limits<double>::epsilon();
  const double moved = gradient.dot(correction_);
  const double value = tight - moved;
  const Eigen::VectorXd weights = jacobian_.solve_transposed(gradient).cwiseAbs();
  return {name, unit, value,
          std::abs(tight - loose) + std::abs(moved) +
              margin_ * (std::abs(at_corrected - value) + weights.dot(disagreement_)) +
              rounding * (weights.dot(row_scales_) + std::abs(value))};
}

}  // namespace costate
