/// \file
/// Newton's linear systems of a shooting. Private to the shooting library.
#pragma once

#include "staircase.hpp"

#include <costate/shooting/shooting.hpp>

#include <array>

namespace costate {

/// The Jacobian of a shot, decomposed: small ones by elimination with row interchanges and without any allocation, those of more than
/// eight unknowns or of arcs that are cut as a Staircase.
class Factors {
 public:
  /// \pre scales are those of the shooting
  void decompose(const Shooting& shooting, const Shot& shot, const Eigen::VectorXd& row_scales,
                 const Eigen::VectorXd& unknown_scales);
  /// A small Jacobian from its n² entries, row by row. \pre n ≤ 8
  void decompose(const Eigen::VectorXd& entries, const Eigen::VectorXd& row_scales, const Eigen::VectorXd& unknown_scales);
  [[nodiscard]] static bool small(const Shooting& shooting) { return shooting.size() <= most && shooting.cuts().empty(); }
  [[nodiscard]] bool known() const { return size_ > 0 || large_; }
  /// x = −J⁻¹ r. Not finite if J is singular or itself not finite.
  void correction(const Eigen::VectorXd& r, Eigen::VectorXd& x) const;
  /// By how much unknowns move, in their scales, if every row is off by its scale: the norm ‖D_c⁻¹J⁻¹D_r‖∞, or of a large system what
  /// is seen of it where all rows are off alike.
  [[nodiscard]] double amplification() const;

 private:
  void eliminate(const Eigen::VectorXd& row_scales, const Eigen::VectorXd& unknown_scales);

  static constexpr Eigen::Index most = 8;

  Eigen::Index size_ = 0;  ///< 0: large
  std::array<double, most * most> lu_{};
  std::array<double, most> row_scales_{}, unknown_scales_{};
  std::array<Eigen::Index, most> pivot_{};
  std::optional<Staircase> large_;
  bool large_finite_ = true;  ///< is what was decomposed?
  Eigen::VectorXd large_row_scales_, large_unknown_scales_;
};

}  // namespace costate
