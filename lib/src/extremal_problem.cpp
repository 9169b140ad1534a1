#include "extremal_problem.hpp"

#include <costate/error.hpp>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <numeric>

namespace costate {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

/// Is the control of such an arc fixed by a bound or a mixed constraint?
bool held(ArcKind kind) { return kind == ArcKind::bang || kind == ArcKind::mixed; }

/// The nominal value of a state at an end, for guesses.
double guess_at(const State& state, bool at_end) {
  const auto& here = at_end ? state.end : state.start;
  const auto& there = at_end ? state.start : state.end;
  return here ? *here : state.guess ? *state.guess : there.value_or(0.0);
}

}  // namespace

ExtremalProblem::ExtremalProblem(ExtremalStatement statement)
    : s_(std::move(statement)),
      n_(s_.states.size()),
      cyclic_(static_cast<std::size_t>(s_.cyclic)),
      durations_(s_.arcs.size()) {
  for (const auto& arc : s_.arcs) structure_.push_back(arc.name);
  state_parameters();
  state_start();
  state_durations();
  state_junctions();
  state_end();
  if (rows_.size() != unknowns_.size()) {
    throw BadInput(
        fmt::format("the statement gives {} rows for {} unknowns: with these arcs a condition is missing or one too many (a "
                    "singular arc can "
                    "stand neither first nor last; a boundary arc after a singular one needs an arc after it)",
                    rows_.size(), unknowns_.size()));
  }
  guess_costates();
}

std::size_t ExtremalProblem::add_unknown(Unknown unknown) {
  unknowns_.push_back(std::move(unknown));
  return unknowns_.size() - 1;
}

std::size_t ExtremalProblem::add_parameter(Parameter parameter) {
  parameters_.push_back(std::move(parameter));
  return parameters_.size() - 1;
}

double ExtremalProblem::costate_scale(std::size_t state) const {
  // How large costates are is seldom known beforehand. A scale too large does little harm, but one too small makes every Newton step
  // from a bad guess too short.
  const State& s = s_.states[state].second;
  return s.costate_scale > 0.0 ? s.costate_scale : std::max(std::abs(s.costate.value_or(0.0)), 10.0 / s.scale);
}

void ExtremalProblem::state_parameters() {
  parameters_ = s_.parameters;
  const auto place = [this](const std::string& name, const std::string& unit, const std::optional<double>& value) {
    return value ? std::optional(add_parameter({name, unit, *value})) : std::nullopt;
  };
  for (const auto& [name, control] : s_.controls) {
    lower_parameter_.push_back(place(name + "_lower", control.unit, control.lower));
    upper_parameter_.push_back(place(name + "_upper", control.unit, control.upper));
  }
  for (const auto& [name, state] : s_.states) {
    start_parameter_.push_back(place(name + "_start", state.unit, state.start));
    end_parameter_.push_back(place(name + "_end", state.unit, state.end));
  }
  if (!s_.free_time) time_parameter_ = add_parameter({"final_time", "s", s_.time});
}

void ExtremalProblem::state_start() {
  start_unknown_.resize(n_);
  costate_unknown_.resize(n_);
  for (std::size_t i = 0; i < n_; ++i) {
    const auto& [name, state] = s_.states[i];
    if (!state.start) {
      start_unknown_[i] = add_unknown({.name = name + "_start", .scale = state.scale, .guess = guess_at(state, false)});
    }
    // λ(0) of a free value is 0 unless a function of the ends enters; that may depend on the other end too, so it takes a row.
    if (!state.start && !has_end_functions()) continue;
    costate_unknown_[i] = add_unknown(
        {.name = "lambda_" + name, .scale = costate_scale(i), .guess = state.costate.value_or(0.0)});
    if (!state.start) add_row(fmt::format("transversality of {} at the start", name), costate_scale(i));
  }
}

