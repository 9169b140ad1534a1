#include "drag_scene.hpp"

#include <costate/shooting/focal.hpp>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace costate::drag {

namespace {

using Eigen::Index;

/// Values with derivatives with respect to the parameters of the family, 0 and 1, and u, 2.
using Sensitive = Dual<double, 3>;

/// How the constants of an orbit move with the parameters of the family: with the logarithm of the first, and so that ℓ
/// moves by one with the second, or it by its own size where that is less. Whatever the size of the constants, derivatives
/// are of order one then.
template <template <class> class Orbit>
std::array<double, 2> natural_steps(const OrbitArc<Orbit>& arc, const Eigen::VectorXd& p) {
  const double ell = arc.orbit(Vec<Sensitive, 4>{Sensitive(p[0]), Sensitive::variable(p[1], 1), Sensitive(p[2]),
                                                 Sensitive(p[3])})
                         .middle()
                         .gradient[1];
  return {p[0], std::min(1.0 / std::abs(ell), std::max(1.0, std::abs(p[1])))};
}

/// A constant that moves with a parameter of the family.
Sensitive moving(double value, int parameter, double step) {
  Sensitive constant(value);
  constant.gradient[static_cast<std::size_t>(parameter)] = step;
  return constant;
}

/// Points from `outer` to `inner`, `outer` left out. In u an orbit varies over some tenths, at its ends and near η = 0, and
/// hardly between.
std::vector<double> nodes_between(double outer, double inner, double middle) {
  std::vector<double> nodes;
  const double length = std::abs(inner - outer);
  double step = 0.02, at = 0.0;
  while (at + 1.5 * step < length) {
    at += step;
    nodes.push_back(std::lerp(outer, inner, at / length));
    step = std::min(1.15 * step, std::max(0.15, 0.3 * std::abs(nodes.back() - middle)));
  }
  nodes.push_back(inner);
  return nodes;
}

/// A leg on one side of the orbit of a solution.
template <template <class> class Orbit>
class Side {
 public:
  Side(const Solution& solution, double side)
      : side_(side),
        p_(solution.arcs.front().record.parameter),
        arc_{side, map_of(*solution.problem)},
        steps_(natural_steps(arc_, p_)),
        orbit_(arc_.orbit(Vec<Sensitive, 4>{moving(p_[0], 0, steps_[0]), moving(p_[1], 1, steps_[1]), Sensitive(p_[2]),
                                            Sensitive(p_[3])})),
        field_(arc_),
        // A flow's absolute tolerance of derivatives grows with the size of the directions.
        flow_(field_, {.tolerance = {1e-11, 1e-11 / std::max(1.0, steps_[1])}}) {}

  [[nodiscard]] const Orbit<Sensitive>& orbit() const { return orbit_; }

  /// The family at the end of the path, on the end point. All its orbits are there at the same place, but not at the same
  /// u: at fixed u the place moves by minus the rate times ∂u.
  [[nodiscard]] Front end() const {
    const Sensitive u = orbit_.variable(orbit_.end_place(), side_);
    Front front;
    front.t = u.value;
    front.state_directions.resize(0, 2);
    front.quadrature.setZero(3);
    front.quadrature_directions = -rate(front.t) * Eigen::RowVector2d(u.gradient[0], u.gradient[1]);
    return front;
  }

  /// A front of side +1 where η = 0 stated on side −1: u = η + ℓ becomes ℓ − η, and what is fixed with it.
  [[nodiscard]] Front crossed(Front front) const {
    const Sensitive middle = orbit_.middle();
    front.t = middle.value;
    front.quadrature_directions -= 2.0 * rate(front.t) * Eigen::RowVector2d(middle.gradient[0], middle.gradient[1]);
    return front;
  }

  /// det ∂(x, y, v)/∂(parameters, u), of the same sign on both sides. On the side of the end the closeness to a steady
  /// motion moves nothing but what is exponentially near it: the second column counts as 0 where it is small beside the
  /// motion itself.
  [[nodiscard]] double determinant(const Front& front) const {
    const Sensitive v = orbit_.at(Sensitive::variable(front.t, 2), side_).v;
    Eigen::Matrix3d derivative;
    derivative.topLeftCorner<2, 2>() = front.quadrature_directions.topRows(2);
    derivative.topRightCorner<2, 1>() = front.quadrature_rate.head(2);
    derivative.row(2) << v.gradient[0], v.gradient[1], v.gradient[2];
    const double least = orbit_.middle().gradient[1] == 0.0 ? 0.0 : front.quadrature_rate.head(2).norm();
    for (Index i = 0; i < 3; ++i) derivative.col(i) /= std::max(derivative.col(i).norm(), i == 1 ? least : 0.0);
    return side_ * derivative.determinant();
  }

  /// The way from one u to another.
  [[nodiscard]] FocalLeg leg(std::vector<double> nodes) {
    Eigen::MatrixXd directions = Eigen::MatrixXd::Zero(4, 2);
    directions(0, 0) = steps_[0];
    directions(1, 1) = steps_[1];
    return {&flow_, p_, directions, std::move(nodes), [this](const Front& front) { return determinant(front); }};
  }

 private:
  [[nodiscard]] Eigen::Vector3d rate(double u) const {
    const auto r = arc_.rates(u, {}, Vec<double, 4>{p_[0], p_[1], p_[2], p_[3]}).quadrature;
    return {r[0], r[1], r[2]};
  }

  double side_;
  Eigen::VectorXd p_;
  OrbitArc<Orbit> arc_;
  std::array<double, 2> steps_;
  Orbit<Sensitive> orbit_;
  FieldOf<OrbitArc<Orbit>> field_;
  Flow flow_;
};

template <template <class> class Orbit>
std::vector<double> times(const Solution& solution) {
  Side<Orbit> before(solution, -1.0), after(solution, 1.0);
  const Arcs arcs = arcs_of(*solution.problem);
  const double middle = after.orbit().middle().value;
  const ArcRecord &first = solution.arcs.front().record, &last = solution.arcs.back().record;
  FocalScan scan(arcs == Arcs::from_start ? before.end() : after.end());
  // The records run from the ends of the path inward; the scan goes from its end to its start.
  if (arcs != Arcs::from_start) scan.follow(after.leg(nodes_between(last.t0, last.t1, middle)));
  if (arcs == Arcs::from_both) scan.restate(before.crossed(scan.front()));
  if (arcs != Arcs::from_end) {
    std::vector<double> nodes = nodes_between(first.t0, first.t1, middle);
    std::reverse(nodes.begin(), nodes.end());
    nodes.erase(nodes.begin());  // where the scan stands
    nodes.push_back(first.t0);
    scan.follow(before.leg(std::move(nodes)));
  }
  std::vector<double> found;
  for (const Front& front : scan.found()) found.push_back(-front.quadrature[2] * last.time_unit);
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
