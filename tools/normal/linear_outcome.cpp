#include "linear_outcome.hpp"

#include <costate/models/tilted_cycloid.hpp>

#include <cmath>
#include <fmt/format.h>
#include <functional>
#include <limits>

namespace costate::normal_friction {

namespace {

/// A motion in closed form.
struct Motion {
  const char* name;
  double final_time, end_speed, theta1, theta2;
  std::function<Cycloid::Point(double)> at;
};

/// Along the field: v' is constant, and λv = (t_f − t)/v_f.
Motion straight(const Scene& scene, double end_speed) {
  const double length = std::hypot(scene.x, scene.y), theta = std::atan2(scene.y, scene.x);
  const double final_time = 2.0 * length / (scene.speed + end_speed);
  const double acceleration = (end_speed - scene.speed) / final_time;
  const auto at = [=, start_speed = scene.speed](double t) {
    const double way = t * (start_speed + 0.5 * acceleration * t);
    return Cycloid::Point{way * std::cos(theta), way * std::sin(theta), start_speed + acceleration * t, theta,
                          (final_time - t) / end_speed};
  };
  return {"straight", final_time, end_speed, theta, theta, at};
}

}  // namespace

tools::Outcome linear_outcome(const Scene& scene) {
  const Push<double> pull = push_of(scene);
  const double start_square = scene.speed * scene.speed, gained = 2.0 * (pull.x * scene.x + pull.y * scene.y);
  const double across = (pull.x * scene.y - pull.y * scene.x) / std::hypot(pull.x, pull.y);
  const double end_speed = std::sqrt(start_square - 2.0 * scene.gravity * (scene.y + scene.mu * scene.x));
  Motion motion = straight(scene, end_speed);
  tools::Outcome outcome;
  // What v_f and the place across the field lose to cancellation.
  double lost = (start_square + std::abs(gained)) / (end_speed * end_speed);
  if (const auto found = tilted_cycloid(scene.x, scene.y, scene.speed, pull.x, pull.y)) {
    motion = {"cycloid", found->cycloid.final_time, end_speed, found->theta1(), found->theta2(),
              [arc = *found](double t) { return arc.at(t); }};
    lost += std::hypot(scene.x, scene.y) / std::abs(across);
  } else if (across != 0.0) {
    outcome.message = fmt::format("v_f = {:.3g} m/s is too small for double precision; try a lower y", end_speed);
    return outcome;
  }
  const double lambda = 1.0 / motion.end_speed, lambda_v = motion.at(0.0).lambda_v;
  const double lambda_x = lambda * std::cos(motion.theta2), lambda_y = lambda * std::sin(motion.theta2);
  const auto quantity = [&](const char* name, const char* unit, double value, double size) {
    return Quantity{name, unit, value, 16.0 * lost * std::numeric_limits<double>::epsilon() * size};
  };
  tools::ClosedForm form{motion.name,
                         {quantity("final_time", "s", motion.final_time, motion.final_time),
                          quantity("lambda_x", "s/m", lambda_x, lambda),
                          quantity("lambda_y", "s/m", lambda_y, lambda),
                          quantity("lambda_v0", "s^2/m", lambda_v, lambda_v),
                          quantity("theta1", "rad", motion.theta1, 1.0),
                          quantity("theta2", "rad", motion.theta2, 1.0),
                          quantity("v_f", "m/s", motion.end_speed, motion.end_speed)},
                         {{{"t", "s"}, {"x", "m"}, {"y", "m"}, {"v", "m/s"}, {"theta", "rad"}, {"lambda_x", "s/m"},
                           {"lambda_y", "s/m"}, {"lambda_v", "s^2/m"}, {"N", "m/s^2"}},
                          {}}};
  constexpr int cells = 200;
  for (int i = 0; i <= cells; ++i) {
    const double t = motion.final_time * i / cells;
    const Cycloid::Point p = motion.at(t);
    form.trajectory.rows.push_back(
        {t, p.x, p.y, p.v, p.theta, lambda_x, lambda_y, p.lambda_v, scene.gravity * std::cos(p.theta)});
  }
  outcome.closed_form = std::move(form);
  outcome.status = tools::Outcome::Status::solved;
  return outcome;
}

}  // namespace costate::normal_friction
