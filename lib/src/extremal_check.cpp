// What must hold along an extremal besides the rows.
#include "extremal_problem.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace costate {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

/// A value relative to the magnitude of what cancels in it; as it is where that is 0.
double relative(double value, double size) { return size > 0.0 ? value / size : value; }

}  // namespace

std::vector<double> ExtremalProblem::Constants::packed() const {
  std::vector<double> all{start_hamiltonian, size, time, exit};
  all.insert(all.end(), gradient_size.begin(), gradient_size.end());
  all.insert(all.end(), entry.begin(), entry.end());
  return all;
}

ExtremalProblem::Constants ExtremalProblem::Constants::unpacked(const std::vector<double>& packed, std::size_t controls) {
  const auto first = packed.begin() + 4, second = first + static_cast<std::ptrdiff_t>(controls);
  return {packed.at(0), packed.at(1), {first, second}, packed.at(2), packed.at(3), {second, packed.end()}};
}

double ExtremalProblem::lower(const std::vector<double>& x, std::size_t control) const {
  return x[2 * n_ + s_.parameters.size() + 2 * control];
}
double ExtremalProblem::upper(const std::vector<double>& x, std::size_t control) const {
  return x[2 * n_ + s_.parameters.size() + 2 * control + 1];
}

std::vector<PathCheck> ExtremalProblem::check(const ArcPoint& point, const std::vector<double>&) const {
  const std::vector<double> x = point_of(point);
  const auto place = static_cast<std::size_t>(point.record->arc);
  const ExtremalStatement::PlacedArc& arc = s_.arcs[place];
  const ArcKind kind = arc.arc->kind();
  const ArcValues values = arc.arc->values(x);
  // H and its derivatives are known to the error of the largest terms that cancel in them, here or at an end of an arc: where all of
  // these vanish together, as H_u does along a singular arc, those here alone say nothing.
  Constants solution = Constants::unpacked(point.record->constants, s_.controls.size());
  solution.size = std::max(solution.size, values.size);
  for (std::size_t i = 0; i < s_.controls.size(); ++i)
    solution.gradient_size[i] = std::max(solution.gradient_size[i], values.gradient_size[i]);
  using enum PathCheck::Kind;
  std::vector<PathCheck> checks{
      {"H - its start value", zero, relative(values.hamiltonian - solution.start_hamiltonian, solution.size)}};
  check_control(x, place, values, solution, checks);
  if (kind == ArcKind::boundary || kind == ArcKind::mixed) check_boundary(x, place, values, solution, checks);
  for (std::size_t i = 0; i < s_.constraints.size(); ++i) {
    const double c = s_.constraints[i].constraint->value(x);
    const bool on = arc.constraint == static_cast<int>(i);
    checks.push_back({s_.constraints[i].name + (on ? " = 0 along it" : " <= 0"), on ? zero : nonnegative, on ? c : -c});
  }
  for (const auto& [name, constraint] : s_.mixed)
    checks.push_back({name + " <= 0", nonnegative, -constraint(x, values.control)});
  return checks;
}

void ExtremalProblem::check_control(const std::vector<double>& x, std::size_t arc, const ArcValues& values,
                                    const Constants& solution, std::vector<PathCheck>& checks) const {
  using enum PathCheck::Kind;
  const ArcKind kind = s_.arcs[arc].arc->kind();
  for (std::size_t i = 0; i < s_.controls.size(); ++i) {
    const std::string& name = s_.controls[i].first;
    const double least = lower(x, i), most = upper(x, i), u = values.control[i];
    const double slope = relative(values.control_gradient[i], solution.gradient_size[i]);
    if (least > -infinity) checks.push_back({name + " above its lower bound", nonnegative, u - least});
    if (most < infinity) checks.push_back({name + " below its upper bound", nonnegative, most - u});
    if (kind == ArcKind::bang && u == most) {
      checks.push_back({fmt::format("H_u of {} at its upper bound", name), nonnegative, slope});
    } else if (kind == ArcKind::bang && u == least) {
      checks.push_back({fmt::format("-H_u of {} at its lower bound", name), nonnegative, -slope});
    } else if (kind != ArcKind::boundary && kind != ArcKind::mixed) {
      checks.push_back({fmt::format("H_u of {} between its bounds", name), zero, slope});
    }
  }
  const double curvature = relative(values.curvature, values.curvature_size);
  if (kind == ArcKind::interior) checks.push_back({"-H_uu (Legendre)", nonnegative, -curvature});
  if (kind == ArcKind::singular) {
    checks.push_back({"-H_uu (Legendre) on the singular arc", zero, curvature});
    checks.push_back({"{H1, {H0, H1}} (Kelley)", nonnegative, relative(values.kelley, values.kelley_size)});
  }
  checks.push_back({"H - H at other controls", nonnegative, advantage(x, arc, values, solution.size)});
}

