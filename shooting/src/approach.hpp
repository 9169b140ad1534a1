/// \file
/// From a start to the neighbourhood of a root. Private to the shooting library.
#pragma once

#include "mesh.hpp"

#include <costate/shooting/solve.hpp>

namespace costate {

/// Flow options of a solve at a tolerance.
[[nodiscard]] FlowOptions flow_options(const SolveOptions& options, double tolerance);

/// Newton's method by KINSOL at the shooting's tolerance; iterations are added to the cost.
NewtonResult kinsol(Shooting& shooting, Eigen::VectorXd& point, const SolveOptions& options, Cost& cost);

/// May the iterate be a root whose residual only drowns in the noise of the integration?
[[nodiscard]] bool near_root(Termination termination);

/// A brief attempt takes damped Newton steps alone, and ends where they do not lead near a root; a full one tries KINSOL's line search on
/// the residual too, which creeps where damped steps end, and tight tolerances.
/// One at a glance is brief, and given up after few integrations.
enum class Effort { glance, brief, full };

/// Cheap steps at a loose tolerance, while they are long.
class Approach {
 public:
  Approach(Shooting& shooting, const SolveOptions& options, Effort effort, double tolerance, Cost& cost)
      : shooting_(shooting), options_(options), effort_(effort), tolerance_(tolerance), cost_(cost) {}

  /// Moves the point, from the unknowns of the start, near a root. Where that fails, or the looseness itself is in the way (an
  /// unstable arc amplifies it), the point is the start again, and reason() says what happened, if that is worth saying.
  bool run(const Start& start, Eigen::VectorXd& point);
  [[nodiscard]] const std::string& reason() const { return reason_; }

  /// Drops the nodes that the solution at the point does not need, and adds those it needs.
  bool cut_by_growth(Eigen::VectorXd& point, const MeshOptions& mesh);

 private:
  bool from_start(const Start& start, Eigen::VectorXd& point);
  [[nodiscard]] bool knows_states(const Start& start) const;
  [[nodiscard]] bool stays_whole(const Start& start);
  bool cut_along(const Start& start, Eigen::VectorXd& point);
  bool whole(const Start& start, Eigen::VectorXd& point);
  bool globalise(Eigen::VectorXd& point, int rounds);
  bool follow_homotopy(const Start& start, Eigen::VectorXd& point);
  bool follow_step(Eigen::VectorXd& point, const std::vector<double>& target, const std::vector<double>& path);

  Shooting& shooting_;
  const SolveOptions& options_;
  Effort effort_;
  double tolerance_;
  Cost& cost_;
  std::string reason_;
};

}  // namespace costate
