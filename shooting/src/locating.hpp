/// \file
/// What the searches of locate.hpp have in common. Private to the shooting library.
#pragma once

#include <costate/shooting/locate.hpp>

#include <algorithm>
#include <cmath>

namespace costate {

/// Of integrations at a tolerance.
inline FlowOptions flow_options(const LocateOptions& options, double tolerance) {
  return {.tolerance = {.relative = tolerance, .absolute = tolerance},
          .method = options.method,
          .max_steps = options.max_steps,
          .longest_step = options.longest_step};
}

/// R of a shot, into room that is there.
inline void read_residual(const Shooting& shooting, const Shot& shot, Eigen::VectorXd& r) {
  for (Eigen::Index i = 0; i < r.size(); ++i) r[i] = shooting.row(shot, i).value;
}

/// The largest |vⱼ| / max(scaleⱼ, |yⱼ|); not a number if one of them is none.
inline double scaled_length(const auto& v, const Eigen::VectorXd& scale, const Eigen::VectorXd& y) {
  double longest = 0.0;
  for (Eigen::Index i = 0; i < y.size(); ++i) {
    const double part = std::abs(v[i]) / std::max(scale[i], std::abs(y[i]));
    if (part > longest || std::isnan(part)) longest = part;  // what is not a number stays
  }
  return longest;
}

}  // namespace costate
