/// Every model with every law of its own, held to the maximum principle.
#include "conformance.hpp"

#include <costate/models/coulomb.hpp>
#include <costate/models/curvature.hpp>
#include <costate/models/disk.hpp>
#include <costate/models/drag.hpp>
#include <costate/models/normal_friction.hpp>

namespace costate::test {
namespace {

/// The speeds of the disk and the direction of a bead lie on the unit circle.
constexpr auto circle = [](const auto&, const auto&) {
  std::vector<Vec<double, 2>> controls;
  for (const auto& angle : grid(-std::numbers::pi, std::numbers::pi)) controls.push_back({std::cos(angle[0]), std::sin(angle[0])});
  return controls;
};

/// V' within the friction limit.
std::vector<Vec<double, 1>> within_friction(const Vec<double, 4>& q, const Vec<double, 1>& p) {
  const double V2 = q[3] * q[3];
  const double most = std::sqrt(p[0] * p[0] - V2 * (1.0 - V2));
  return grid(-most, most);
}

/// Slopes between straight up and straight down: elsewhere the wire would pull the bead's friction along.
std::vector<Vec<double, 1>> slopes(const Vec<double, 3>&, const Vec<double, 2>&) {
  return grid(-std::numbers::pi / 2, std::numbers::pi / 2);
}

/// Turning rates at which the bead stays on its wire.
std::vector<Vec<double, 1>> on_the_wire(const Vec<double, 4>& q, const Vec<double, 3>& p) {
  return grid(-p[2] * std::cos(q[3]) / q[2], 20.0);
}

#define CONFORMS(name, ...) \
  TEST(Conformance, name) { conforms(Specimen __VA_ARGS__); }

CONFORMS(DiskFree, <disk::FreeRolling, disk::FastestRolling>{{0.0, 0.0, 0.3}, {0.5, 0.4, 0.6}, {}, 1.0, circle})
CONFORMS(DiskSaturated, <disk::LimitedRolling, disk::LimitingFriction>{{0.0, 0.0, 0.3, 0.6}, {0.5, 0.4, 0.6, 0.2}, {0.52}, 0.3, within_friction})
CONFORMS(Coulomb, <coulomb::SlidingBead, coulomb::FastestSlope>{{0.0, 0.0, 1.2}, {0.24, 0.06, 0.1}, {0.1, 9.81}, 0.2, slopes})
CONFORMS(NormalFriction, <normal_friction::Bead, normal_friction::BestSlope>{{0.0, 0.0, 2.0}, {0.21, 0.04, 0.11}, {0.3, -0.001, 9.8}, 0.5, angles})
CONFORMS(Drag, <drag::Bead, drag::FastestSlope>{{0.0, 0.0, 2.0}, {0.19, 0.25, 0.16}, {0.3, 0.004, 9.8}, 0.8, circle})
CONFORMS(CurvatureContact, <curvature::Bead, curvature::Contact>{{0.0, 0.0, 2.0, -1.0}, {0.262, 0.13, 0.132, 0.089}, {0.2, -0.001, 9.8}, 0.5, on_the_wire})
CONFORMS(CurvatureFlight, <curvature::Bead, curvature::Ballistic>{{0.0, 0.0, 2.0, -0.4}, {0.25, 0.1, 0.16, 0.0}, {0.2, -0.001, 9.8}, 0.07, on_the_wire})

}  // namespace
}  // namespace costate::test
