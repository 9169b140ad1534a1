#include "tracer.hpp"

#include <costate/shooting/solve.hpp>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace costate {

Tracer::Tracer(std::shared_ptr<const Problem> problem, const std::vector<double>& parameters, std::size_t place, double to,
               const TraceOptions& options, const Restructure& restructure)
    : options_(options),
      restructure_(restructure),
      from_(parameters.at(place)),
      to_(to),
      curve_(std::make_unique<Curve>(std::move(problem), parameters, place, std::abs(to - from_), flow_options())),
      step_(options.first_step) {
  auto& landings = options_.landings;
  landings.push_back(to_);
  std::sort(landings.begin(), landings.end());
  landings.erase(std::unique(landings.begin(), landings.end()), landings.end());
}

FlowOptions Tracer::flow_options(double factor) const {
  constexpr double tightest = 1e-14;
  const double tolerance = std::max(tightest, factor * options_.tolerance);
  return {.tolerance = {.relative = tolerance, .absolute = tolerance}, .method = options_.method, .max_steps = options_.max_steps};
}

Branch Tracer::run(const Eigen::VectorXd& y, const std::optional<Eigen::VectorXd>& direction) {
  const double began = thread_seconds();
  open_stretch();
  if (begin(y, direction)) {
    while (step() == Step::goes_on) {
    }
  }
  add_cost(*curve_);
  branch_.cost.seconds = thread_seconds() - began;
  return std::move(branch_);
}

CorrectorOptions Tracer::corrector() const {
  return {.tolerance = 100.0 * options_.tolerance, .max_iterations = options_.max_iterations};
}

bool Tracer::begin(const Eigen::VectorXd& y, const std::optional<Eigen::VectorXd>& direction) {
  const Eigen::Index n = curve_->size();
  const Eigen::VectorXd forward = direction ? *direction : Eigen::VectorXd::Unit(n + 1, n) * (to_ > from_ ? 1.0 : -1.0);
  CorrectorOptions rough = corrector();
  rough.far = true;
  rough.max_iterations = 30;
  const auto start = curve_->correct(curve_->scaled(y, from_), {.kind = Constraint::Kind::parameter, .value = from_},
                                     forward, rough);
  if (!start) {
    branch_.message = fmt::format("no solution at the start of the branch: {}", curve_->failure());
    return false;
  }
  here_ = *start;
  for (Eigen::Index i = 0; i < here_.guards.size(); ++i) {
    if (here_.guards[i] >= 0.0) continue;
    branch_.message = fmt::format("the arc structure is wrong at the start of the branch: {} is {:.6g}",
                                  here_.shot->guards()[static_cast<std::size_t>(i)].name, here_.guards[i]);
    return false;
  }
  keep(here_);
  return true;
}

/// The nearest value to land on strictly beyond `from`, on the way to `to`; the start is the border on the way back.
std::optional<double> Tracer::next_landing(double from, double to) const {
  const auto& all = options_.landings;
  if (to > from) {
    const auto next = std::upper_bound(all.begin(), all.end(), from);
    if (next != all.end() && *next <= to) return *next;
    return from < from_ && to >= from_ ? std::optional(from_) : std::nullopt;
  }
  const auto next = std::lower_bound(all.begin(), all.end(), from);
  if (next != all.begin() && *std::prev(next) >= to) return *std::prev(next);
  return from > from_ && to <= from_ ? std::optional(from_) : std::nullopt;
}

Tracer::Step Tracer::step() {
  const long steps = integration_steps_ + curve_->statistics().steps;
  if (static_cast<int>(branch_.points.size()) >= options_.max_points || steps >= options_.max_integration_steps) {
    branch_.exhausted = true;
    return end(fmt::format("given up after {} points and {} integration steps", branch_.points.size(), steps));
  }
  while (step_ >= options_.smallest_step) {
    double used = step_;
    const std::optional<CurvePoint> next = advance(used);
    if (next && (stays_on_branch(*next) || step_ <= 10.0 * options_.smallest_step)) {
      const double wanted = step_;
      adapt(*next, used);
      if (used < wanted) step_ = std::max(step_, wanted);
      return accept(*next);
    }
    step_ *= 0.5;
  }
  return give_up();
}

/// A long first correction, or one that hardly shrinks, may lead to another branch beside this one (Allgower & Georg 2003, §6.1).
bool Tracer::stays_on_branch(const CurvePoint& next) const {
  constexpr double least_cosine = 0.95, most_of_step = 0.2, slowest = 0.3;
  constexpr double noise = 1e-6;  // corrections below do not tell
  const double length = (next.u - here_.u).lpNorm<Eigen::Infinity>();
  if (next.tangent.dot(here_.tangent) < least_cosine) return false;
  return next.first_correction <= noise || (next.first_correction <= most_of_step * length && next.contraction <= slowest);
}

/// The point at the step's length along the curve, or the value to land on that comes first; `used` is the length then.
std::optional<CurvePoint> Tracer::advance(double& used) {
  Eigen::VectorXd beyond = here_.u + step_ * here_.tangent;
  if (curvature_) beyond += 0.5 * step_ * step_ * *curvature_;
  const double now = here_.landed.value_or(curve_->parameter(here_.u));
  std::optional<double> landing = next_landing(now, curve_->parameter(beyond));
  if (!landing) {
    auto next = curve_->correct(beyond, {.kind = Constraint::Kind::plane, .normal = here_.tangent}, here_.tangent,
                                corrector());
    landing = next ? next_landing(now, curve_->parameter(next->u)) : std::nullopt;
    if (!landing) return next;
    beyond = next->u;
  }
  const double part = std::clamp((*landing - now) / (curve_->parameter(beyond) - now), 0.0, 1.0);
  used = part * step_;
  return curve_->correct(here_.u + part * (beyond - here_.u), {.kind = Constraint::Kind::parameter, .value = *landing},
                         here_.tangent, corrector());
}

