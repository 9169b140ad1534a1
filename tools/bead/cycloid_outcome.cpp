#include "cycloid_outcome.hpp"

#include <costate/models/cycloid.hpp>

#include <cmath>
#include <fmt/format.h>
#include <limits>

namespace costate::bead {

tools::Outcome cycloid_outcome(double a, double b, double speed, double gravity) {
  tools::Outcome outcome;
  const double height = speed * speed / (2.0 * gravity);
  outcome.limits = {{"y_max", "m", height}};
  const std::optional<Cycloid> found = cycloid(a, b, speed, gravity);
  if (!found) {
    outcome.status = tools::Outcome::Status::infeasible;
    outcome.message = fmt::format("y = {:g} m is out of reach: with speed = {:g} m/s the bead cannot rise to y_max = {:.12g} m", b,
                                  speed, height);
    return outcome;
  }
  const double start_lambda_v = found->at(0.0).lambda_v;
  const double lambda = std::hypot(found->lambda_x, found->lambda_y);
  // Tens of units in the last place, of the size of the terms each number is a sum of; λv inherits the error of a slope times
  // |λ|/(gλx).
  const auto quantity = [](const char* name, const char* unit, double value, double size) {
    return Quantity{name, unit, value, 32.0 * std::numeric_limits<double>::epsilon() * size};
  };
  tools::ClosedForm form{"cycloid",
                         {quantity("final_time", "s", found->final_time, found->final_time),
                          quantity("lambda_x", "s/m", found->lambda_x, lambda),
                          quantity("lambda_y", "s/m", found->lambda_y, lambda),
                          quantity("lambda_v0", "s^2/m", start_lambda_v, lambda / (gravity * found->lambda_x)),
                          quantity("theta1", "rad", found->theta1(), 1.0),
                          quantity("theta2", "rad", found->theta2(), 1.0)},
                         {{{"t", "s"}, {"x", "m"}, {"y", "m"}, {"v", "m/s"}, {"theta", "rad"}, {"lambda_x", "s/m"},
                           {"lambda_y", "s/m"}, {"lambda_v", "s^2/m"}},
                          {}}};
  constexpr int cells = 200;
  for (int i = 0; i <= cells; ++i) {
    const double t = found->final_time * i / cells;
    const Cycloid::Point p = found->at(t);
    form.trajectory.rows.push_back({t, p.x, p.y, p.v, p.theta, found->lambda_x, found->lambda_y, p.lambda_v});
  }
  outcome.closed_form = std::move(form);
  outcome.status = tools::Outcome::Status::solved;
  return outcome;
}

}  // namespace costate::bead
