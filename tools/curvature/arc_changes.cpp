#include "curvature/arc_changes.hpp"

#include "curvature/plan.hpp"

#include <cmath>

namespace costate::curvature {

namespace {

/// What an arc is born with: of a contact arc in ω, t and η² are as its square.
constexpr double newborn_flight = 1e-4, newborn_contact = 1e-2;
/// Values of the guards at the start after its first arc has gone: η, whose square is as the parameter; μ λv v − λθ.
constexpr double slight_force = 1e-2, slight_excess = 1e-4;
/// Between nodes, see make_plan.
constexpr double growth = 4.0;

/// The same motion with another arc before it.
Plan with_first(ArcPlan arc, Plan plan) {
  plan.arcs.insert(plan.arcs.begin(), std::move(arc));
  return plan;
}

/// A motion that ends in flight with a contact arc after it.
Plan with_last_contact(Plan plan, const std::vector<double>& parameters) {
  const double mu = parameters[mu_place], gravity = parameters[gravity_place];
  const double growth_of_friction = std::abs(parameters[beta_place]) * gravity * gravity;
  plan.arcs.push_back({ArcKind::contact, newborn_contact, {}});
  plan.eta_end = newborn_contact * std::cos(plan.theta_end) * (1.0 + mu * mu) / (6.0 * growth_of_friction);
  return plan;
}

Plan without_first(Plan plan) {
  plan.arcs.erase(plan.arcs.begin());
  return plan;
}

}  // namespace

std::vector<Successor> arc_changes(const Scene& scene, const Junction& at) {
  const Plan plan = with_new_nodes(plan_of(at.problem, at.y), at.shot, growth);
  const auto successor = [&](const Plan& next, const std::string& opening, double size) {
    return std::vector<Successor>{{make_problem(scene, next), unknowns(scene, next), opening, size}};
  };
  const std::string& name = at.shot.guards()[at.zeros.front()].name;
  if (name == end_switching)
    return successor(with_last_contact(plan, at.parameters), length_of_arc(plan.arcs.size()), newborn_contact);
  if (!scene.slope) return {};
  if (name == start_force)
    return successor(with_first({ArcKind::ballistic, newborn_flight, {}}, plan), length_of_arc(0), newborn_flight);
  if (name == start_switching)
    return successor(with_first({ArcKind::contact, newborn_contact, {}}, plan), length_of_arc(0), newborn_contact);
  if (name == length_of_arc(0) && plan.arcs.size() > 1) {
    return plan.arcs.front().kind == ArcKind::ballistic ? successor(without_first(plan), start_force, slight_force)
                                                        : successor(without_first(plan), start_switching, slight_excess);
  }
  return {};
}

}  // namespace costate::curvature
