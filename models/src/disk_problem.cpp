#include "disk_problem.hpp"

#include <costate/error.hpp>

#include <algorithm>
#include <fmt/format.h>

namespace costate::disk {

namespace {

const char* name_of(ArcKind kind) {
  switch (kind) {
    case ArcKind::free: return "free";
    case ArcKind::saturated: return "saturated";
    case ArcKind::boundary: return "boundary";
  }
  return "";
}

Jet turning(const Jet& V) { return sqrt(1.0 - V * V, "1 - V^2/c1^2"); }

/// V± of a boundary arc; the sign is that of the arc type.
Jet boundary_speed(const Scaled<Jet>& scene, const ArcType& arc) {
  const Jet root = sqrt(1.0 - 4.0 * scene.friction * scene.friction, "1 - 4 kappa^2 (a boundary arc needs k g L <= c1^2/2)");
  return sqrt(0.5 * (1.0 + arc.sign * root));
}

ArcEnd arrive(Shot& shot, const ArcStart& start, ChainPoint& at) {
  ArcEnd end = shot.arc(start);
  at.phi = end.state[0];
  at.x = end.quadrature[0];
  at.y = end.quadrature[1];
  return end;
}

}  // namespace

DiskProblem::DiskProblem(const Scene& scene, Structure arcs) : arcs_(std::move(arcs)) {
  limited_ = arcs_.size() > 1 || (arcs_.size() == 1 && arcs_[0].kind != ArcKind::free);
  choose_anchor();
  name_everything(scene);
}

void DiskProblem::shoot(Shot& shot) const {
  const Scaled<Jet> scene([&](std::size_t i) { return shot.parameter(i); }, limited_);
  std::size_t next_row = 0;
  const Anchor anchor = start_anchor(shot, scene);

  ChainPoint right = anchor.point;
  for (std::size_t i = first_forward_; i < arcs_.size(); ++i) advance(shot, scene, anchor, i, +1, right, next_row);
  ChainPoint left = anchor.point;
  for (std::size_t i = first_forward_; i-- > 0;) advance(shot, scene, anchor, i, -1, left, next_row);

  if (starts_inside()) shot.row(next_row++, left.phi);
  shot.row(next_row++, right.phi - scene.heading);
  shot.row(next_row++, right.x - left.x - scene.x);
  shot.row(next_row++, right.y - left.y - scene.y);
  report(shot, scene, anchor, left, right);
}

void DiskProblem::choose_anchor() {
  if (arcs_.empty()) throw BadInput("the arc structure is empty: at least one arc is needed");
  for (std::size_t i = 0; i + 1 < arcs_.size(); ++i) {
    const bool saturated = kind(i) == ArcKind::saturated || kind(i + 1) == ArcKind::saturated;
    if (!saturated) {
      throw BadInput(fmt::format("arcs {} and {} of the structure are {} and {}: one of two neighbours must be saturated",
                                 i + 1, i + 2, name_of(kind(i)), name_of(kind(i + 1))));
    }
  }
  for (const ArcKind wanted : {ArcKind::free, ArcKind::boundary}) {
    const auto found = std::find_if(arcs_.begin(), arcs_.end(), [&](const ArcType& a) { return a.kind == wanted; });
    if (found == arcs_.end()) continue;
    anchor_kind_ = wanted;
    first_forward_ = static_cast<std::size_t>(found - arcs_.begin());
    return;
  }
  if (arcs_.size() < 2) throw BadInput("a single saturated arc cannot be anchored: it needs a neighbour");
  anchor_kind_ = ArcKind::saturated;
  first_forward_ = 1;
}

/// Rows in the order in which shoot() meets them; unknowns in the order in which it reads them.
void DiskProblem::name_everything(const Scene& scene) {
  if (starts_inside()) unknowns_.push_back({"anchor_heading"});
  if (anchor_kind_ == ArcKind::free) {
    unknowns_.push_back({"speed_angle"});
  } else {
    if (anchored_at_switch()) unknowns_.push_back({.name = "anchor_speed", .lower = -1.0, .upper = 1.0});
    unknowns_.push_back({"lambda_along"});
  }
  unknowns_.push_back({"lambda_across"});
  for (std::size_t i = 0; i < arcs_.size(); ++i) {
    unknowns_.push_back({.name = fmt::format("duration_{}", i + 1), .lower = 0.0});
    structure_.emplace_back(name_of(kind(i)));
  }
  for (std::size_t i = first_forward_; i < arcs_.size(); ++i) name_far_rows(i, +1);
  for (std::size_t i = first_forward_; i-- > 0;) name_far_rows(i, -1);
  if (starts_inside()) rows_.push_back({"start heading"});
  for (const char* name : {"end heading", "end x", "end y"}) rows_.push_back({name});

  const std::vector<double> values = disk::parameters(scene, limited_);
  const std::vector<std::pair<const char*, const char*>> names{{"x", "m"},        {"y", "m"},           {"heading", "rad"},
                                                               {"radius", "m"},   {"speed", "m/s"},     {"gravity", "m/s^2"},
                                                               {"friction", "1"}};
  for (std::size_t i = 0; i < values.size(); ++i) parameters_.push_back({names[i].first, names[i].second, values[i]});
}

/// The arc after `i` in the given direction, if any.
std::optional<ArcKind> DiskProblem::beyond(std::size_t i, int direction) const {
  if (direction > 0) return i + 1 < arcs_.size() ? std::optional(kind(i + 1)) : std::nullopt;
  return i > 0 ? std::optional(kind(i - 1)) : std::nullopt;
}

void DiskProblem::name_far_rows(std::size_t i, int direction) {
  if (kind(i) != ArcKind::saturated) return;
  const char* side = direction > 0 ? "end" : "start";
  rows_.push_back({fmt::format("arc {} {}: switching function S = 0", i + 1, side)});
  const auto next = beyond(i, direction);
  if (next == ArcKind::free) rows_.push_back({fmt::format("arc {} {}: V = A on the free side", i + 1, side)});
  if (next == ArcKind::boundary) rows_.push_back({fmt::format("arc {} {}: V' = 0 at the boundary arc", i + 1, side)});
}

Anchor DiskProblem::start_anchor(const Shot& shot, const Scaled<Jet>& scene) const {
  std::size_t next = 0;
  Anchor anchor;
  ChainPoint& at = anchor.point;
  if (starts_inside()) at.phi = shot.unknown(next++);
  Jet along;
  if (anchor_kind_ == ArcKind::free) {
    // H = 0 on a free arc is A² + λφ² = 1: one angle gives A = V and λφ = Ω, smooth through V = ±1.
    const Jet& angle = shot.unknown(next++);
    along = at.V = cos(angle);
    at.lambda_phi = sin(angle);
  } else {
    at.V = anchored_at_switch() ? shot.unknown(next++) : boundary_speed(scene, arcs_[first_forward_]);
    along = shot.unknown(next++);
    at.lambda_phi = (1.0 - along * at.V) / turning(at.V);  // S = 0
  }
  const Jet& across = shot.unknown(next++);
  anchor.lambda_x = along * cos(at.phi) - across * sin(at.phi);
  anchor.lambda_y = along * sin(at.phi) + across * cos(at.phi);
  return anchor;
}

/// Integrates arc i away from the anchor and sets the rows at its far end.
void DiskProblem::advance(Shot& shot, const Scaled<Jet>& scene, const Anchor& anchor, std::size_t i, int direction, ChainPoint& at,
             std::size_t& next_row) const {
  const Jet d = duration(shot, i);
  ArcStart start{.arc = static_cast<int>(i),
                 .t1 = direction * d,
                 .clock = at.time.value,
                 .quadrature = {at.x, at.y}};
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
    case ArcKind::saturated:
      advance_saturated(shot, scene, anchor, start, direction, at, next_row);
      break;
    case ArcKind::boundary: {
      start.field = &boundary_;
      start.state = {at.phi};
      start.parameter = {at.V};
      const Jet x = at.x, y = at.y;
      arrive(shot, start, at);
      at.lambda_phi += anchor.lambda_x * (at.y - y) - anchor.lambda_y * (at.x - x);
      break;
    }
  }
  at.time += direction * d;
}

