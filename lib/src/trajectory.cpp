#include <costate/trajectory.hpp>

#include <algorithm>

namespace costate {

Eigen::VectorXd Trajectory::at(double t) const {
  const bool forward = end_time() >= start_time_;
  t = std::clamp(t, std::min(start_time_, end_time()), std::max(start_time_, end_time()));
  if (pieces_.empty() || t == start_time_) return start_;
  // The first piece whose far end is not before t holds it.
  const auto piece = std::lower_bound(pieces_.begin(), pieces_.end(), t, [forward](const Piece& p, double wanted) {
    return forward ? p.node < wanted : p.node > wanted;
  });
  const double dt = t - piece->node;
  Eigen::VectorXd value = piece->taylor.rightCols(1);
  for (Eigen::Index j = piece->taylor.cols() - 2; j >= 0; --j) {
    value *= dt;
    value += piece->taylor.col(j);
  }
  return value;
}

}  // namespace costate
