/// What can be seen of a solution of the rolling disk: trajectory columns and path checks.
#include "disk_problem.hpp"

#include <algorithm>

namespace costate::disk {

std::vector<Column> DiskProblem::columns() const {
  return {{"x", "m"},
          {"y", "m"},
          {"phi", "rad"},
          {"V", "m/s"},
          {"Omega", "rad/s"},
          {"lambda_x", "s/m"},
          {"lambda_y", "s/m"},
          {"lambda_phi", "s/rad"},
          {"lambda_V", "s^2/m"},
          {"V_dot", "m/s^2"},
          {"friction", "1"},
          {"multiplier", "s^4/m^2"}};
}

std::vector<double> DiskProblem::observe(const ArcPoint& point, const std::vector<double>& p) const {
  const Scaled<double> scene([&](std::size_t i) { return p[i]; }, limited_);
  const Observed at = observed(point);
  const double L = scene.length, T = scene.time, c = scene.speed, side = scene.side;
  const double coefficient = std::hypot(at.acceleration, at.V * at.Omega) * c / (T * p[gravity_place]);
  // λ_V vanishes on a free arc; on a boundary arc, where V' = 0, it is not determined and is given as 0.
  const bool saturated = arcs_[static_cast<std::size_t>(point.record->arc)].kind == ArcKind::saturated;
  const double lambda_V = saturated && at.acceleration != 0.0 ? at.switching / at.acceleration : 0.0;
  const double multiplier = saturated && at.acceleration != 0.0 ? -lambda_V / (2.0 * at.acceleration) : 0.0;
  return {L * point.quadrature[0],
          side * L * point.quadrature[1],
          side * at.phi,
          c * at.V,
          side * at.Omega / T,
          point.record->constants[0] / c,
          side * point.record->constants[1] / c,
          side * T * at.lambda_phi,
          T / c * lambda_V,
          c / T * at.acceleration,
          coefficient,
          T * T / (c * c) * multiplier};
}

std::vector<PathCheck> DiskProblem::check(const ArcPoint& point, const std::vector<double>& p) const {
  const Scaled<double> scene([&](std::size_t i) { return p[i]; }, limited_);
  const Observed at = observed(point);
  const double used = std::hypot(at.acceleration, at.V * at.Omega);
  const std::vector<double>& constants = point.record->constants;
  const double integral = constants[2] + constants[0] * point.quadrature[1] - constants[1] * point.quadrature[0];
  std::vector<PathCheck> checks{
      {"lambda_phi - lambda_x y + lambda_y x - its start value", PathCheck::Kind::zero, at.lambda_phi - integral}};
  const ArcType& arc = arcs_[static_cast<std::size_t>(point.record->arc)];
  switch (arc.kind) {
    case ArcKind::free:
      checks.push_back({"Hamiltonian on a free arc", PathCheck::Kind::zero, at.hamiltonian});
      if (limited_) {
        checks.push_back({"friction left on a free arc", PathCheck::Kind::nonnegative, scene.friction - used});
      }
      break;
    case ArcKind::saturated:
      checks.push_back({"Hamiltonian on a saturated arc", PathCheck::Kind::zero, at.hamiltonian});
      checks.push_back({"switching function S on a saturated arc", PathCheck::Kind::nonnegative, at.switching});
      checks.push_back({"friction beyond its limit on a saturated arc", PathCheck::Kind::zero, used - scene.friction});
      // S = λ_V V' tells the sign of λ_V by that of V', and λ_V is finite.
      checks.push_back({"V' along the sign of a saturated arc", PathCheck::Kind::nonnegative, arc.sign * at.acceleration});
      break;
    case ArcKind::boundary:
      checks.push_back({"friction beyond its limit on a boundary arc", PathCheck::Kind::zero, used - scene.friction});
      checks.push_back({"switching function S on a boundary arc", PathCheck::Kind::zero, at.switching});
      checks.push_back({"V on the side of a boundary arc", PathCheck::Kind::nonnegative,
                        std::min(arc.sign * (2.0 * at.V * at.V - 1.0), arc.course * at.V)});
      checks.push_back({"multiplier of a boundary arc", PathCheck::Kind::nonnegative, -arc.sign * arc.course * at.slope});
      break;
  }
  return checks;
}

Observed DiskProblem::observed(const ArcPoint& point) const {
  const std::vector<double>& constants = point.record->constants;
  const double phi = point.state[0];
  const double A = constants[0] * std::cos(phi) + constants[1] * std::sin(phi);
  Observed at{phi, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
  switch (arcs_[static_cast<std::size_t>(point.record->arc)].kind) {
    case ArcKind::free: {
      const auto [V, Omega] = FastestRolling{}.control<double>({0.0, 0.0, phi}, {constants[0], constants[1], point.state[1]},
                                                               {});
      at.V = V;
      at.Omega = Omega;
      at.acceleration = (constants[1] * std::cos(phi) - constants[0] * std::sin(phi)) * Omega;
      at.lambda_phi = point.state[1];
      break;
    }
    case ArcKind::saturated: {
      const double V1 = point.record->parameter[2], scale = point.record->parameter[3];
      at.V = V1 + scale * point.state[1];
      at.Omega = point.record->parameter[4] * std::sqrt(1.0 - at.V * at.V);
      at.acceleration = point.state[2];
      at.lambda_phi = point.state[3];
      const Eigen::VectorXd& z1 = point.record->state;
      SwitchingStart<double> from(constants[0] * std::cos(z1[0]) + constants[1] * std::sin(z1[0]), V1,
                                        point.record->parameter[4] * std::sqrt(1.0 - V1 * V1), z1[3]);
      // As every junction has it by construction: where the arc does not fit the one it starts from, H shows it.
      from.switching = 0.0;
      at.hamiltonian = from.at(point.state[1], point.quadrature[2], point.quadrature[3], scale);
      break;
    }
    case ArcKind::boundary:
      at.V = point.record->parameter[0];
      at.Omega = point.record->parameter[1] * std::sqrt(1.0 - at.V * at.V);
      // λφ − λx y + λy x is a constant of the motion; at the start x = y = 0.
      at.lambda_phi = constants[2] + constants[0] * point.quadrature[1] - constants[1] * point.quadrature[0];
      break;
  }
  at.switching = 1.0 - A * at.V - at.lambda_phi * at.Omega;
  at.slope = A - at.lambda_phi * at.V / at.Omega;
  at.hamiltonian -= at.switching;
  return at;
}

}  // namespace costate::disk
