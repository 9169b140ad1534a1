/// \file
/// How well a root is known. Private to the shooting library.
#pragma once

#include "staircase.hpp"

#include <costate/shooting/shooting.hpp>
#include <costate/shooting/solution.hpp>

namespace costate {

/// What two tight integrations say of a root: the Jacobian J and the correction δ = J⁻¹R of the first at the root of the solve, and
/// the residual R₂ that the second still sees after it.
class Opinions {
 public:
  /// `margin`: error of the first opinion in units of the disagreement.
  Opinions(const Shooting& shooting, const Staircase& jacobian, const Eigen::VectorXd& correction,
           const Eigen::VectorXd& second_residual, double margin);

  /// A quantity q with gradient g, known from the solve's integration (loose), from the first tight one at the same point, and
  /// from the second at the corrected point. Its value is q − g·δ. Its bound adds what the tighter integration changed in q
  /// and through δ, the disagreement of the two opinions with its margin, in q itself and through the rows, and rounding.
  /// Through the rows each is counted in the worst direction, and as if all rows of the problem, and all components of a node,
  /// disagreed by as much as the worst of them: a quantity in which disagreements happen to cancel is no better known for it.
  [[nodiscard]] Quantity quantity(const std::string& name, const std::string& unit, const Eigen::VectorXd& gradient,
                                  double loose, double tight, double at_corrected) const;

 private:
  const Staircase& jacobian_;
  const Eigen::VectorXd& correction_;
  Eigen::VectorXd row_scales_;
  Eigen::VectorXd disagreement_;  ///< of the rows
  double margin_;
};

}  // namespace costate
