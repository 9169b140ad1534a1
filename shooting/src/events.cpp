/// What happens on a branch: folds and zeros of guards, located and passed.
#include "tracer.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace costate {

namespace {

/// A zero closer than this to a fold, in arclength, is what turns the branch back.
constexpr double same_place = 1e-4;
/// Farther away than this, a fold and a zero met in one step are told apart by a shorter one.
constexpr double separable = 1e-3;
/// A component of the tangent this small is none: near a fold p = p* + O(t_p²), so the square root of rounding is enough.
constexpr double level = 1e-9;
/// Events are located with integrations tighter by this than those of the branch.
constexpr double tighter = 0.01;

/// The point of a bracketed root of f between a (value fa) and b (value fb): the Illinois variant of the false position. `f`
/// gives nothing where it cannot be evaluated.
template <class F>
std::optional<double> root(const F& f, double a, double fa, double b, double fb, double small) {
  constexpr int most = 60;
  std::optional<double> best;
  for (int i = 0; i < most; ++i) {
    const double middle = std::clamp((a * fb - b * fa) / (fb - fa), std::min(a, b), std::max(a, b));
    const std::optional<double> value = f(middle);
    if (!value) return best;
    best = middle;
    if (std::abs(*value) <= small || std::abs(b - a) <= 1e-15) return best;
    if ((*value < 0.0) == (fb < 0.0)) {
      fa *= 0.5;
    } else {
      a = b;
      fa = fb;
    }
    b = middle;
    fb = *value;
  }
  return best;
}

/// Values by parameter name: those of the old problem where it has the parameter, else the new problem's own.
std::vector<double> carried_over(const Problem& old, const std::vector<double>& values, const Problem& next) {
  std::vector<double> result;
  for (const Parameter& parameter : next.parameters()) {
    const auto& all = old.parameters();
    const auto same = std::find_if(all.begin(), all.end(), [&](const Parameter& p) { return p.name == parameter.name; });
    result.push_back(same == all.end() ? parameter.value : values[static_cast<std::size_t>(same - all.begin())]);
  }
  return result;
}

}  // namespace

/// The first of what happens between the present point and the next.
std::optional<Tracer::Incident> Tracer::first_incident(const CurvePoint& next) {
  // Where the unknowns run away as the parameter nears a limit, its component of the tangent falls to rounding, and so does
  // its sign.
  const double before = here_.tangent.tail(1)[0], after = next.tangent.tail(1)[0];
  const bool turns = turns_back(next) && std::max(std::abs(before), std::abs(after)) > level;
  std::optional<Incident> first;
  for (Eigen::Index i = 0; i < next.guards.size(); ++i) {
    if (next.guards[i] >= 0.0) continue;
    Incident zero = locate_zero(next, static_cast<std::size_t>(i));
    if (!first || zero.s < first->s) first = std::move(zero);
  }
  if (turns) {
    std::optional<Incident> fold = locate_fold(next);
    if (fold && (!first || fold->s < first->s - same_place)) return fold;
  }
  return first;
}

bool Tracer::turns_back(const CurvePoint& next) const {
  return (next.tangent.tail(1)[0] < 0.0) != (here_.tangent.tail(1)[0] < 0.0);
}

bool Tracer::entangled(const CurvePoint& next) const {
  return turns_back(next) && (next.guards.array() < 0.0).any() && (next.u - here_.u).norm() > separable;
}

/// The value to land on that lies between the present point and an incident, if there is one.
std::optional<CurvePoint> Tracer::landing_before(const Incident& incident) {
  const double now = here_.landed.value_or(curve_->parameter(here_.u)), there = curve_->parameter(incident.point->u);
  const std::optional<double> landing = next_landing(now, there);
  if (!landing || std::abs(*landing - there) <= known_to(incident)) return std::nullopt;
  const Eigen::VectorXd predicted = here_.u + (*landing - now) / (there - now) * (incident.point->u - here_.u);
  auto point = curve_->correct(predicted, {.kind = Constraint::Kind::parameter, .value = *landing}, here_.tangent,
                               corrector());
  // A point that is beyond the incident all the same would meet it again.
  const bool beyond = point && ((point->guards.array() < 0.0).any() || turns_back(*point));
  return beyond ? std::nullopt : point;
}

/// Half the width in which the parameter of an incident is known to lie.
double Tracer::known_to(const Incident& incident) const {
  constexpr double least = 1e-12, most = 1e-9;
  return std::clamp(2.0 * incident.error_bound, least * curve_->parameter_scale(), most * curve_->parameter_scale());
}

