/// \file
/// Focal points of an extremal.
///
/// The extremals that leave a terminal manifold backward form a family with d parameters; with the position along each it fills the
/// space of the states, which has d + 1 dimensions. Where the determinant of that map vanishes neighbours of the extremal meet it:
/// beyond such a focal point, seen from the manifold, it is no local minimum (Bryson & Ho, Applied Optimal Control, 1975, §6.3;
/// Agrachev & Sachkov, Control Theory from the Geometric Viewpoint, 2004, §21). The same with a family that leaves a point finds conjugate
/// points.
#pragma once

#include <costate/flow.hpp>

#include <functional>
#include <vector>

namespace costate {

/// The family at one value t of the variable of integration: the extremal itself, z and w, and its derivatives with respect to
/// the parameters of the family at fixed t (columns), and to t.
struct Front {
  double t = 0.0;
  Eigen::VectorXd state, quadrature;                        ///< z (n), w (k)
  Eigen::MatrixXd state_directions, quadrature_directions;  ///< n × d, k × d
  Eigen::VectorXd state_rate, quadrature_rate;              ///< z', w'
};

/// The determinant of the derivatives of the states of the problem with respect to the parameters of the family and t, up to a positive
/// factor. Normalised, by the product of the norms of its columns, to at most 1: values below `FocalOptions::noise` count as 0.
using FrontDeterminant = std::function<double(const Front&)>;

struct FocalOptions {
  double noise = 1e-9;       ///< of the normalised determinant
  double tolerance = 1e-11;  ///< of the place of a focal point, relative to the step it lies in
};

/// The fronts at which the determinant changes its sign, in the order met. The family starts as `start`, on the manifold, where the
/// determinant vanishes; `nodes` are the points at which it is looked at, in order away from there, close enough together
/// for the flow not to turn between them; `parameter_directions` (m × d) says how the constants p move. The extremal is integrated
/// from node to node with its derivatives, which are exact.
/// \throws LeftDomain if it cannot be.
[[nodiscard]] std::vector<Front> focal_points(Flow& flow, const Front& start, const std::vector<double>& nodes,
                                              const Eigen::VectorXd& p, const Eigen::MatrixXd& parameter_directions,
                                              const FrontDeterminant& determinant, const FocalOptions& options = {});

}  // namespace costate
