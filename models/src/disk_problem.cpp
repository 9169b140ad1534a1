#include "disk_problem.hpp"

#include <costate/error.hpp>

#include <algorithm>
#include <fmt/format.h>

namespace costate::disk {

namespace {

/// Ω = τ√(1 − V²).
Jet turning(const Jet& V, const ArcType& arc) { return arc.turn * sqrt(1.0 - V * V, "1 - V^2/c1^2"); }

/// ±V± of a boundary arc.
Jet boundary_speed(const Scaled<Jet>& scene, const ArcType& arc) {
  const Jet root = sqrt(1.0 - 4.0 * scene.friction * scene.friction, "1 - 4 kappa^2 (a boundary arc needs k g L <= c1^2/2)");
  return arc.course * sqrt(0.5 * (1.0 + arc.sign * root));
}

ArcEnd arrive(Shot& shot, const ArcStart& start, ChainPoint& at) {
  ArcEnd end = shot.arc(start);
  at.phi = end.state[0];
  at.x = end.quadrature[0];
  at.y = end.quadrature[1];
  return end;
}

}  // namespace

DiskProblem::DiskProblem(const Scene& scene, Structure arcs)
    : arcs_(std::move(arcs)),
      limited_(scene.friction.has_value()),
      anchor_(anchor_of(arcs_)),
      guards_(guards_of(arcs_, limited_)) {
  if (const std::string objection = objection_to(arcs_); !objection.empty()) throw BadInput(objection);
  const bool all_free = std::all_of(arcs_.begin(), arcs_.end(), [](const ArcType& a) { return a.kind == ArcKind::free; });
  if (!limited_ && !all_free) throw BadInput("the scene has no friction coefficient, but the structure needs one");
  name_everything(scene);
}

void DiskProblem::shoot(Shot& shot) const {
  const Scaled<Jet> scene([&](std::size_t i) { return shot.parameter(i); }, limited_);
  std::size_t next_row = 0;
  const Anchor anchor = start_anchor(shot, scene, next_row);

  // For the guards alone.
  std::vector<ArcEnds> ends(shot.wants_reports() ? arcs_.size() : 0);
  ChainPoint right = anchor.point;
  for (std::size_t i = anchor_.first_forward; i < arcs_.size(); ++i) {
    if (!ends.empty()) {
      ends[i].begin = right;
      if (kind(i) == ArcKind::saturated) ends[i].begin.acceleration = departure(scene, i, +1, right);
    }
    advance(shot, scene, anchor, i, +1, right, next_row);
    if (!ends.empty()) ends[i].end = right;
  }
  ChainPoint left = anchor.point;
  for (std::size_t i = anchor_.first_forward; i-- > 0;) {
    if (!ends.empty()) {
      ends[i].end = left;
      if (kind(i) == ArcKind::saturated) ends[i].end.acceleration = departure(scene, i, -1, left);
    }
    advance(shot, scene, anchor, i, -1, left, next_row);
    if (!ends.empty()) ends[i].begin = left;
  }

  if (anchor_.inside()) shot.row(next_row++, left.phi);
  shot.row(next_row++, right.phi - scene.heading);
  shot.row(next_row++, right.x - left.x - scene.x);
  shot.row(next_row++, right.y - left.y - scene.y);
  if (shot.wants_reports()) set_guards(shot, scene, anchor, ends);
  report(shot, scene, anchor, left, right);
}

/// Rows in the order in which shoot() meets them; unknowns in the order in which it reads them.
void DiskProblem::name_everything(const Scene& scene) {
  if (anchor_.inside()) unknowns_.push_back({"anchor_heading"});
  if (anchor_.kind == ArcKind::free) {
    unknowns_.push_back({"speed_angle"});
  } else {
    if (anchor_.kind == ArcKind::saturated) {
      unknowns_.push_back({.name = "anchor_speed", .lower = -1.0, .upper = 1.0});
      unknowns_.push_back({.name = "anchor_acceleration", .lower = 0.0});
      rows_.push_back({"friction at its limit at the anchor"});
    }
    unknowns_.push_back({"lambda_along"});
  }
  unknowns_.push_back({"lambda_across"});
  for (std::size_t i = 0; i < arcs_.size(); ++i) {
    unknowns_.push_back({.name = fmt::format("duration_{}", i + 1), .lower = 0.0});
    structure_.emplace_back(kind_name(kind(i)));
  }
  for (std::size_t i = anchor_.first_forward; i < arcs_.size(); ++i) name_far_rows(i, +1);
  for (std::size_t i = anchor_.first_forward; i-- > 0;) name_far_rows(i, -1);
  if (anchor_.inside()) rows_.push_back({"start heading"});
  for (const char* name : {"end heading", "end x", "end y"}) rows_.push_back({name});

  const std::vector<double> values = disk::parameters(scene);
  const std::vector<std::pair<const char*, const char*>> names{{"x", "m"},       {"y", "m"},       {"heading", "rad"},
                                                               {"radius", "m"},  {"speed", "m/s"}, {"gravity", "m/s^2"},
                                                               {"friction", "1"}};
  for (std::size_t i = 0; i < values.size(); ++i) parameters_.push_back({names[i].first, names[i].second, values[i]});
}

const ArcType* DiskProblem::beyond(std::size_t i, int direction) const {
  if (direction > 0) return i + 1 < arcs_.size() ? &arcs_[i + 1] : nullptr;
  return i > 0 ? &arcs_[i - 1] : nullptr;
}

void DiskProblem::name_far_rows(std::size_t i, int direction) {
  if (kind(i) != ArcKind::saturated) return;
  const char* side = direction > 0 ? "end" : "start";
  rows_.push_back({fmt::format("arc {} {}: switching function S = 0", i + 1, side)});
  const auto next = beyond(i, direction);
  if (is(next, ArcKind::free)) rows_.push_back({fmt::format("arc {} {}: V = A on the free side", i + 1, side)});
  if (is(next, ArcKind::boundary)) rows_.push_back({fmt::format("arc {} {}: V' = 0 at the boundary arc", i + 1, side)});
}

Anchor DiskProblem::start_anchor(Shot& shot, const Scaled<Jet>& scene, std::size_t& next_row) const {
  std::size_t next = 0;
  Anchor anchor;
  ChainPoint& at = anchor.point;
  if (anchor_.inside()) at.phi = shot.unknown(next++);
  Jet along;
  const ArcType& arc = arcs_[anchor_.first_forward];
  if (anchor_.kind == ArcKind::free) {
    // H = 0 on a free arc is A² + λφ² = 1: one angle gives A = V and λφ = Ω, smooth through V = ±1.
    const Jet& angle = shot.unknown(next++);
    along = at.V = cos(angle);
    at.lambda_phi = sin(angle);
  } else {
    if (anchor_.kind == ArcKind::saturated) {
      at.V = shot.unknown(next++);
      at.acceleration = arc.sign * shot.unknown(next++);
      const Jet V2 = at.V * at.V;
      shot.row(next_row++, at.acceleration * at.acceleration + V2 * (1.0 - V2) - scene.friction * scene.friction);
    } else {
      at.V = boundary_speed(scene, arc);
    }
    along = shot.unknown(next++);
    at.lambda_phi = (1.0 - along * at.V) / turning(at.V, arc);  // S = 0
  }
  const Jet& across = shot.unknown(next++);
  anchor.lambda_x = along * cos(at.phi) - across * sin(at.phi);
  anchor.lambda_y = along * sin(at.phi) + across * cos(at.phi);
  return anchor;
}

/// Integrates arc i away from the anchor and sets the rows at its far end.
void DiskProblem::advance(Shot& shot, const Scaled<Jet>& scene, const Anchor& anchor, std::size_t i, int direction,
                          ChainPoint& at, std::size_t& next_row) const {
  const Jet d = duration(shot, i);
  ArcStart start{.arc = static_cast<int>(i), .t1 = direction * d, .clock = at.time.value, .quadrature = {at.x, at.y}};
  switch (kind(i)) {
    case ArcKind::free: {
      start.field = &free_;
      start.state = {at.phi, at.lambda_phi};
      start.parameter = {anchor.lambda_x, anchor.lambda_y};
      const ArcEnd end = arrive(shot, start, at);
      at.lambda_phi = end.state[1];
      at.V = anchor.along(at.phi);
      break;
    }
    case ArcKind::saturated: advance_saturated(shot, scene, anchor, start, direction, at, next_row); break;
    case ArcKind::boundary: {
      start.field = &boundary_;
      start.state = {at.phi};
      start.parameter = {at.V, arcs_[i].turn};
      const Jet x = at.x, y = at.y;
      arrive(shot, start, at);
      at.lambda_phi += anchor.lambda_x * (at.y - y) - anchor.lambda_y * (at.x - x);
      break;
    }
  }
  at.time += direction * d;
}

Jet DiskProblem::departure(const Scaled<Jet>& scene, std::size_t i, int direction, const ChainPoint& at) const {
  const auto from = before(i, direction);
  // From a boundary arc V' starts at 0, and Duffing's equation itself takes V off it.
  if (is(from, ArcKind::boundary)) return 0.0;
  if (is(from, ArcKind::free)) {
    const Jet V2 = at.V * at.V;
    return arcs_[i].sign * sqrt(scene.friction * scene.friction - V2 * (1.0 - V2), "(k g)^2 - (V Omega)^2 at a junction");
  }
  // At a switch V' changes its sign; the anchor's is that of the arc after it.
  const bool at_anchor = anchor_.kind == ArcKind::saturated && i == anchor_.first_forward && direction > 0;
  return at_anchor ? at.acceleration : -at.acceleration;
}

void DiskProblem::advance_saturated(Shot& shot, const Scaled<Jet>& scene, const Anchor& anchor, ArcStart& start,
                                    int direction, ChainPoint& at, std::size_t& next_row) const {
  const auto i = static_cast<std::size_t>(start.arc);
  const Jet d = duration(shot, i);
  const double scale = std::max(std::abs(d.value), std::numeric_limits<double>::min());
  const Jet V1 = at.V;
  const auto previous = before(i, direction);
  SwitchingStart<Jet> from(anchor.along(at.phi), V1, turning(V1, arcs_[i]), at.lambda_phi);
  from.switching = 0.0;                                                          // by construction of every junction
  if (anchor_.kind == ArcKind::free && is(previous, ArcKind::free)) from.G = 0.0;  // likewise: V = A, λφ = Ω
  start.field = &saturated_;
  start.state = {at.phi, 0.0, departure(scene, i, direction, at), at.lambda_phi};
  start.parameter = {anchor.lambda_x, anchor.lambda_y, V1, scale, arcs_[i].turn};
  start.quadrature = {at.x, at.y, 0.0, 0.0};
  const ArcEnd end = arrive(shot, start, at);
  at.V = V1 + scale * end.state[1];
  at.acceleration = end.state[2];
  at.lambda_phi = end.state[3];
  at.G = from.G + scale * end.quadrature[2];

  // S begins with slope −V' G, which vanishes where the arc leaves a free or a boundary one.
  const bool sloping = previous == nullptr || is(previous, ArcKind::saturated);
  const Jet S = from.at(end.state[1], end.quadrature[2], end.quadrature[3], scale);
  shot.row(next_row++, S / (sloping ? d : d * d));
  const auto next = beyond(i, direction);
  if (is(next, ArcKind::free)) shot.row(next_row++, at.V - anchor.along(at.phi));
  if (is(next, ArcKind::boundary)) shot.row(next_row++, end.state[2]);
}

void DiskProblem::report(Shot& shot, const Scaled<Jet>& scene, const Anchor& anchor, const ChainPoint& left,
                         const ChainPoint& right) const {
  const Jet &T = scene.time, &c = scene.speed;
  const double side = scene.side;
  shot.complete({-left.x.value, -left.y.value}, {anchor.lambda_x.value, anchor.lambda_y.value, left.lambda_phi.value},
                T.value);
  if (!shot.wants_reports()) return;
  // On a free arc λφ = Ω, with its sign.
  const Jet Omega = kind(0) == ArcKind::free ? left.lambda_phi : turning(left.V, arcs_[0]);
  Jet elapsed;
  for (std::size_t i = 0; i + 1 < arcs_.size(); ++i) {
    elapsed += duration(shot, i);
    shot.report(fmt::format("t{}", i + 1), "s", T * elapsed);
  }
  shot.report("final_time", "s", T * (right.time - left.time));
  shot.report("lambda_x", "s/m", anchor.lambda_x / c);
  shot.report("lambda_y", "s/m", side * anchor.lambda_y / c);
  shot.report("lambda_phi0", "s/rad", side * T * left.lambda_phi);
  shot.report("V0", "m/s", c * left.V);
  shot.report("Omega0", "rad/s", side * Omega / T);
}

std::shared_ptr<const Problem> make_problem(const Scene& scene, const Structure& structure) {
  return std::make_shared<DiskProblem>(scene, structure);
}

std::vector<double> parameters(const Scene& scene) {
  std::vector<double> values{scene.x, scene.y, scene.heading, scene.radius, scene.speed, scene.gravity};
  if (scene.friction) values.push_back(*scene.friction);
  return values;
}

}  // namespace costate::disk
