#include "arc_changes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace costate::disk {

namespace {

/// A chain that is being changed. Opening: the guard that vanishes at the junction and grows beyond.
struct Change {
  Chain chain;
  GuardPlace opening{};
  double size = 0.0;
  bool leads = true;  ///< the change in progress is that of the first guard: its opening is kept

  void insert(std::size_t at, const ArcSpan& arc) {
    chain.arcs.insert(chain.arcs.begin() + static_cast<std::ptrdiff_t>(at), arc);
    if (size > 0.0 && opening.arc >= at) ++opening.arc;
  }
  void remove(std::size_t at) {
    chain.arcs.erase(chain.arcs.begin() + static_cast<std::ptrdiff_t>(at));
    if (size > 0.0 && opening.arc > at) --opening.arc;
  }
  void open(GuardKind kind, std::size_t arc, double wanted) {
    if (leads) {
      opening = {kind, arc};
      size = wanted;
    }
  }
};

double sign(double value) { return value < 0.0 ? -1.0 : 1.0; }

/// A point of a free arc at the heading φ, on the side of `beside`.
ArcState free_state(const Chain& chain, double phi, const ArcState& beside) {
  const double A = chain.along(phi);
  const double Omega = sign(beside.lambda_phi) * std::sqrt(std::max(0.0, 1.0 - A * A));
  return {phi, A, chain.across(phi) * Omega, Omega};
}

ArcSpan saturated(const ArcState& at, double duration) {
  return {{ArcKind::saturated, sign(at.acceleration), sign(at.lambda_phi)}, duration, at, at};
}

/// The sign of Ω on a boundary arc is that of its neighbour.
ArcSpan boundary(const ArcSpan& neighbour, const ArcState& at, double duration) {
  return {{ArcKind::boundary, at.V * at.V > 0.5 ? 1.0 : -1.0, neighbour.type.turn, sign(at.V)}, duration, at, at};
}

/// Times and states on a free arc where A passes zero: friction is largest there, and equally large at all.
std::vector<std::pair<double, ArcState>> most_friction(const Chain& chain, const ArcSpan& arc) {
  constexpr int steps = 400;
  const double h = arc.duration / steps;
  ArcState at = arc.begin;
  const auto rate = [&](double phi, double lambda_phi) {
    return std::pair{lambda_phi, -chain.along(phi) * chain.across(phi)};
  };
  std::vector<std::pair<double, ArcState>> places;
  for (int i = 0; i < steps; ++i) {
    const auto [phi1, lambda1] = rate(at.phi, at.lambda_phi);
    const auto [phi2, lambda2] = rate(at.phi + 0.5 * h * phi1, at.lambda_phi + 0.5 * h * lambda1);
    ArcState next = at;
    next.phi += h * phi2;
    next.lambda_phi += h * lambda2;
    if ((chain.along(next.phi) < 0.0) != (chain.along(at.phi) < 0.0)) {
      places.emplace_back(h * (i + 0.5), free_state(chain, next.phi, next));
    }
    at = next;
  }
  return places;
}

/// A free arc that is cut by saturated ones, d long, where it uses most friction.
bool cut_inside(Change& change, std::size_t i, double d) {
  const auto places = most_friction(change.chain, change.chain.arcs[i]);
  if (places.empty()) return false;
  const ArcSpan whole = change.chain.arcs[i];
  const auto beside = [&](const ArcState& middle, double time) {
    return free_state(change.chain, middle.phi + time * middle.lambda_phi, middle);
  };
  double from = 0.0;
  std::size_t at = i;
  for (const auto& [time, middle] : places) {
    ArcSpan& before = change.chain.arcs[at];
    before.duration = std::max(d, time - 0.5 * d - from);
    before.end = beside(middle, -0.5 * d);
    from = time + 0.5 * d;
    change.insert(at + 1, saturated(middle, d));
    change.insert(at + 2, {{ArcKind::free}, std::max(d, whole.duration - from), beside(middle, 0.5 * d), whole.end});
    at += 2;
  }
  change.open(GuardKind::duration, i + 1, d);
  return true;
}

/// An arc that is left out, with what that leaves behind. False if the neighbours cannot meet.
bool without(Change& change, std::size_t i, double part) {
  auto& arcs = change.chain.arcs;
  const bool first = i == 0, last = i + 1 == arcs.size();
  if (first && last) return false;
  const ArcKind kind = arcs[i].type.kind;
  if (first || last) {
    const std::size_t neighbour = first ? 1 : i - 1;
    const ArcKind beside = arcs[neighbour].type.kind;
    GuardKind opening{};
    if (beside == ArcKind::free) {
      opening = first ? GuardKind::friction_at_start : GuardKind::friction_at_end;
      if (first) arcs[1].begin = free_state(change.chain, 0.0, arcs[1].begin);
    } else if (beside == ArcKind::boundary) {
      opening = first ? GuardKind::multiplier_at_start : GuardKind::multiplier_at_end;
    } else if (kind == ArcKind::boundary) {
      opening = first ? GuardKind::acceleration_at_start : GuardKind::acceleration_at_end;
    } else {
      opening = first ? GuardKind::switching_at_start : GuardKind::switching_at_end;
    }
    arcs[neighbour].duration += arcs[i].duration;
    change.remove(i);
    change.open(opening, first ? 0 : arcs.size() - 1, part);
    return true;
  }
  const ArcType &before = arcs[i - 1].type, &after = arcs[i + 1].type;
  if (before.kind == ArcKind::free && after.kind == ArcKind::free) {
    arcs[i - 1].duration += arcs[i].duration + arcs[i + 1].duration;
    arcs[i - 1].end = arcs[i + 1].end;
    change.remove(i + 1);
    change.remove(i);
    change.open(GuardKind::friction_inside, i - 1, part);
    return true;
  }
  if (before.kind != ArcKind::saturated || after.kind != ArcKind::saturated || before.sign == after.sign) return false;
  change.remove(i);
  change.open(kind == ArcKind::boundary ? GuardKind::acceleration_at_end : GuardKind::switching_at_end, i - 1, part);
  return true;
}

/// Applies what the vanishing of one guard asks for, with a new arc `part` long. False if nothing is known.
bool apply(Change& change, const GuardPlace& guard, double part) {
  auto& arcs = change.chain.arcs;
  const std::size_t i = guard.arc;
  if (i >= arcs.size()) return false;  // left out by another change
  ArcSpan& arc = arcs[i];
  const double d = part * std::min(1.0, arc.duration);
  const bool last = i + 1 == arcs.size();
  switch (guard.kind) {
    case GuardKind::duration: return without(change, i, part);
    case GuardKind::friction_at_start: {
      const ArcSpan born = saturated(arc.begin, d);
      arc.begin = free_state(change.chain, arc.begin.phi + d * arc.begin.lambda_phi, arc.begin);
      arc.duration -= d;
      change.insert(0, born);
      change.open(GuardKind::duration, 0, d);
      return true;
    }
    case GuardKind::friction_at_end:
      arc.duration -= d;
      change.insert(i + 1, saturated(arc.end, d));
      change.open(GuardKind::duration, i + 1, d);
      return true;
    case GuardKind::friction_inside: return cut_inside(change, i, d);
    case GuardKind::switching_at_start: {
      arc.duration -= d;
      const ArcState at = arc.begin;
      change.insert(0, {{ArcKind::free}, d, at, at});
      change.open(GuardKind::duration, 0, d);
      return true;
    }
    case GuardKind::switching_at_end: {
      arc.duration -= last ? d : 0.5 * d;
      if (!last) arcs[i + 1].duration -= 0.5 * d;
      const ArcState at = arc.end;
      change.insert(i + 1, {{ArcKind::free}, d, at, at});
      change.open(GuardKind::duration, i + 1, d);
      return true;
    }
    case GuardKind::acceleration_at_start: {
      const ArcSpan born = boundary(arc, arc.begin, d);
      change.insert(0, born);
      change.open(GuardKind::duration, 0, d);
      return true;
    }
    case GuardKind::acceleration_at_end: {
      const ArcSpan born = boundary(arc, arc.end, d);
      change.insert(i + 1, born);
      change.open(GuardKind::duration, i + 1, d);
      return true;
    }
    case GuardKind::turning_at_start:
    case GuardKind::turning_at_end:
    case GuardKind::multiplier_at_start:
    case GuardKind::multiplier_at_end: break;
  }
  return false;
}

bool at_start(GuardKind kind) {
  return kind == GuardKind::friction_at_start || kind == GuardKind::switching_at_start ||
         kind == GuardKind::acceleration_at_start;
}

}  // namespace