Tracer::Step Tracer::land_at(const Incident& incident) {
  const double now = here_.landed.value_or(curve_->parameter(here_.u)), there = curve_->parameter(incident.point->u);
  const double width = known_to(incident);
  const std::optional<double> landing = next_landing(now, there + std::copysign(width, there - now));
  if (!landing || std::abs(*landing - there) > width || landed_at_event_ == landing) return Step::goes_on;
  landed_at_event_ = landing;
  CurvePoint point = *incident.point;
  point.landed = landing;
  keep(point);
  return arrive(point);
}

std::optional<CurvePoint> Tracer::at(double s, const CurvePoint& next) {
  // On the chord, moved along it to the plane at s: a prediction of second order is not worth its code here.
  const double whole = (next.u - here_.u).dot(here_.tangent);
  const Eigen::VectorXd predicted = here_.u + s / whole * (next.u - here_.u);
  return curve_->correct(predicted, {.kind = Constraint::Kind::plane, .normal = here_.tangent}, here_.tangent, corrector());
}

std::optional<Tracer::Incident> Tracer::locate_fold(const CurvePoint& next) {
  const Eigen::Index n = curve_->size();
  const double whole = (next.u - here_.u).dot(here_.tangent);
  std::optional<CurvePoint> found;
  const auto rate = [&](double s) -> std::optional<double> {
    auto point = at(s, next);
    if (!point) return std::nullopt;
    found = std::move(point);
    return found->tangent[n];
  };
  const auto s = root(rate, 0.0, here_.tangent[n], whole, next.tangent[n], level);
  if (!s) return std::nullopt;
  const double place = curve_->parameter(found->u);
  const double width = std::max(std::abs(place - curve_->parameter(here_.u)), std::abs(place - curve_->parameter(next.u)));
  Incident fold{.s = *s, .error_bound = width, .point = std::move(found)};
  // Once more with tighter integrations, between neighbours of the place found.
  curve_->set_flow_options(flow_options(tighter));
  const double beside = std::min(1e-3 * whole, 1e-3);
  const double before = std::max(0.0, *s - beside), after = std::min(whole, *s + beside);
  const auto low = rate(before), high = rate(after);
  if (low && high && (*low < 0.0) != (*high < 0.0) && root(rate, before, *low, after, *high, level)) {
    fold.error_bound = bound_from(*fold.point, *found);
    fold.point = std::move(found);
  }
  curve_->set_flow_options(flow_options());
  return fold;
}

Tracer::Incident Tracer::locate_zero(const CurvePoint& next, std::size_t guard) {
  const auto i = static_cast<Eigen::Index>(guard);
  const double whole = (next.u - here_.u).dot(here_.tangent);
  const double before = std::max(here_.guards[i], 0.0), after = next.guards[i];
  Incident zero{.kind = next.shot->guards()[guard].kind,
                .guard = guard,
                .error_bound = std::abs(curve_->parameter(next.u - here_.u))};
  const double part = before / (before - after);
  const Constraint constraint{.kind = Constraint::Kind::guard, .value = 0.0, .guard = guard};
  auto found = curve_->correct(here_.u + part * (next.u - here_.u), constraint, here_.tangent, corrector());
  constexpr double outside = 0.1;
  if (found) zero.s = (found->u - here_.u).dot(here_.tangent);
  zero.sure = found.has_value();
  if (!found || zero.s < -outside * whole || zero.s > (1.0 + outside) * whole) {
    zero.sure = false;
    found.reset();
    const auto value = [&](double s) -> std::optional<double> {
      auto point = at(s, next);
      if (!point) return std::nullopt;
      found = std::move(point);
      return found->guards[i];
    };
    zero.s = root(value, 0.0, before, whole, after, 1e-13).value_or(part * whole);
  }
  zero.point = found ? std::move(found) : next;
  sharpen(zero);
  return zero;
}

/// What the place of an event is known to, from locating it with looser and with tighter integrations: what that has changed, what Newton's
/// method left over, and rounding.
double Tracer::bound_from(const CurvePoint& loose, const CurvePoint& tight) const {
  // Where both are as tight as doubles allow, change and correction are samples of what rounding does: the next may be some times as large.
  constexpr double rounding = 8.0 * std::numeric_limits<double>::epsilon(), margin = 3.0;
  return margin * (std::abs(curve_->parameter(tight.u) - curve_->parameter(loose.u)) + tight.parameter_correction) +
         rounding * std::abs(curve_->parameter(tight.u));
}

void Tracer::sharpen(Incident& zero) {
  if (!zero.sure) return;
  curve_->set_flow_options(flow_options(tighter));
  CorrectorOptions tight = corrector();
  tight.tolerance *= tighter;
  auto point = curve_->correct(zero.point->u, {.kind = Constraint::Kind::guard, .value = 0.0, .guard = zero.guard},
                               here_.tangent, tight);
  curve_->set_flow_options(flow_options());
  if (!point) return;
  zero.error_bound = bound_from(*zero.point, *point);
  zero.point = std::move(point);
}