void DiskProblem::advance_saturated(Shot& shot, const Scaled<Jet>& scene, const Anchor& anchor, ArcStart& start, int direction,
                       ChainPoint& at, std::size_t& next_row) const {
  const auto i = static_cast<std::size_t>(start.arc);
  const Jet d = duration(shot, i);
  const double scale = std::max(std::abs(d.value), std::numeric_limits<double>::min());
  const Jet V1 = at.V;
  const Jet V2 = V1 * V1;
  // From a boundary arc V' starts at 0, and Duffing's equation itself takes V off it.
  const bool from_boundary = before(i, direction) == ArcKind::boundary;
  const Jet acceleration = from_boundary ? Jet(0.0)
                                         : arcs_[i].sign * sqrt(scene.friction * scene.friction - V2 * (1.0 - V2),
                                                                "(k g)^2 - (V Omega)^2 at a junction");
  SwitchingStart<Jet> from(anchor.along(at.phi), V1, turning(V1), at.lambda_phi);
  from.switching = 0.0;  // by construction of every junction
  if (anchor_kind_ == ArcKind::free && before(i, direction) == ArcKind::free) from.G = 0.0;  // likewise: V = A, λφ = Ω
  start.field = &saturated_;
  start.state = {at.phi, 0.0, acceleration, at.lambda_phi};
  start.parameter = {anchor.lambda_x, anchor.lambda_y, V1, scale};
  start.quadrature = {at.x, at.y, 0.0, 0.0};
  const ArcEnd end = arrive(shot, start, at);
  at.V = V1 + scale * end.state[1];
  at.lambda_phi = end.state[3];

  const bool from_switch = before(i, direction) == ArcKind::saturated;
  const Jet S = from.at(end.state[1], end.quadrature[2], end.quadrature[3], scale);
  shot.row(next_row++, S / (from_switch ? d : d * d));
  const auto next = beyond(i, direction);
  if (next == ArcKind::free) shot.row(next_row++, at.V - anchor.along(at.phi));
  if (next == ArcKind::boundary) shot.row(next_row++, end.state[2]);
}

void DiskProblem::report(Shot& shot, const Scaled<Jet>& scene, const Anchor& anchor, const ChainPoint& left,
            const ChainPoint& right) const {
  const Jet &T = scene.time, &c = scene.speed;
  const double side = scene.side;
  // On a free arc λφ = Ω, with its sign; elsewhere Ω > 0.
  const Jet Omega = kind(0) == ArcKind::free ? left.lambda_phi : turning(left.V);
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
  shot.complete({-left.x.value, -left.y.value},
                {anchor.lambda_x.value, anchor.lambda_y.value, left.lambda_phi.value}, T.value);
}

std::shared_ptr<const Problem> make_problem(const Scene& scene, const Structure& structure) {
  return std::make_shared<DiskProblem>(scene, structure);
}

std::vector<double> parameters(const Scene& scene, bool with_friction) {
  std::vector<double> values{scene.x, scene.y, scene.heading, scene.radius, scene.speed, scene.gravity};
  if (with_friction) {
    if (!scene.friction) throw BadInput("the scene has no friction coefficient, but the structure needs one");
    values.push_back(*scene.friction);
  }
  return values;
}

}  // namespace costate::disk
