#include "drag_scene.hpp"

#include <costate/shooting/focal.hpp>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace costate::drag {

namespace {

using Eigen::Index;

/// Values with derivatives with respect to the constants of the orbit, 0 and 1, and η, 2.
using Sensitive = Dual<double, 3>;

Sensitive end_of(const TurningOrbit<Sensitive>& orbit) { return orbit.variable(orbit.end_slope); }
Sensitive end_of(const PassingOrbit<Sensitive>& orbit) { return orbit.variable(orbit.end_speed); }
Sensitive end_of(const MonotoneOrbit<Sensitive>& orbit) { return orbit.map.variable(orbit.end_speed); }

/// η of the steps of the integration from the end of the path to its start, every one cut in two.
std::vector<double> nodes_backward(const Solution& solution) {
  std::vector<double> nodes;
  for (auto arc = solution.arcs.rbegin(); arc != solution.arcs.rend(); ++arc) {
    std::vector<double> steps{arc->record.t0};
    for (const Trajectory::Piece& piece : arc->trajectory.pieces()) {
      steps.push_back(0.5 * (steps.back() + piece.node));
      steps.push_back(piece.node);
    }
    if (arc->time(steps.front()) < arc->time(steps.back())) std::reverse(steps.begin(), steps.end());
    nodes.insert(nodes.end(), steps.begin(), steps.end());
  }
  nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
  // Some hundred are enough: the steps of a tight integration are far smaller than what the family does.
  constexpr std::size_t enough = 150;
  const std::size_t stride = nodes.size() / enough + 1;
  std::vector<double> thinned;
  for (std::size_t i = stride; i < nodes.size(); i += stride) thinned.push_back(nodes[i]);
  if (thinned.empty() || thinned.back() != nodes.back()) thinned.push_back(nodes.back());
  return thinned;
}

template <template <class> class Orbit>
std::vector<double> times(const Solution& solution) {
  const ArcRecord& record = solution.arcs.back().record;
  const Eigen::VectorXd& p = record.parameter;
  const OrbitArc<Orbit> arc{map_of(*solution.problem)};
  const Orbit<Sensitive> orbit = arc.orbit(
      Vec<Sensitive, 4>{Sensitive::variable(p[0], 0), Sensitive::variable(p[1], 1), Sensitive(p[2]), Sensitive(p[3])});
  const Sensitive end = end_of(orbit);
  const FieldOf<OrbitArc<Orbit>> field(arc);
  Flow flow(field, {.tolerance = {1e-11, 1e-11}});

  // At the end all orbits are at the same place, but not at the same η: at fixed η the place moves by minus the rate times ∂η_f.
  Front start;
  start.t = end.value;
  start.quadrature.setZero(3);
  start.state_directions.resize(0, 2);
  start.quadrature_rate.resize(3);
  if (!field.rates(end.value, start.state, p, start.state_rate, start.quadrature_rate)) return {};
  start.quadrature_directions = -start.quadrature_rate * Eigen::RowVector2d(end.gradient[0], end.gradient[1]);
  Eigen::MatrixXd parameter_directions = Eigen::MatrixXd::Zero(4, 2);
  parameter_directions.topRows(2).setIdentity();

  const auto determinant = [&](const Front& front) {
    const Sensitive v = orbit.at(Sensitive::variable(front.t, 2)).v;
    Eigen::Matrix3d derivative;
    derivative.topLeftCorner<2, 2>() = front.quadrature_directions.topRows(2);
    derivative.topRightCorner<2, 1>() = front.quadrature_rate.head(2);
    derivative.row(2) << v.gradient[0], v.gradient[1], v.gradient[2];
    return derivative.colwise().normalized().determinant();
  };
  std::vector<double> found;
  for (const Front& front : focal_points(flow, start, nodes_backward(solution), p, parameter_directions, determinant)) {
    found.push_back(-front.quadrature[2] * record.time_unit);
  }
  return found;
}

}  // namespace

std::vector<double> focal_times(const Solution& solution) {
  switch (family_of(*solution.problem)) {
    case Family::turning: return times<TurningOrbit>(solution);
    case Family::passing: return times<PassingOrbit>(solution);
    case Family::monotone: break;
  }
  return times<MonotoneOrbit>(solution);
}

}  // namespace costate::drag