Tracer::Step Tracer::pass_fold(const Incident& fold) {
  const std::string structure = structure_name(curve_->problem());
  branch_.events.push_back({.kind = EventKind::fold,
                            .announced = EventKind::fold,
                            .name = "the branch turns back",
                            .point = describe(*fold.point),
                            .before = structure,
                            .after = structure,
                            .error_bound = fold.error_bound,
                            .position = branch_.points.size()});
  constexpr double same = 1e-7;
  const std::size_t count = branch_.events.size();
  const bool again = count > 1 && branch_.events[count - 2].kind == EventKind::fold &&
                     std::abs(branch_.events[count - 2].point.parameter - branch_.events[count - 1].point.parameter) <
                         same * curve_->parameter_scale();
  folds_in_place_ = again ? folds_in_place_ + 1 : 0;
  if (folds_in_place_ > 1) {
    branch_.events.resize(count - 1 - static_cast<std::size_t>(folds_in_place_));  // they were none
    return end("the branch turns back and forth in one place: its equations are singular there");
  }
  if (options_.through_folds) return Step::goes_on;
  return end("the branch turns back at a fold: there is no solution of this family beyond");
}

/// The guards that vanish with the one that was located, which comes first.
std::vector<std::size_t> Tracer::zeros_at(const Incident& zero) const {
  constexpr double together = 1e-9;  // in arclength
  std::vector<std::size_t> zeros{zero.guard};
  const CurvePoint& at = *zero.point;
  for (Eigen::Index i = 0; i < at.guards.size(); ++i) {
    if (static_cast<std::size_t>(i) == zero.guard || at.guard_rates[i] >= 0.0) continue;
    if (at.guards[i] <= together * std::max(1.0, -at.guard_rates[i])) zeros.push_back(static_cast<std::size_t>(i));
  }
  return zeros;
}

void Tracer::record(const Incident& zero, EventKind kind) {
  branch_.events.push_back({.kind = kind,
                            .announced = zero.point->shot->guards()[zero.guard].kind,
                            .name = zero.point->shot->guards()[zero.guard].name,
                            .point = describe(*zero.point),
                            .before = structure_name(curve_->problem()),
                            .after = {},
                            .error_bound = zero.error_bound,
                            .position = branch_.points.size()});
}

Tracer::Step Tracer::change_structure(const Incident& zero) {
  if (static_cast<int>(branch_.events.size()) >= options_.max_events) {
    return end(fmt::format("given up after {} events", branch_.events.size()));
  }
  std::vector<Successor> candidates;
  constexpr int patience = 2;  // near a dead end the place is known better, and a structure may be found after all
  if (restructure_ && zero.kind != EventKind::limit && dead_ends_ < patience) {
    const Eigen::VectorXd y = curve_->unknowns(zero.point->u);
    const std::vector<std::size_t> zeros = zeros_at(zero);
    std::vector<double> parameters = curve_->parameters();
    parameters[curve_->place()] = curve_->parameter(zero.point->u);
    candidates = restructure_({curve_->problem(), parameters, y, *zero.point->shot, zeros});
    record(zero, zero.kind);
    for (const Successor& candidate : candidates) {
      const Entry entry = enter(zero, candidate, branch_.events.size() - 1);
      if (entry == Entry::rigid) return stop_at_rigid();
      if (entry == Entry::ended) return Step::done;
      if (entry == Entry::open) return Step::goes_on;
    }
    branch_.events.pop_back();
  }
  return approach(zero);
}

/// A structure that holds for one value of the parameter only, whatever the costates: no motion near it is left beyond.
Tracer::Step Tracer::stop_at_rigid() {
  BranchEvent& event = branch_.events.back();
  event.kind = EventKind::limit;
  return end(fmt::format("{} vanishes at {:.12g}, where only one motion is left: beyond there is none near it", event.name,
                         event.point.parameter));
}

/// Up to where no structure is known beyond: the step is cut until the place is reached.
Tracer::Step Tracer::approach(const Incident& zero) {
  ++dead_ends_;
  constexpr double close = 1e-11, part = 0.7;
  const double distance = std::abs(zero.point->u.tail(1)[0] - here_.u.tail(1)[0]);
  step_ = part * std::min(step_, std::max(0.0, zero.s));
  if (distance > close && step_ > options_.smallest_step) return Step::goes_on;
  record(zero, EventKind::limit);
  // Nor is the place known better than steps are cut to.
  branch_.events.back().error_bound += std::max(distance, close) * curve_->parameter_scale();
  return end(fmt::format("{} vanishes, and no structure was found with which the branch goes on",
                         zero.point->shot->guards()[zero.guard].name));
}