void ExtremalProblem::state_durations() {
  double left = s_.time;
  std::size_t unknown = 0;
  for (const auto& arc : s_.arcs) {
    left -= arc.known.duration;
    if (arc.known.duration == 0.0) ++unknown;
  }
  if (unknown > 0 && !(left > 0.0)) {
    throw BadInput(fmt::format("the durations given for the arcs leave {:g} s of {:g} s for the other arcs: more than 0",
                               left, s_.time));
  }
  duration_unknown_.resize(s_.arcs.size());
  for (std::size_t a = 0; a < s_.arcs.size(); ++a) {
    const double given = s_.arcs[a].known.duration;
    durations_[a] = given != 0.0 ? given : left / static_cast<double>(unknown);
    if (!s_.free_time && a + 1 == s_.arcs.size()) continue;
    duration_unknown_[a] = add_unknown({fmt::format("duration {}", a + 1), durations_[a], 0.0, infinity, durations_[a]});
  }
}

std::vector<ExtremalProblem::Condition> ExtremalProblem::conditions(std::size_t j) const {
  const ExtremalStatement::PlacedArc &before = s_.arcs[j], &after = s_.arcs[j + 1];
  const ArcKind a = before.arc->kind(), b = after.arc->kind();
  const ExtremalStatement::Junction& junction = s_.junctions[j];
  using enum Condition;
  if (junction.touched >= 0) {
    if (a != ArcKind::interior || b != ArcKind::interior) {
      throw BadInput(fmt::format("a constraint is touched between two interior arcs, not between '{}' and '{}'", before.name,
                                 after.name));
    }
    return {s_.constraints[static_cast<std::size_t>(junction.touched)].order > 1 ? touch : touch_first_order};
  }
  std::vector<Condition> all;
  if (junction.row) {
    if (b == ArcKind::boundary) return {user, boundary};
    return {user};
  }
  const auto unmarked = [&] {
    return BadInput(
        fmt::format("nothing marks the junction between arc {} '{}' and arc {} '{}': state a row for it with junction()",
                    j + 1, before.name, j + 2, after.name));
  };
  if (same_control(j, j + 1)) throw unmarked();
  if (s_.controls.size() > 1) return {continuous_h};
  if (a == ArcKind::boundary) all.push_back(switching_before);
  switch (b) {
    case ArcKind::singular:
      if (a == ArcKind::singular) break;
      return {switching_after, switching_rate_after};
    case ArcKind::boundary:
      if (a != ArcKind::singular && a != ArcKind::boundary) all.push_back(switching_after);
      all.push_back(boundary);
      return all;
    case ArcKind::interior:
      if (held(a)) return {switching_before};
      if (a == ArcKind::interior) break;
      return all;
    case ArcKind::bang:
    case ArcKind::mixed:
      if (a == ArcKind::interior) return {switching_after};
      if (a == ArcKind::bang && b == ArcKind::bang) return {bangs};
      if (!held(a)) return all;
      if (before.side == 0 || after.side == 0) break;
      return {before.side == after.side ? continuous_u : bangs};
  }
  throw unmarked();
}

bool ExtremalProblem::same_control(std::size_t before, std::size_t after) const {
  const ExtremalArc &a = *s_.arcs[before].arc, &b = *s_.arcs[after].arc;
  if (a.kind() != ArcKind::bang || b.kind() != ArcKind::bang) return false;
  // The controls of these arcs depend on nothing but the bounds.
  std::vector<Jet> x(2 * n_ + s_.parameters.size());
  for (const auto& [name, control] : s_.controls) {
    x.emplace_back(control.lower.value_or(-infinity));
    x.emplace_back(control.upper.value_or(infinity));
  }
  const std::vector<Jet> u = a.control(x), v = b.control(x);
  return std::equal(u.begin(), u.end(), v.begin(), [](const Jet& i, const Jet& j) { return i.value == j.value; });
}