/// Where no step leads on. A guard that is about to vanish, within a short way along the tangent and with next to no change of the
/// parameter, is why.
Tracer::Step Tracer::give_up() {
  constexpr double near = 0.1, next_to_none = 1e-6;
  Incident zero{.s = near, .point = here_};
  for (Eigen::Index i = 0; i < here_.guards.size(); ++i) {
    const double distance = here_.guard_rates[i] < 0.0 ? -here_.guards[i] / here_.guard_rates[i] : near;
    if (distance >= zero.s) continue;
    zero.s = distance;
    zero.guard = static_cast<std::size_t>(i);
  }
  if (zero.s == near || zero.s * std::abs(here_.tangent.tail(1)[0]) > next_to_none)
    return end(fmt::format("no further solution was found: {}", curve_->failure()));
  zero.error_bound = std::abs(curve_->parameter(zero.s * here_.tangent));
  record(zero, EventKind::limit);
  return end(fmt::format("{} all but vanishes, and no further solution was found: {}", branch_.events.back().name,
                         curve_->failure()));
}

/// The next step from the size of the first correction, the contraction of the second, and the angle between the tangents.
void Tracer::adapt(const CurvePoint& next, double used) {
  constexpr double wanted_correction = 0.02, wanted_contraction = 0.05, wanted_angle = 0.2;
  constexpr double least = 1e-12;
  const double angle = std::acos(std::clamp(next.tangent.dot(here_.tangent), -1.0, 1.0));
  const double factor = std::min({std::cbrt(wanted_correction / std::max(least, next.first_correction)),
                                  std::sqrt(wanted_contraction / std::max(least, next.contraction)),
                                  wanted_angle / std::max(least, angle)});
  const double growth = dead_ends_ > 0 ? 1.0 : 2.0;
  const double parameter_rate = std::max(least, std::abs(next.tangent.tail(1)[0]));
  step_ = std::min(options_.largest_step / parameter_rate, used * std::clamp(factor, 0.5, growth));
}

Tracer::Step Tracer::accept(CurvePoint next) {
  if (entangled(next)) {
    step_ = 0.5 * (next.u - here_.u).dot(here_.tangent);
    return Step::goes_on;
  }
  const long before = curve_->newton_iterations();
  const auto incident = first_incident(next);
  branch_.event_iterations += curve_->newton_iterations() - before;
  if (incident) {
    if (auto landed = landing_before(*incident)) return accept(std::move(*landed));
    if (land_at(*incident) == Step::done) return Step::done;
    if (incident->kind != EventKind::fold) return change_structure(*incident);
    if (pass_fold(*incident) == Step::done) return Step::done;
  }
  curvature_ = (next.tangent - here_.tangent) / std::max(1e-300, (next.u - here_.u).norm());
  here_ = std::move(next);
  landed_at_event_.reset();
  keep(here_);
  return arrive(here_);
}

/// Is a point the end of the branch?
Tracer::Step Tracer::arrive(const CurvePoint& point) {
  if (point.landed == to_) {
    branch_.reached = true;
    return Step::done;
  }
  if (point.landed == from_) return end("beyond a fold the branch comes back to the parameter it started from");
  return Step::goes_on;
}

Tracer::Step Tracer::end(std::string message) {
  branch_.message = fmt::format("the branch ends at {} = {:.12g}: {}", curve_->parameter_name(),
                                branch_.points.empty() ? from_ : branch_.points.back().parameter, message);
  return Step::done;
}

void Tracer::open_stretch() {
  branch_.stretches.push_back({curve_->shared_problem(), curve_->parameters(), curve_->place()});
  curvature_.reset();
  landed_at_event_.reset();
  dead_ends_ = 0;
}

BranchPoint Tracer::describe(const CurvePoint& point) const {
  const Eigen::Index n = curve_->size();
  BranchPoint result;
  result.parameter = point.landed.value_or(curve_->parameter(point.u));
  result.y = curve_->unknowns(point.u);
  result.tangent = point.tangent;
  const double rate = point.tangent[n] * curve_->parameter_scale();
  const Eigen::VectorXd slopes = curve_->unknowns(point.tangent) / rate;
  const auto& unknowns = curve_->problem().unknowns();
  for (Eigen::Index i = 0; i < n; ++i) {
    result.unknowns.push_back({unknowns[static_cast<std::size_t>(i)].name, "", result.y[i], slopes[i]});
  }
  result.reports = point.reports;
  result.stretch = branch_.stretches.size() - 1;
  result.requested = point.landed && std::binary_search(options_.landings.begin(), options_.landings.end(), *point.landed);
  result.iterations = point.iterations;
  return result;
}

void Tracer::keep(const CurvePoint& point) { branch_.points.push_back(describe(point)); }

void Tracer::add_cost(const Curve& curve) {
  branch_.cost.add(curve.statistics());
  branch_.cost.newton_iterations += curve.newton_iterations();
  integration_steps_ += curve.statistics().steps;
}

}  // namespace costate