std::vector<Successor> arc_changes(const Scene& scene, const Junction& at) {
  const Chain chain = chain_of(at.problem, at.shot);
  const std::vector<GuardPlace> guards = guards_of(chain.structure(), true);
  // Of an arc without duration nothing else counts, nor the multiplier of a boundary arc beside it, which vanishes with it.
  const auto dies = [&](std::size_t arc) {
    return std::any_of(at.zeros.begin(), at.zeros.end(),
                       [&](std::size_t zero) { return guards[zero] == GuardPlace{GuardKind::duration, arc}; });
  };
  std::vector<std::size_t> zeros = at.zeros;
  std::erase_if(zeros, [&](std::size_t zero) {
    const auto [kind, arc] = guards[zero];
    return (kind != GuardKind::duration && dies(arc)) || (kind == GuardKind::multiplier_at_start && arc > 0 && dies(arc - 1)) ||
           (kind == GuardKind::multiplier_at_end && dies(arc + 1));
  });
  // Later arcs first, and at one arc the end first: what comes then keeps its place.
  std::vector<std::size_t> order = zeros;
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    const GuardPlace &p = guards[a], &q = guards[b];
    return p.arc != q.arc ? p.arc > q.arc : at_start(p.kind) < at_start(q.kind);
  });
  std::vector<Successor> candidates;
  const auto add = [&](const std::vector<std::size_t>& obeyed, double part) {
    Change change{chain};
    for (const std::size_t zero : obeyed) {
      change.leads = zero == zeros.front();
      if (!apply(change, guards[zero], part)) return;
    }
    Scene here = scene;
    here.friction = at.parameters.at(friction_place);
    const Structure structure = change.chain.structure();
    if (!objection_to(structure).empty()) return;
    candidates.push_back({make_problem(here, structure), unknowns(change.chain), name_of(change.opening), change.size});
  };
  const bool death = guards[zeros.front()].kind == GuardKind::duration;
  const std::array sizes = death ? std::array{1e-2, 1e-4, 1e-6} : std::array{2e-2, 2e-3, 1e-1};
  for (const double size : sizes) {
    add(order, size);
    if (order.size() > 1) add({zeros.front()}, size);
  }
  return candidates;
}

}  // namespace costate::disk
