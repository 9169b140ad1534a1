#include <costate/models/tilted_cycloid.hpp>

#include <cmath>

namespace costate {

double TiltedCycloid::slope(double theta) const { return mirrored ? tilt + std::numbers::pi - theta : tilt + theta; }

double TiltedCycloid::lambda_x() const {
  const double along = cycloid.lambda_x * (mirrored ? -1.0 : 1.0);
  return along * std::cos(tilt) - cycloid.lambda_y * std::sin(tilt);
}

double TiltedCycloid::lambda_y() const {
  const double along = cycloid.lambda_x * (mirrored ? -1.0 : 1.0);
  return along * std::sin(tilt) + cycloid.lambda_y * std::cos(tilt);
}

Cycloid::Point TiltedCycloid::at(double t) const {
  Cycloid::Point p = cycloid.at(t);
  const double along = mirrored ? -p.x : p.x, up = p.y;
  p.x = along * std::cos(tilt) - up * std::sin(tilt);
  p.y = along * std::sin(tilt) + up * std::cos(tilt);
  p.theta = slope(p.theta);
  return p;
}

std::optional<TiltedCycloid> tilted_cycloid(double x, double y, double speed, double pull_x, double pull_y) {
  const double strength = std::hypot(pull_x, pull_y);
  const double up_x = -pull_x / strength, up_y = -pull_y / strength;
  // The frame's first axis is "up" turned by −90°.
  const double along = x * up_y - y * up_x, up = x * up_x + y * up_y;
  if (along == 0.0) return std::nullopt;
  const std::optional<Cycloid> arc = cycloid(std::abs(along), up, speed, strength);
  if (!arc) return std::nullopt;
  return TiltedCycloid{*arc, std::atan2(-up_x, up_y), along < 0.0};
}

}  // namespace costate
