/// \file
/// Following a solution along a straight path of parameters.
#pragma once

#include <costate/shooting/shooting.hpp>

#include <functional>

namespace costate {

struct FollowOptions {
  double tolerance = 1e-8;      ///< of the integration and, times ten, of the residual at each point
  double first_step = 0.25;     ///< as a fraction of the path
  double smallest_step = 1e-7;  ///< the path ends where a shorter step would be needed
  int max_points = 2000;
  long max_steps = 4000;                ///< of the integrator, per arc
  long max_integration_steps = 200000;  ///< of the whole path
  int max_iterations = 8;       ///< of Newton's method at one point
  Method method = Method::adams;
};

/// Where a path has led.
struct Followed {
  bool reached = false;       ///< the target was reached
  bool stopped = false;       ///< the monitor stopped it
  double fraction = 0.0;      ///< of the path, at the last accepted point
  Eigen::VectorXd y;          ///< unknowns there
  std::vector<double> parameters;
  int points = 0;
  long newton_iterations = 0;
  std::string message{};      ///< why it ended early
};

/// Called at every accepted point; returning true stops the path there.
using Monitor = std::function<bool(const Eigen::VectorXd& y, const std::vector<double>& parameters)>;

/// Follows R(y; p) = 0 from the solution near y at the shooting's present parameters to `target` along the straight line between,
/// by tangent prediction dy/ds = −R_y⁻¹ R_p dp/ds (exact, from sensitivities) and Newton correction. The step doubles when the
/// correction is easy and halves when it fails. Leaves the shooting at the parameters reached.
/// \throws BadInput for a start or target of the wrong size or with a value that is not finite.
[[nodiscard]] Followed follow(Shooting& shooting, const Eigen::VectorXd& y, const std::vector<double>& target,
                              const FollowOptions& options = {}, const Monitor& monitor = {});

}  // namespace costate
