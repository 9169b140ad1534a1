#include "corner_changes.hpp"

#include <cmath>

namespace costate::normal_friction {

namespace {

/// What is born: a jump, whose square is as the parameter; the turn of a first arc.
constexpr double newborn_jump = 0.01, newborn_turn = 1e-4;
/// Values of −H_θθ where a jump was, and of H less its other maximum where a first arc was.
constexpr double slight_curvature = 1e-4, slight_lead = 1e-4;

Side side_of(double sign) { return sign > 0.0 ? Side::left : Side::right; }

/// θ₂, τ₁, Δ and the push of an arc, see SlopeArc.
struct Piece {
  double theta2, left, turn;
  Push<double> push;
  explicit Piece(const Eigen::VectorXd& p) : theta2(p[0]), left(p[1]), turn(p[2]), push{p[4], p[5], p[6]} {}
};

/// The chain with arc i cut where −H_θθ is least; nothing if that is at one of its ends.
std::optional<Chain> cut(Chain chain, std::size_t i, const Piece& piece) {
  constexpr double margin = 1e-6;
  const double part = weakest_part(piece.push, piece.theta2, piece.left, piece.turn);
  ArcSpan& before = chain.arcs[i];
  if (part < margin || part > 1.0 - margin || before.turn < 2.0 * newborn_jump) return std::nullopt;
  // The jump passes over what curves the wrong way, half of it on each side.
  const double whole = before.turn;
  const ArcSpan after{.shape = {.turn = before.shape.turn, .jump = before.shape.turn},
                      .turn = std::max(newborn_jump, part * whole - 0.5 * newborn_jump),
                      .jump = newborn_jump};
  before.turn = std::max(newborn_jump, (1.0 - part) * whole - 0.5 * newborn_jump);
  chain.arcs.insert(chain.arcs.begin() + static_cast<std::ptrdiff_t>(i) + 1, after);
  return chain;
}

/// The chain without the corner before arc i.
Chain joined(Chain chain, std::size_t i) {
  chain.arcs[i - 1].turn += chain.arcs[i].turn + chain.arcs[i].jump;
  chain.arcs.erase(chain.arcs.begin() + static_cast<std::ptrdiff_t>(i));
  return chain;
}

/// The chain after an arc with the other slope of equal H; nothing if there is no other.
std::optional<Chain> with_first(Chain chain, const Piece& piece) {
  const SlopePoint<double> start(piece.push, piece.theta2, piece.left + piece.turn);
  const std::optional<double> other = BestSlope::other(start.hamiltonian(piece.push, piece.theta2), start.theta);
  if (!other) return std::nullopt;
  const double jump = std::remainder(start.theta - *other, 2.0 * std::numbers::pi);
  const SlopePoint<double> there(piece.push, piece.theta2, piece.left + piece.turn + jump);
  ArcSpan& next = chain.arcs.front();
  next.shape.jump = side_of(jump);
  next.jump = std::abs(jump);
  chain.arcs.insert(chain.arcs.begin(), {.shape = {.turn = side_of(there.d)}, .turn = newborn_turn});
  return chain;
}

Chain without_first(Chain chain) {
  chain.arcs.erase(chain.arcs.begin());
  chain.arcs.front().shape.jump = Side::left;
  chain.arcs.front().jump = 0.0;
  return chain;
}

}  // namespace

std::vector<Successor> corner_changes(const Scene& scene, const Junction& at) {
  const Chain chain = chain_of(at.problem, at.y);
  const auto successor = [&](const std::optional<Chain>& next, const std::string& opening, double size) {
    std::vector<Successor> found;
    if (next) found.push_back({make_problem(scene, next->structure()), unknowns(*next), opening, size});
    return found;
  };
  const auto piece = [&](std::size_t i) { return Piece(at.shot.arcs().at(i).parameter); };
  const std::string& name = at.shot.guards()[at.zeros.front()].name;
  if (name == lead_at_start) return successor(with_first(chain, piece(0)), turn_of_first_arc, newborn_turn);
  if (name == turn_of_first_arc) return successor(without_first(chain), lead_at_start, slight_lead);
  for (std::size_t i = 0; i < chain.arcs.size(); ++i) {
    if (name == curvature_of_arc(i)) return successor(cut(chain, i, piece(i)), jump_at_corner(i + 1), newborn_jump);
    if (i > 0 && name == jump_at_corner(i) && chain.arcs[i].shape.turn == chain.arcs[i - 1].shape.turn)
      return successor(joined(chain, i), curvature_of_arc(i - 1), slight_curvature);
  }
  return {};
}

}  // namespace costate::normal_friction