/// The first point of a successor: that at which the opening guard has the wanted size, on the side where the guard grows.
std::optional<CurvePoint> Tracer::first_point(Curve& curve, const Successor& successor, double parameter) const {
  constexpr double slightly = 1e-9;  // a guard that vanishes with the opening one may be negative by rounding
  const Eigen::VectorXd u = curve.scaled(successor.y, parameter);
  const std::optional<std::size_t> opening = curve.guard_place(successor.opening, u);
  if (!opening) return std::nullopt;
  CorrectorOptions rough = corrector();
  rough.far = true;
  rough.max_iterations = 15;
  const Eigen::VectorXd forward = Eigen::VectorXd::Unit(u.size(), u.size() - 1);
  auto point = curve.correct(u, {.kind = Constraint::Kind::guard, .value = successor.size, .guard = *opening}, forward,
                             rough);
  if (!point || (point->guards.array() < -slightly).any()) return std::nullopt;
  const double rate = point->guard_rates[static_cast<Eigen::Index>(*opening)];
  if (rate < 0.0) {
    point->tangent = -point->tangent;
    point->guard_rates = -point->guard_rates;
  }
  return point;
}

/// Values to land on between the event and the first point, in the order in which the branch meets them. Nothing if one is
/// missed.
std::optional<std::vector<CurvePoint>> Tracer::landings_between(Curve& curve, double event, const CurvePoint& first) {
  std::vector<CurvePoint> points;
  const double end = curve.parameter(first.u);
  for (double at = event; const auto landing = next_landing(at, end);) {
    at = *landing;
    Eigen::VectorXd u = first.u;
    if (std::abs(first.tangent[curve.size()]) > 0.1)
      u += (at - end) / curve.parameter_scale() / first.tangent[curve.size()] * first.tangent;
    CorrectorOptions rough = corrector();
    rough.far = true;
    rough.max_iterations = 20;
    auto point = curve.correct(u, {.kind = Constraint::Kind::parameter, .value = at}, first.tangent, rough);
    if (!point || (point->guards.array() < 0.0).any()) return std::nullopt;
    points.push_back(std::move(*point));
    points.back().landed = at;
    if (at == end) break;
  }
  return points;
}

/// Finds the first point of the successor and goes on from there, if it is a solution there.
Tracer::Entry Tracer::enter(const Incident& zero, const Successor& successor, std::size_t event) {
  const double place = curve_->parameter(zero.point->u);
  auto next = std::make_unique<Curve>(successor.problem,
                                      carried_over(curve_->problem(), curve_->parameters(), *successor.problem),
                                      parameter_place(*successor.problem, curve_->parameter_name()),
                                      curve_->parameter_scale(), flow_options());
  const auto first = first_point(*next, successor, place);
  constexpr double standing = 1e-8;
  const bool rigid = first && std::abs(first->tangent.tail(1)[0]) < standing &&
                     std::abs(next->parameter(first->u) - place) < standing * curve_->parameter_scale();
  const auto between = first && !rigid ? landings_between(*next, landed_at_event_.value_or(place), *first) : std::nullopt;
  if (!between) {
    branch_.event_iterations += next->newton_iterations();
    add_cost(*next);
    if (rigid) branch_.events[event].after = structure_name(next->problem());
    return rigid ? Entry::rigid : Entry::closed;
  }
  branch_.event_iterations += next->newton_iterations();
  add_cost(*curve_);
  curve_ = std::move(next);
  open_stretch();
  branch_.events[event].after = structure_name(curve_->problem());
  if (!zero.sure) locate_from_beyond(*first, successor, event);
  for (const CurvePoint& point : *between) keep(point);
  here_ = *first;
  for (const CurvePoint& point : *between) {
    if (arrive(point) == Step::done) return Entry::ended;
  }
  keep(here_);
  return Entry::open;
}

/// Where the old structure is singular at its end the new one often is not: its opening guard vanishes at the event too.
void Tracer::locate_from_beyond(const CurvePoint& first, const Successor& successor, std::size_t event) {
  const auto opening = curve_->guard_place(successor.opening, first.u);
  if (!opening) return;
  const auto i = static_cast<Eigen::Index>(*opening);
  const Eigen::VectorXd u = first.u - first.guards[i] / first.guard_rates[i] * first.tangent;
  const Constraint vanishes{.kind = Constraint::Kind::guard, .value = 0.0, .guard = *opening};
  const auto loose = curve_->correct(u, vanishes, first.tangent, corrector());
  if (!loose) return;
  curve_->set_flow_options(flow_options(tighter));
  const auto tight = curve_->correct(loose->u, vanishes, first.tangent, corrector());
  curve_->set_flow_options(flow_options());
  if (!tight) return;
  branch_.events[event].point = describe(*tight);
  branch_.events[event].error_bound = bound_from(*loose, *tight);
}

}  // namespace costate
