/// \file
/// Focal points of an extremal.
///
/// The extremals that leave a terminal manifold backward form a family with d parameters; with the position along each it
/// fills the space of the states, which has d + 1 dimensions. Where the determinant of that map vanishes neighbours of the
/// extremal meet it: beyond such a focal point, seen from the manifold, it is no local minimum (Bryson & Ho, Applied
/// Optimal Control, 1975, §6.3; Agrachev & Sachkov, Control Theory from the Geometric Viewpoint, 2004, §21). The same with
/// a family that leaves a point finds conjugate points.
#pragma once

#include <costate/flow.hpp>

#include <functional>
#include <vector>

namespace costate {

/// The family at one value t of the variable of integration: the extremal itself, z and w, and its derivatives with respect
/// to the parameters of the family at fixed t (columns), and to t.
struct Front {
  double t = 0.0;
  Eigen::VectorXd state, quadrature;                        ///< z (n), w (k)
  Eigen::MatrixXd state_directions, quadrature_directions;  ///< n × d, k × d
  Eigen::VectorXd state_rate, quadrature_rate;              ///< z', w'
};

/// The determinant of the derivatives of the states of the problem with respect to the parameters of the family and t, up
/// to a positive factor. Normalised, by the product of the norms of its columns, to at most 1: values below
/// `FocalOptions::noise` count as 0.
using FrontDeterminant = std::function<double(const Front&)>;

struct FocalOptions {
  double noise = 1e-7;       ///< of the normalised determinant
  double tolerance = 1e-11;  ///< of the place of a focal point, relative to the step it lies in
};

/// A leg of the extremal: integrated by one flow with constants p.
struct FocalLeg {
  Flow* flow;
  Eigen::VectorXd p;
  Eigen::MatrixXd parameter_directions;  ///< how the constants move with the parameters of the family (m × d)
  std::vector<double> nodes;             ///< where the determinant is looked at, in order, the end of the leg last
  FrontDeterminant determinant;
};

/// Looks for the fronts at which the determinant changes its sign, leg by leg away from the manifold.
class FocalScan {
 public:
  /// The family starts on the manifold, where the determinant vanishes.
  explicit FocalScan(Front start, const FocalOptions& options = {})
      : options_(options), front_(std::move(start)), significant_(front_) {}

  /// Integrates the extremal from node to node with its derivatives, which are exact. Nodes must be close enough together
  /// for the determinant not to change its sign twice between them. \throws LeftDomain if it cannot be integrated.
  void follow(const FocalLeg& leg);

  /// The front reached, and the same stated in another variable, in which the next leg goes on.
  [[nodiscard]] const Front& front() const { return front_; }
  void restate(Front front) { significant_ = front_ = std::move(front); }

  /// The fronts found, in the order met.
  [[nodiscard]] const std::vector<Front>& found() const { return found_; }

 private:
  FocalOptions options_;
  Front front_;
  Front significant_;  ///< the last at which the sign was known
  double sign_ = 0.0;
  std::vector<Front> found_;
};

}  // namespace costate
