#include "drag_problem.hpp"

#include <costate/error.hpp>
#include <costate/models/gauss.hpp>

#include <algorithm>
#include <cmath>

namespace costate::drag {

namespace {

/// The direction of (x, y), rad.
Jet direction(const Jet& y, const Jet& x) {
  const double square = x.value * x.value + y.value * y.value;
  return Jet::chain(y, x, std::atan2(y.value, x.value), x.value / square, -y.value / square);
}

Scaled<double> scaled(const std::vector<double>& p) {
  return Scaled<double>([&](std::size_t i) { return p[i]; });
}

SpeedMap map_of(const Scaled<double>& scene, const Guess& guess) {
  if (guess.family != Family::monotone) return {};
  return speed_map(MonotoneOrbit<double>(guess.first, guess.second, scene.friction).constants, scene.v0, guess.first);
}

Arcs arcs_of(const Scaled<double>& scene, const Guess& guess) {
  switch (guess.family) {
    case Family::turning: {
      const TurningOrbit<double> orbit(scene.v0 * std::hypot(1.0, guess.first), std::sinh(guess.second), scene.friction);
      return arcs_between(orbit, guess.first, orbit.end_place());
    }
    case Family::passing: {
      const PassingOrbit<double> orbit(guess.first, guess.second, scene.friction);
      return arcs_between(orbit, scene.v0, orbit.end_place());
    }
    case Family::monotone: break;
  }
  return arcs_between(MonotoneOrbit<double>(guess.first, guess.second, scene.friction, map_of(scene, guess)), scene.v0,
                      guess.first);
}

const DragProblem& drag_problem(const Problem& problem) {
  if (const auto* drag = dynamic_cast<const DragProblem*>(&problem)) return *drag;
  throw BadInput("the problem is not one of a bead with drag");
}

}  // namespace

DragProblem::DragProblem(const Scene& scene, const Guess& guess)
    : family_(guess.family), map_(map_of(scaled(drag::parameters(scene)), guess)), monotone_(map_) {
  const std::vector<double> values = drag::parameters(scene);
  const std::vector<std::pair<const char*, const char*>> names{{"x", "m"},    {"y", "m"},        {"speed", "m/s"},
                                                               {"mu", "1/s"}, {"beta", "s/m^2"}, {"gravity", "m/s^2"}};
  for (std::size_t i = 0; i < values.size(); ++i) parameters_.push_back({names[i].first, names[i].second, values[i]});

  const auto scale = [](double value) { return std::max(1.0, std::abs(value)); };
  switch (family_) {
    case Family::turning:
      unknowns_ = {{.name = "start_slope", .scale = scale(guess.first)},
                   {.name = "end_slope_asinh", .scale = scale(guess.second)}};
      break;
    case Family::passing:
      unknowns_ = {{.name = "passing_speed", .scale = guess.first, .lower = 0.0},
                   {.name = "closeness", .scale = scale(guess.second)}};
      break;
    case Family::monotone:
      unknowns_ = {{.name = "end_speed", .scale = guess.first, .lower = 0.0},
                   {.name = "end_inclination", .lower = -std::numbers::pi / 2, .upper = std::numbers::pi / 2}};
      break;
  }
  unknowns_.push_back({.name = "duration", .scale = guess.final_time, .lower = 0.0});
  for (const char* name : {"x where the arcs meet", "y where the arcs meet"}) rows_.push_back({name});
  rows_.push_back({"time where the arcs meet", guess.final_time});

  arcs_ = arcs_of(scaled(values), guess);
  structure_ = arcs_ == Arcs::from_both ? std::vector<std::string>{"approach", "departure"}
                                        : std::vector<std::string>{"free"};
}

void DragProblem::shoot(Shot& shot) const {
  const Scaled<Jet> scene([&](std::size_t i) { return shot.parameter(i); });
  const Jet &first = shot.unknown(0), &second = shot.unknown(1);
  switch (family_) {
    case Family::turning: {
      const Jet top = scene.v0 * sqrt(1.0 + first * first);
      const Jet r = 0.5 * (exp(second) - exp(-second));
      travel(shot, scene, turning_, TurningOrbit<Jet>(top, r, scene.friction), {top, r}, first);
      break;
    }
    case Family::passing:
      travel(shot, scene, passing_, PassingOrbit<Jet>(first, second, scene.friction), {first, second}, scene.v0);
      break;
    case Family::monotone:
      travel(shot, scene, monotone_, MonotoneOrbit<Jet>(first, second, scene.friction, map_), {first, second}, scene.v0);
      break;
  }
}

/// Integrates from the ends to where the arcs meet, sets the rows and reports.
template <class Orbit, class Fields>
void DragProblem::travel(Shot& shot, const Scaled<Jet>& scene, const Fields& fields, const Orbit& orbit,
                         const std::array<Jet, 2>& constants_of_orbit, const Jet& start) const {
  const Jet& T = shot.unknown(2);
  const auto arc = [&](int place, const Field& field, const Jet& from, const Jet& to, Jets at) {
    return shot
        .arc({.arc = place,
              .field = &field,
              .t0 = from,
              .t1 = to,
              .quadrature = std::move(at),
              .parameter = {constants_of_orbit[0], constants_of_orbit[1], scene.friction.mu, scene.friction.beta},
              .time_quadrature = 2})
        .quadrature;
  };
  const Jet end = orbit.end_place(), middle = orbit.middle();
  Jets left{0.0, 0.0, 0.0}, right{scene.x, scene.y, T};
  if (arcs_ != Arcs::from_end) {
    left = arc(0, fields.before, orbit.variable(start, -1.0), arcs_ == Arcs::from_both ? middle : orbit.variable(end, -1.0),
               left);
  }
  if (arcs_ != Arcs::from_start) {
    const bool alone = arcs_ == Arcs::from_end;
    right = arc(alone ? 0 : 1, fields.after, orbit.variable(end, 1.0), alone ? orbit.variable(start, 1.0) : middle, right);
  }
  for (std::size_t i = 0; i < 3; ++i) shot.row(i, left[i] - right[i]);

  const OrbitPoint<Jet> first = orbit.at_place(start);
  const Constants<Jet>& constants = orbit.constants;
  shot.report("final_time", "s", T * scene.time);
  shot.report("lambda_x", "s/m", constants.lambda_x / scene.speed);
  shot.report("lambda_y", "s/m", constants.lambda_y / scene.speed);
  shot.report("lambda_v0", "s^2/m", first.lambda_v * scene.time / scene.speed);
  shot.report("theta1", "rad", direction(first.across, first.v * constants.lambda_x));
  shot.report("theta2", "rad", direction(constants.lambda_y, constants.lambda_x));
  shot.report("v_f", "m/s", constants.end_speed() * scene.speed);
  shot.complete({0.0, 0.0, 0.0}, {constants.lambda_x.value, constants.lambda_y.value}, scene.time.value);
}

std::vector<Column> DragProblem::columns() const {
  return {{"x", "m"},          {"y", "m"},          {"v", "m/s"},         {"theta", "rad"},
          {"lambda_x", "s/m"}, {"lambda_y", "s/m"}, {"lambda_v", "s^2/m"}};
}

double DragProblem::side_of(const ArcRecord& record) const {
  return arcs_ == Arcs::from_start || (arcs_ == Arcs::from_both && record.arc == 0) ? -1.0 : 1.0;
}

OrbitPoint<double> DragProblem::orbit_point(const ArcPoint& point) const {
  const Eigen::VectorXd& p = point.record->parameter;
  const Vec<double, 4> parameter{p[0], p[1], p[2], p[3]};
  const double side = side_of(*point.record);
  switch (family_) {
    case Family::turning: return OrbitArc<TurningOrbit>().orbit(parameter).at(point.own, side);
    case Family::passing: return OrbitArc<PassingOrbit>().orbit(parameter).at(point.own, side);
    case Family::monotone: break;
  }
  return OrbitArc<MonotoneOrbit>{side, map_}.orbit(parameter).at(point.own, side);
}

std::vector<double> DragProblem::observe(const ArcPoint& point, const std::vector<double>& p) const {
  const Scaled<double> scene = scaled(p);
  const OrbitPoint<double> at = orbit_point(point);
  const std::vector<double>& lambda = point.record->constants;
  return {scene.length * point.quadrature[0],
          scene.length * point.quadrature[1],
          scene.speed * at.v,
          std::atan2(at.across, at.v * lambda[0]),
          lambda[0] / scene.speed,
          lambda[1] / scene.speed,
          scene.time / scene.speed * at.lambda_v};
}

std::vector<PathCheck> DragProblem::check(const ArcPoint& point, const std::vector<double>& p) const {
  const Scaled<double> scene = scaled(p);
  const OrbitPoint<double> at = orbit_point(point);
  const double K = scene.friction.force(at.v);
  const std::vector<double>& lambda = point.record->constants;
  const double size = std::hypot(at.across, at.v * lambda[0]);
  const double terms = std::max({1.0, std::abs(at.lambda_v), std::abs(at.normal * K)});  // of the size of what cancels
  return {{"speed", PathCheck::Kind::nonnegative, at.v},
          {"N = 1 - lambda_v K, along the law (Legendre-Clebsch: H_theta_theta = -N)", PathCheck::Kind::nonnegative,
           at.normal},
          {"Hamiltonian", PathCheck::Kind::zero, (size + at.lambda_v * K - 1.0) / std::max(terms, size)},
          {"equation of motion along the law, N K - N v' = v lambda_y - lambda_v", PathCheck::Kind::zero,
           (at.across - (at.v * lambda[1] - at.lambda_v)) / terms}};
}

SpeedMap speed_map(const Constants<double>& constants, double start, double end) {
  const auto D = [&](double v) { return constants.discriminant(v * v); };
  // The least of the samples, at even ratios of the speed, and then between its neighbours (golden section).
  constexpr int samples = 40;
  const auto sample = [&](int i) { return start * std::pow(end / start, static_cast<double>(i) / samples); };
  int least = 0;
  for (int i = 1; i <= samples; ++i) {
    if (D(sample(i)) < D(sample(least))) least = i;
  }
  double a = sample(std::max(least - 1, 0)), b = sample(std::min(least + 1, samples));
  for (int i = 0; i < 40; ++i) {
    constexpr double golden = 0.6180339887498949;
    const double left = b - golden * (b - a), right = a + golden * (b - a);
    (D(left) < D(right) ? b : a) = D(left) < D(right) ? right : left;
  }
  const double center = 0.5 * (a + b), step = 1e-4 * center;
  const double value = D(center), slope = (D(center + step) - D(center - step)) / (2.0 * step);
  const double curvature = (D(center + step) - 2.0 * value + D(center - step)) / (step * step);
  const double span = std::abs(end - start);
  const double width = 1.0 / (std::abs(slope / value) + std::sqrt(std::abs(0.5 * curvature / value)));
  return {center, std::isfinite(width) && width > 0.0 ? std::min(width, span) : span};
}

std::shared_ptr<const Problem> make_problem(const Scene& scene, const Guess& guess) {
  return std::make_shared<DragProblem>(scene, guess);
}

Family family_of(const Problem& problem) { return drag_problem(problem).family(); }

SpeedMap map_of(const Problem& problem) { return drag_problem(problem).map(); }

Arcs arcs_of(const Problem& problem) { return drag_problem(problem).arcs(); }

Eigen::VectorXd unknowns(const Guess& guess) { return Eigen::Vector3d(guess.first, guess.second, guess.final_time); }

std::vector<double> parameters(const Scene& scene) {
  return {scene.x, scene.y, scene.speed, scene.mu, scene.beta, scene.gravity};
}

double greatest_height(const Scene& scene) {
  // Whatever the speed at which K = −g, octaves of v resolve it: the poles of the integrand lie off the positive axis, so
  // Gauss's rule with eight nodes is good to rounding on each.
  constexpr int octaves = 64;
  double height = 0.0;
  double above = scene.speed;
  for (int i = 0; i < octaves; ++i) {
    const double below = i + 1 == octaves ? 0.0 : 0.5 * above;
    for (const auto& [node, weight] : gauss) {
      for (const double side : {-1.0, 1.0}) {
        const double v = 0.5 * (above + below) + 0.5 * (above - below) * side * node;
        height += 0.5 * (above - below) * weight * v / (scene.gravity - scene.friction().force(v));
      }
    }
    above = below;
  }
  return height;
}

}  // namespace costate::drag