std::vector<std::vector<double>> ExtremalProblem::other_controls(const std::vector<double>& x,
                                                                 const std::vector<double>& control) const {
  std::vector<std::vector<double>> all;
  if (control.size() == 1) {
    const double least = lower(x, 0), most = upper(x, 0), reach = s_.control_scale[0];
    const double from = std::isfinite(least) ? least : std::min(control[0], most) - reach;
    const double to = std::isfinite(most) ? most : std::max(control[0], least) + reach;
    constexpr int parts = 8;
    for (int i = 0; i <= parts; ++i) all.push_back({std::lerp(from, to, static_cast<double>(i) / parts)});
    return all;
  }
  // The corners of the bounds; a control without both of them stays as it is. The number of corners is kept in bounds too.
  all.push_back(control);
  constexpr std::size_t most_corners = 256;
  for (std::size_t i = 0; i < control.size() && 2 * all.size() <= most_corners; ++i) {
    if (!std::isfinite(lower(x, i)) || !std::isfinite(upper(x, i))) continue;
    const std::size_t count = all.size();
    for (std::size_t j = 0; j < count; ++j) {
      all.push_back(all[j]);
      all[j][i] = lower(x, i);
      all.back()[i] = upper(x, i);
    }
  }
  return all;
}

double ExtremalProblem::advantage(const std::vector<double>& x, std::size_t arc, const ArcValues& values,
                                  double size) const {
  const auto n = static_cast<Eigen::Index>(n_), k = static_cast<Eigen::Index>(s_.controls.size());
  Eigen::VectorXd z(n + k);
  z.head(n) = Eigen::Map<const Eigen::VectorXd>(x.data(), n);
  const Eigen::Map<const Eigen::VectorXd> costate(x.data() + n, n),
      parameters(x.data() + 2 * n, static_cast<Eigen::Index>(s_.parameters.size()));
  // Where c = 0 a control must not lead beyond it: c^(r) ≤ 0.
  const auto admissible = [&](const std::vector<double>& u) {
    return s_.arcs[arc].arc->constraint(x, u) <= 0.0 &&
           std::all_of(s_.mixed.begin(), s_.mixed.end(), [&](const auto& mixed) { return mixed.second(x, u) <= 0.0; });
  };
  double least = infinity;
  for (const std::vector<double>& u : other_controls(x, values.control)) {
    if (!admissible(u)) continue;
    z.tail(k) = Eigen::Map<const Eigen::VectorXd>(u.data(), k);
    const Eigen::VectorXd f = s_.system->value(z, parameters);
    const Eigen::ArrayXd terms = costate.array() * f.head(n).array();
    const double h = terms.sum() - f[n];
    if (!std::isfinite(h)) continue;  // outside the model's domain
    least = std::min(least, relative(values.hamiltonian - h, std::max(size, terms.abs().sum() + std::abs(f[n]))));
  }
  return std::isfinite(least) ? least : 0.0;
}

bool ExtremalProblem::ends_free(const std::vector<double>& x, const StateConstraint& constraint) const {
  if (!s_.end_conditions.empty()) return false;
  std::vector<Jet> at(x.begin(), x.end());
  std::fill_n(at.begin() + static_cast<std::ptrdiff_t>(n_), n_, Jet(0.0));
  const std::vector<Jet> first = constraint.jump(at, {1.0, 0.0}), second = constraint.jump(at, {0.0, 1.0});
  // λ(T) is known up to multiples of c_q and of what is fixed at the end: c'_q must not be made of these.
  double aa = 0.0, ab = 0.0, bb = 0.0;
  for (std::size_t i = 0; i < n_; ++i) {
    if (s_.states[i].second.end) continue;
    aa += first[i].value * first[i].value;
    ab += first[i].value * second[i].value;
    bb += second[i].value * second[i].value;
  }
  constexpr double parallel = 1e-12;
  return bb > 0.0 && (aa == 0.0 || aa * bb - ab * ab > parallel * aa * bb);
}

void ExtremalProblem::check_boundary(const std::vector<double>& x, std::size_t arc, const ArcValues& values,
                                     const Constants& solution, std::vector<PathCheck>& checks) const {
  using enum PathCheck::Kind;
  const ExtremalStatement::PlacedArc& placed = s_.arcs[arc];
  const double slope = std::abs(values.constraint_slope);
  checks.push_back(
      {"multiplier of the arc " + placed.name, nonnegative, relative(values.multiplier, solution.gradient_size[0] / slope)});
  if (placed.constraint < 0) return;
  const auto& constraint = s_.constraints[static_cast<std::size_t>(placed.constraint)];
  const BoundaryLoad load = placed.arc->load(x);
  const double usual = solution.gradient_size[0] / (slope * std::pow(solution.time, constraint.order));
  checks.push_back({"multiplier of " + constraint.name, nonnegative, relative(load.eta, std::max(load.size, usual))});
  if (constraint.order > 1) {
    checks.push_back({"multiplier of " + constraint.name + " at the entry", nonnegative, solution.entry.at(arc)});
    if (arc + 1 == s_.arcs.size())
      checks.push_back({"multiplier of the arc " + placed.name + " at the end", zero, solution.exit});
  }
}

}  // namespace costate