void ExtremalProblem::state_junctions() {
  for (std::size_t j = 0; j < s_.junctions.size(); ++j) {
    Junction junction{.conditions = conditions(j)};
    const std::string at = fmt::format(" at t{}", j + 1);
    const auto meet = [&](int constraint, int multipliers, int rows, const std::vector<double>& guesses) {
      junction.constraint = constraint;
      junction.multiplier = unknowns_.size();
      junction.multipliers = static_cast<std::size_t>(multipliers);
      const std::string& name = s_.constraints[static_cast<std::size_t>(constraint)].name;
      // A multiplier is a jump of costates, over a gradient.
      double scale = 1.0;
      for (std::size_t i = 0; i < n_; ++i) scale = std::max(scale, costate_scale(i));
      for (std::size_t i = 0; i < junction.multipliers; ++i) {
        const double guess = i < guesses.size() ? guesses[i] : 0.0;
        add_unknown({fmt::format("{}multiplier of {}{}", i == 0 ? "" : "second ", name, at),
                     std::max(scale, std::abs(guess)), 0.0, infinity, guess});
      }
      add_row(name + at);
      if (rows > 1) add_row(fmt::format("rate of {}{}", name, at));
    };
    for (const Condition condition : junction.conditions) {
      switch (condition) {
        case Condition::user: add_row(s_.junctions[j].name + at); break;
        case Condition::continuous_h:
        case Condition::bangs: add_row("continuity of H" + at); break;
        case Condition::continuous_u: add_row("continuity of the control" + at); break;
        case Condition::switching_before:
        case Condition::switching_after: add_row("switching function" + at); break;
        case Condition::switching_rate_after: add_row("rate of the switching function" + at); break;
        case Condition::touch: meet(s_.junctions[j].touched, 1, 2, {s_.junctions[j].multiplier}); break;
        case Condition::touch_first_order:
          meet(s_.junctions[j].touched, 1, 1, {s_.junctions[j].multiplier});
          add_row("continuity of H" + at);
          break;
        case Condition::boundary: {
          const auto& arc = s_.arcs[j + 1];
          const int order = s_.constraints[static_cast<std::size_t>(arc.constraint)].order;
          meet(arc.constraint, order, order, arc.known.multipliers);
          break;
        }
      }
    }
    junctions_.push_back(std::move(junction));
  }
}

void ExtremalProblem::state_end() {
  for (std::size_t i = 0; i < n_; ++i) {
    const auto& [name, state] = s_.states[i];
    add_row(fmt::format("{} of {} at the end", state.end ? "value" : "transversality", name),
            state.end ? state.scale : costate_scale(i));
  }
  for (const auto& [name, condition] : s_.end_conditions) {
    end_multiplier_.push_back(add_unknown({.name = "multiplier of " + name}));
    add_row(name);
  }
  if (s_.free_time) add_row("H at the end");
}

void ExtremalProblem::guess_costates() {
  GuessedMotion motion{Eigen::VectorXd(n_), Eigen::VectorXd(n_), durations_};
  for (std::size_t i = 0; i < n_; ++i) {
    const State& state = s_.states[i].second;
    if (state.costate) return;
    motion.start[static_cast<Eigen::Index>(i)] = guess_at(state, false);
    motion.end[static_cast<Eigen::Index>(i)] = guess_at(state, true);
  }
  std::vector<int> constraint;
  std::vector<std::size_t> multipliers;
  for (const Junction& junction : junctions_) {
    constraint.push_back(junction.constraint);
    multipliers.push_back(junction.multipliers);
  }
  estimate_ = estimate_costates(s_, motion, constraint, multipliers);
  if (!estimate_) return;
  const auto set = [this](std::size_t unknown, double value) {
    unknowns_[unknown].guess = value;
    unknowns_[unknown].scale = std::max(unknowns_[unknown].scale, std::abs(value));
  };
  for (std::size_t i = 0; i < n_; ++i) {
    if (costate_unknown_[i]) set(*costate_unknown_[i], estimate_->start[static_cast<Eigen::Index>(i)]);
  }
  for (std::size_t j = 0; j < junctions_.size(); ++j) {
    for (std::size_t i = 0; i < multipliers[j]; ++i) {
      Unknown& multiplier = unknowns_[junctions_[j].multiplier + i];
      if (multiplier.guess == 0.0)
        set(junctions_[j].multiplier + i, std::max(0.0, estimate_->multipliers[j][static_cast<Eigen::Index>(i)]));
    }
  }
  for (std::size_t i = 0; i < end_multiplier_.size(); ++i) {
    set(end_multiplier_[i], estimate_->end_multipliers[static_cast<Eigen::Index>(i)]);
  }
}

