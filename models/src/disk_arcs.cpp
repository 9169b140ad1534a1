/// Arcs of the rolling disk as data: where a chain is anchored, what guards its structure, how a chain is packed into unknowns.
#include "disk_problem.hpp"

#include <costate/error.hpp>

#include <algorithm>
#include <fmt/format.h>

namespace costate::disk {

const char* kind_name(ArcKind kind) {
  switch (kind) {
    case ArcKind::free: return "free";
    case ArcKind::saturated: return "saturated";
    case ArcKind::boundary: return "boundary";
  }
  return "";
}

std::string letters(const Structure& structure) {
  std::string text;
  for (const ArcType& arc : structure) text += arc.kind == ArcKind::free ? 'F' : arc.kind == ArcKind::saturated ? 'C' : 'B';
  return text;
}

namespace {

std::string objection_to(const ArcType& arc) {
  if (arc.kind == ArcKind::free) return {};
  for (const double sign : {arc.sign, arc.turn, arc.course}) {
    if (std::abs(sign) != 1.0) {
      return fmt::format("is {} with the signs {:g}, {:g}, {:g}, each of which must be 1 or -1", kind_name(arc.kind),
                         arc.sign, arc.turn, arc.course);
    }
  }
  return {};
}

/// Why two arcs cannot be neighbours.
std::string objection_to(const ArcType& a, const ArcType& b) {
  if (a.kind != ArcKind::saturated && b.kind != ArcKind::saturated) {
    return fmt::format("are {} and {}: one of two neighbours must be saturated", kind_name(a.kind), kind_name(b.kind));
  }
  if (a.kind == b.kind && a.sign == b.sign) return "are saturated with the same sign of V': they are one arc";
  if (a.kind == ArcKind::free || b.kind == ArcKind::free) return {};
  if (a.turn != b.turn) return "turn in opposite directions, but only a free arc passes from one to the other";
  // At the limit V'' = V(2V² − 1): away from V = 0 at V+, towards it at V−, and V' has that sign behind the boundary arc.
  if (b.kind == ArcKind::boundary && a.sign != -b.sign * b.course) return "do not meet: V' leads away from the limit";
  if (a.kind == ArcKind::boundary && b.sign != a.sign * a.course) return "do not part: V' leads beyond the limit";
  return {};
}

}  // namespace

std::string objection_to(const Structure& arcs) {
  if (arcs.empty()) return "the arc structure is empty: at least one arc is needed";
  const ArcType* limit = nullptr;
  for (std::size_t i = 0; i < arcs.size(); ++i) {
    if (const std::string why = objection_to(arcs[i]); !why.empty())
      return fmt::format("arc {} of the structure {}", i + 1, why);
    if (i > 0) {
      const std::string why = objection_to(arcs[i - 1], arcs[i]);
      if (!why.empty()) return fmt::format("arcs {} and {} of the structure {}", i, i + 1, why);
    }
    if (arcs[i].kind != ArcKind::boundary) continue;
    // Speeds between V− and V+ are beyond the limit, on whatever arc.
    if (limit != nullptr && (limit->sign != arcs[i].sign || (limit->sign > 0.0 && limit->course != arcs[i].course)))
      return fmt::format("arc {} of the structure is at a limit of V that an earlier one cannot come from", i + 1);
    limit = &arcs[i];
  }
  return {};
}

AnchorPlace anchor_of(const Structure& arcs) {
  for (const ArcKind wanted : {ArcKind::free, ArcKind::boundary}) {
    const auto found = std::find_if(arcs.begin(), arcs.end(), [&](const ArcType& a) { return a.kind == wanted; });
    if (found != arcs.end()) return {wanted, static_cast<std::size_t>(found - arcs.begin())};
  }
  return {ArcKind::saturated, arcs.size() > 1 ? 1u : 0u};
}

std::vector<GuardPlace> guards_of(const Structure& structure, bool limited) {
  std::vector<GuardPlace> guards;
  for (std::size_t i = 0; i < structure.size(); ++i) {
    const bool first = i == 0, last = i + 1 == structure.size();
    const bool switches = !last && structure[i + 1].kind == ArcKind::saturated;
    const auto add = [&](GuardKind kind) { guards.push_back({kind, i}); };
    add(GuardKind::duration);
    if (!limited) continue;
    switch (structure[i].kind) {
      case ArcKind::free:
        if (first) add(GuardKind::friction_at_start);
        if (last) add(GuardKind::friction_at_end);
        add(GuardKind::friction_inside);
        break;
      case ArcKind::saturated:
        if (first) add(GuardKind::switching_at_start);
        if (first) add(GuardKind::acceleration_at_start);
        if (last || switches) add(GuardKind::switching_at_end);
        if (last || switches) add(GuardKind::acceleration_at_end);
        add(GuardKind::turning_at_start);
        add(GuardKind::turning_at_end);
        break;
      case ArcKind::boundary:
        add(GuardKind::multiplier_at_start);
        add(GuardKind::multiplier_at_end);
        break;
    }
  }
  return guards;
}

std::string name_of(const GuardPlace& guard) {
  const auto arc = [&](const char* what) { return fmt::format("{} of arc {}", what, guard.arc + 1); };
  switch (guard.kind) {
    case GuardKind::duration: return arc("duration");
    case GuardKind::friction_at_start: return arc("friction left at the start");
    case GuardKind::friction_at_end: return arc("friction left at the end");
    case GuardKind::friction_inside: return arc("friction left inside");
    case GuardKind::switching_at_start: return arc("rate of lambda_V at the start");
    case GuardKind::switching_at_end: return arc("rate of lambda_V at the end");
    case GuardKind::acceleration_at_start: return arc("V' at the start");
    case GuardKind::acceleration_at_end: return arc("V' at the end");
    case GuardKind::turning_at_start: return arc("turning rate at the start");
    case GuardKind::turning_at_end: return arc("turning rate at the end");
    case GuardKind::multiplier_at_start: return arc("multiplier at the start");
    case GuardKind::multiplier_at_end: return arc("multiplier at the end");
  }
  return "";
}

namespace {

EventKind event_of(GuardKind kind) {
  switch (kind) {
    case GuardKind::duration: return EventKind::arc_death;
    case GuardKind::turning_at_start:
    case GuardKind::turning_at_end: return EventKind::limit;
    default: return EventKind::arc_birth;
  }
}

/// Does A pass zero on a free arc? V = cos ψ = A and Ω = sin ψ turn with ψ' = −A_φ, A_φ² = |λ|² − A².
bool passes_zero(const Anchor& anchor, const ArcEnds& ends, double duration) {
  if (duration <= 0.0) return false;
  const double pi = std::numbers::pi;
  const double lambda_x = anchor.lambda_x.value, lambda_y = anchor.lambda_y.value;
  const double lambda = std::hypot(lambda_x, lambda_y);
  const auto contains = [&](double a, double b) {  // an odd multiple of π/2
    const double low = std::min(a, b), high = std::max(a, b);
    return std::floor((high - pi / 2) / pi) > std::floor((low - pi / 2) / pi);
  };
  if (lambda < 1.0) {  // Ω keeps its sign: φ is monotone, A = |λ| cos(φ − arg λ)
    const double direction = std::atan2(lambda_y, lambda_x);
    return contains(ends.begin.phi.value - direction, ends.end.phi.value - direction);
  }
  // A_φ keeps its sign: ψ is monotone, half a turn takes ∫dψ/|A_φ| = 2K(1/|λ|)/|λ|, and less than that is seen at the ends
  if (lambda > 1.0 && duration >= 2.0 * std::comp_ellint_1(1.0 / lambda) / lambda) return true;
  const auto psi = [&](const ChainPoint& at) { return std::atan2(at.lambda_phi.value, anchor.along(at.phi).value); };
  const double begin = psi(ends.begin);
  return contains(begin, begin + std::remainder(psi(ends.end) - begin, 2.0 * pi));
}

}  // namespace

void DiskProblem::set_guards(Shot& shot, const Scaled<Jet>& scene, const Anchor& anchor,
                             const std::vector<ArcEnds>& ends) const {
  for (const GuardPlace& place : guards_) {
    const Jet value = place.kind == GuardKind::duration ? duration(shot, place.arc)
                                                        : guard(place, scene.friction, anchor, ends[place.arc]);
    shot.guard(event_of(place.kind), name_of(place), value);
  }
}

Jet DiskProblem::guard(const GuardPlace& place, const Jet& friction, const Anchor& anchor, const ArcEnds& ends) const {
  const ArcType& arc = arcs_[place.arc];
  const Jet d = ends.end.time - ends.begin.time;
  const Jet limit = friction * friction;
  const Jet lambda = anchor.lambda_x * anchor.lambda_x + anchor.lambda_y * anchor.lambda_y;
  const auto G = [&](const ChainPoint& at) {
    return anchor.along(at.phi) - at.lambda_phi * at.V / (arc.turn * sqrt(1.0 - at.V * at.V, "1 - V^2/c1^2"));
  };
  // A free arc takes Ω = λφ through zero, which Ω² would only touch.
  const auto turning = [&](const ChainPoint& at, const ArcType* neighbour) {
    return is(neighbour, ArcKind::free) ? arc.turn * at.lambda_phi : 1.0 - at.V * at.V;
  };
  const auto left = [&](const Jet& Omega) { return (limit - lambda * Omega * Omega) / limit; };
  switch (place.kind) {
    case GuardKind::friction_at_start: return left(ends.begin.lambda_phi);
    case GuardKind::friction_at_end: return left(ends.end.lambda_phi);
    case GuardKind::friction_inside: return passes_zero(anchor, ends, d.value) ? left(1.0) : Jet(1.0);
    // From a free arc G starts at 0, and is of the order of the duration squared at the end of the motion.
    case GuardKind::switching_at_start:
      return -arc.sign * (is(beyond(place.arc, +1), ArcKind::free) ? ends.begin.G / (d * d) : G(ends.begin));
    case GuardKind::switching_at_end:
      return arc.sign * (is(beyond(place.arc, -1), ArcKind::free) ? ends.end.G / (d * d) : G(ends.end));
    case GuardKind::acceleration_at_start: return arc.sign * ends.begin.acceleration;
    case GuardKind::acceleration_at_end: return arc.sign * ends.end.acceleration;
    case GuardKind::turning_at_start: return turning(ends.begin, before(place.arc, +1));
    case GuardKind::turning_at_end: return turning(ends.end, beyond(place.arc, +1));
    case GuardKind::multiplier_at_start: return -arc.sign * arc.course * G(ends.begin);
    case GuardKind::multiplier_at_end: return -arc.sign * arc.course * G(ends.end);
    case GuardKind::duration: break;
  }
  return d;
}

Structure Chain::structure() const {
  Structure types;
  for (const ArcSpan& arc : arcs) types.push_back(arc.type);
  return types;
}

double Chain::along(double phi) const { return lambda_x * std::cos(phi) + lambda_y * std::sin(phi); }

double Chain::across(double phi) const { return lambda_y * std::cos(phi) - lambda_x * std::sin(phi); }

Chain chain_of(const Problem& problem, const Shot& shot) {
  const auto* disk = dynamic_cast<const DiskProblem*>(&problem);
  if (disk == nullptr) throw BadInput("the problem is not one of a rolling disk");
  Chain chain;
  chain.arcs.resize(disk->arcs().size());
  for (const ArcRecord& record : shot.arcs()) {
    chain.lambda_x = record.constants[0];
    chain.lambda_y = record.constants[1];
    ArcSpan& arc = chain.arcs[static_cast<std::size_t>(record.arc)];
    arc.type = disk->arcs()[static_cast<std::size_t>(record.arc)];
    arc.duration += std::abs(record.t1 - record.t0);  // an arc may be cut
    const auto state = [&](const Eigen::VectorXd& z) -> ArcState {
      const double A = chain.along(z[0]);
      switch (arc.type.kind) {
        case ArcKind::free: return {z[0], A, chain.across(z[0]) * z[1], z[1]};
        case ArcKind::saturated: return {z[0], record.parameter[2] + record.parameter[3] * z[1], z[2], z[3]};
        case ArcKind::boundary: break;
      }
      const double V = record.parameter[0];
      return {z[0], V, 0.0, (1.0 - A * V) / (arc.type.turn * std::sqrt(1.0 - V * V))};  // S = 0
    };
    const bool backward = record.t1 < record.t0;
    const bool first = record.place.segment == 0;
    if (backward || first) arc.begin = state(backward ? record.end_state : record.state);
    if (!backward || first) arc.end = state(backward ? record.state : record.end_state);
  }
  return chain;
}

Eigen::VectorXd unknowns(const Chain& chain) {
  const AnchorPlace anchor = anchor_of(chain.structure());
  const ArcState& at = chain.arcs[anchor.first_forward].begin;
  std::vector<double> y;
  if (anchor.inside()) y.push_back(at.phi);
  if (anchor.kind == ArcKind::free) {
    y.push_back(std::atan2(at.lambda_phi, chain.along(at.phi)));
  } else {
    if (anchor.kind == ArcKind::saturated) {
      y.push_back(at.V);
      y.push_back(std::abs(at.acceleration));
    }
    y.push_back(chain.along(at.phi));
  }
  y.push_back(chain.across(at.phi));
  for (const ArcSpan& arc : chain.arcs) y.push_back(arc.duration);
  return Eigen::Map<const Eigen::VectorXd>(y.data(), static_cast<Eigen::Index>(y.size()));
}

}  // namespace costate::disk
