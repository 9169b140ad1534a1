/// \file
/// Dense output: the integrator's own interpolating polynomials, one a step.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace costate {

/// z(t) and w(t) of one integrated arc, at any t between its ends.
class Trajectory {
 public:
  /// One step: column j of `taylor` holds the j-th derivative at `node`, divided by j!; rows are (z, w).
  struct Piece {
    double node;
    Eigen::MatrixXd taylor;
  };

  /// A trajectory that starts at t0 with (z, w) = start; pieces are appended in the direction of integration.
  Trajectory(double t0, Eigen::VectorXd start) : start_time_(t0), start_(std::move(start)) {}
  void append(Piece piece) { pieces_.push_back(std::move(piece)); }

  [[nodiscard]] double start_time() const { return start_time_; }
  [[nodiscard]] double end_time() const { return pieces_.empty() ? start_time_ : pieces_.back().node; }
  [[nodiscard]] const std::vector<Piece>& pieces() const { return pieces_; }

  /// (z, w) at t, to the accuracy of the integration. Times outside the arc are clamped to its ends.
  [[nodiscard]] Eigen::VectorXd at(double t) const;

 private:
  double start_time_;
  Eigen::VectorXd start_;
  std::vector<Piece> pieces_;
};

}  // namespace costate