std::optional<Eigen::VectorXd> ExtremalProblem::state_guess(int arc, double fraction) const {
  const auto a = static_cast<std::ptrdiff_t>(arc);
  const double total = std::accumulate(durations_.begin(), durations_.end(), 0.0);
  const double before = std::accumulate(durations_.begin(), durations_.begin() + a, 0.0);
  const double way = (before + fraction * durations_[static_cast<std::size_t>(arc)]) / total;
  const auto rest = static_cast<Eigen::Index>(n_ - cyclic_);
  Eigen::VectorXd z(2 * rest);
  for (Eigen::Index i = 0; i < rest; ++i) {
    const State& state = s_.states[cyclic_ + static_cast<std::size_t>(i)].second;
    z[i] = std::lerp(guess_at(state, false), guess_at(state, true), way);
    z[rest + i] = state.costate.value_or(0.0);
    if (!estimate_) continue;
    const Eigen::MatrixXd& along = estimate_->along[static_cast<std::size_t>(arc)];
    const double place = fraction * CostateEstimate::cells;
    const auto cell = std::min(static_cast<Eigen::Index>(place), along.cols() - 2);
    const Eigen::Index row = i + static_cast<Eigen::Index>(cyclic_);
    z[rest + i] = std::lerp(along(row, cell), along(row, cell + 1), place - static_cast<double>(cell));
  }
  return z;
}

std::vector<double> ExtremalProblem::point_of(const ArcPoint& point) const {
  const std::size_t rest = n_ - cyclic_;
  const Eigen::VectorXd& p = point.record->parameter;
  const auto index = [](std::size_t i) { return static_cast<Eigen::Index>(i); };
  std::vector<double> x;
  for (std::size_t i = 0; i < cyclic_; ++i) x.push_back(point.quadrature[index(i + 1)]);
  for (std::size_t i = 0; i < rest; ++i) x.push_back(point.state[index(i)]);
  for (std::size_t i = 0; i < cyclic_; ++i) x.push_back(p[index(i + 1)]);
  for (std::size_t i = 0; i < rest; ++i) x.push_back(point.state[index(rest + i)]);
  for (Eigen::Index i = index(cyclic_ + 1); i < p.size(); ++i) x.push_back(p[i]);
  return x;
}

std::vector<Column> ExtremalProblem::columns() const {
  std::vector<Column> columns;
  for (const auto& [name, state] : s_.states) columns.push_back({name, state.unit});
  for (const auto& [name, state] : s_.states)
    columns.push_back({"lambda_" + name, state.unit == "1" ? "1" : "1/(" + state.unit + ")"});
  for (const auto& [name, control] : s_.controls) columns.push_back({name, control.unit});
  columns.push_back({"H", "1/s"});
  return columns;
}

std::vector<double> ExtremalProblem::observe(const ArcPoint& point, const std::vector<double>&) const {
  std::vector<double> x = point_of(point);
  const ArcValues values = s_.arcs[static_cast<std::size_t>(point.record->arc)].arc->values(x);
  x.resize(2 * n_);
  x.insert(x.end(), values.control.begin(), values.control.end());
  x.push_back(values.hamiltonian);
  return x;
}

std::shared_ptr<const Problem> extremal_problem(ExtremalStatement statement) {
  check_statement(statement);
  return std::make_shared<ExtremalProblem>(std::move(statement));
}

}  // namespace costate
