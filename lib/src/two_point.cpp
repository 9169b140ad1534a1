#include <costate/error.hpp>
#include <costate/two_point.hpp>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <iterator>
#include <set>

namespace costate {

namespace {

std::string value_name(const std::string& state, double point) { return fmt::format("{}({})", state, point); }

void check_finite(const std::string& name, double value) {
  if (!std::isfinite(value)) throw BadInput(fmt::format("{} = {} is not admissible: a finite number", name, value));
}

void check_scale(const std::string& name, double scale) {
  if (!(scale > 0.0 && std::isfinite(scale))) {
    throw BadInput(fmt::format("scale of {} = {} is not admissible: a positive number", name, scale));
  }
}

std::string joined(const std::vector<std::string>& names) {
  return names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", "));
}

template <class T>
void append_to(std::vector<T>& all, const std::vector<T>& more) {
  all.insert(all.end(), more.begin(), more.end());
}

/// A row's inputs as the row sees them.
Boundary<RowScalar> boundary(const std::vector<RowScalar>& inputs, std::size_t states) {
  const RowScalar* first = inputs.data();
  const std::size_t parameters = inputs.size() - 2 * states - 2;
  return {{first, states},
          {first + states, states},
          {first + 2 * states, parameters},
          inputs[2 * states + parameters],
          inputs[2 * states + parameters + 1]};
}
Interior<RowScalar> interior(const std::vector<RowScalar>& inputs, std::size_t states) {
  return {inputs[states], {inputs.data(), states}, {inputs.data() + states + 1, inputs.size() - states - 1}};
}

/// A row at jets, by the chain rule: only the inputs that move are differentiated, four in an evaluation.
template <class Row>
Jet through(const Row& row, const std::string& name, const std::vector<Jet>& inputs) {
  constexpr std::size_t width = 4;
  std::vector<RowScalar> values;
  std::vector<std::size_t> moving;
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    values.emplace_back(inputs[i].value);
    if (!inputs[i].gradient().empty()) moving.push_back(i);
  }
  Jet sum;
  std::size_t first = 0;
  do {
    std::vector<RowScalar> seeded = values;
    const std::size_t used = std::min(width, moving.size() - first);
    for (std::size_t j = 0; j < used; ++j) seeded[moving[first + j]].gradient[j] = 1.0;
    const RowScalar r = row(seeded);
    if (!isfinite(r)) throw LeftDomain(fmt::format("the row '{}' is not finite", name));
    for (std::size_t j = 0; j < used; ++j) sum += Jet::chain(inputs[moving[first + j]], 0.0, r.gradient[j]);
    sum.value = r.value;
    first += width;
  } while (first < moving.size());
  return sum;
}

}  // namespace

void throw_outside(std::size_t place, std::size_t size) {
  throw BadInput(fmt::format("value {} is read, there are {}, numbered from 0", place, size));
}

/// The statement as a shooting problem: one arc between neighbouring nodes.
class TwoPoint::Assembled final : public Problem {
 public:
  explicit Assembled(const TwoPoint& statement) : of_(statement) {
    std::set<double> nodes(of_.points_.begin(), of_.points_.end());
    for (const Condition& condition : of_.conditions_) {
      if (condition.point) nodes.insert(*condition.point);
    }
    nodes_.assign(nodes.begin(), nodes.end());
    for (std::size_t i = 0; i + 1 < nodes_.size(); ++i) {
      const auto piece = std::upper_bound(of_.points_.begin(), of_.points_.end(), nodes_[i]) - of_.points_.begin() - 1;
      fields_.push_back(of_.pieces_[static_cast<std::size_t>(piece)].get());
      structure_.push_back(fmt::format("{} … {}", node_name(i), node_name(i + 1)));
    }
    for (const NamedParameter& p : of_.parameters_) {
      if (p.known) parameters_.push_back({p.name, p.unit, p.guess});
    }
    const Eigen::VectorXd first = guess_at(nodes_.front());
    for (std::size_t i = 0; i < of_.states_.size(); ++i) {
      const NamedState& state = of_.states_[i];
      if (state.start) {
        parameters_.push_back({name_at(i, 0), state.unit, *state.start});
      } else {
        unknowns_.push_back({.name = name_at(i, 0), .scale = state.scale, .guess = first[static_cast<Eigen::Index>(i)]});
      }
    }
    for (std::size_t i = 0; i < of_.states_.size(); ++i) {
      const NamedState& state = of_.states_[i];
      if (!state.end) continue;
      parameters_.push_back({name_at(i, nodes_.size() - 1), state.unit, *state.end});
      rows_.push_back({name_at(i, nodes_.size() - 1), state.scale});
    }
    for (const NamedParameter& p : of_.parameters_) {
      if (!p.known) unknowns_.push_back({p.name, p.scale, p.lower, p.upper, p.guess});
    }
    if (of_.free_end_) {
      unknowns_.push_back(
          {.name = *of_.free_end_, .scale = of_.end_scale_, .lower = nodes_[nodes_.size() - 2], .guess = nodes_.back()});
    }
    for (const Condition& condition : of_.conditions_) rows_.push_back({condition.name, condition.scale});
  }

  [[nodiscard]] std::optional<Eigen::VectorXd> state_guess(int arc, double fraction) const override {
    const auto i = static_cast<std::size_t>(arc);
    return guess_at(std::lerp(nodes_[i], nodes_[i + 1], fraction));
  }

  void shoot(Shot& shot) const override {
    std::size_t unknown = 0, known = 0, row = 0;
    std::vector<Jet> p(of_.parameters_.size()), t(nodes_.begin(), nodes_.end());
    for (std::size_t i = 0; i < p.size(); ++i) {
      if (of_.parameters_[i].known) p[i] = shot.parameter(known++);
    }
    std::vector<std::vector<Jet>> y(1);
    for (const NamedState& state : of_.states_) {
      y[0].push_back(state.start ? shot.parameter(known++) : shot.unknown(unknown++));
    }
    for (std::size_t i = 0; i < p.size(); ++i) {
      if (!of_.parameters_[i].known) p[i] = shot.unknown(unknown++);
    }
    if (of_.free_end_) t.back() = shot.unknown(unknown);
    for (std::size_t i = 0; i < fields_.size(); ++i) {
      const ArcEnd end = shot.arc({.arc = static_cast<int>(i),
                                   .field = fields_[i],
                                   .t0 = t[i],
                                   .t1 = t[i + 1],
                                   .state = y[i],
                                   .parameter = p});
      y.emplace_back(end.state.begin(), end.state.end());
    }
    for (std::size_t i = 0; i < of_.states_.size(); ++i) {
      if (of_.states_[i].end) shot.row(row++, y.back()[i] - shot.parameter(known++));
    }
    for (const Condition& condition : of_.conditions_) shot.row(row++, value(condition, t, y, p));
    for (std::size_t node = 0; node < nodes_.size(); ++node) {
      for (std::size_t i = 0; i < of_.states_.size(); ++i) {
        const NamedState& state = of_.states_[i];
        if (node > 0 || state.start) shot.report(name_at(i, node), state.unit, y[node][i]);
      }
    }
  }

  [[nodiscard]] std::vector<Column> columns() const override {
    std::vector<Column> all{{"t", ""}};
    for (const NamedState& state : of_.states_) all.push_back({state.name, state.unit});
    return all;
  }
  [[nodiscard]] std::vector<double> observe(const ArcPoint& point, const std::vector<double>&) const override {
    std::vector<double> values{point.own};
    values.insert(values.end(), point.state.begin(), point.state.end());
    return values;
  }
  [[nodiscard]] std::vector<PathCheck> check(const ArcPoint&, const std::vector<double>&) const override { return {}; }

  /// Each row once, at the guess: what it reads must be there.
  void try_rows() const {
    const std::vector<Jet> t(nodes_.begin(), nodes_.end());
    std::vector<std::vector<Jet>> y;
    for (const double node : nodes_) {
      const Eigen::VectorXd at = guess_at(node);
      y.emplace_back(at.begin(), at.end());
    }
    std::vector<Jet> p;
    for (const NamedParameter& parameter : of_.parameters_) p.emplace_back(parameter.guess);
    for (const Condition& condition : of_.conditions_) {
      try {
        (void)value(condition, t, y, p);
      } catch (const LeftDomain&) {
        // A guess may lie where a row is not defined; whether the solve gets out of there is its own matter.
      } catch (const BadInput& wrong) {
        throw BadInput(fmt::format("row '{}': {}", condition.name, wrong.what()));
      }
    }
  }

 private:
  [[nodiscard]] std::string node_name(std::size_t node) const {
    return of_.free_end_ && node + 1 == nodes_.size() ? *of_.free_end_ : fmt::format("{}", nodes_[node]);
  }
  [[nodiscard]] std::string name_at(std::size_t state, std::size_t node) const {
    return fmt::format("{}({})", of_.states_[state].name, node_name(node));
  }

  [[nodiscard]] Eigen::VectorXd guess_at(double t) const {
    const auto n = static_cast<Eigen::Index>(of_.states_.size());
    if (of_.guess_) {
      const std::vector<double> y = of_.guess_(t);
      if (y.size() != of_.states_.size()) {
        throw BadInput(fmt::format("the guess has {} values at t = {}, the problem {} states", y.size(), t, n));
      }
      return Eigen::Map<const Eigen::VectorXd>(y.data(), n);
    }
    const double fraction = (t - nodes_.front()) / (nodes_.back() - nodes_.front());
    Eigen::VectorXd y(n);
    for (Eigen::Index i = 0; i < n; ++i) {
      const NamedState& state = of_.states_[static_cast<std::size_t>(i)];
      const double start = state.start.value_or(state.guess.value_or(state.end.value_or(0.0)));
      const double end = state.end.value_or(state.guess.value_or(start));
      y[i] = std::lerp(start, end, fraction);
    }
    return y;
  }

  /// g of a condition; t and y at the nodes.
  [[nodiscard]] Jet value(const Condition& condition, const std::vector<Jet>& t, const std::vector<std::vector<Jet>>& y,
                          const std::vector<Jet>& p) const {
    const std::size_t n = of_.states_.size();
    std::vector<Jet> inputs;
    if (condition.point) {
      const auto node = static_cast<std::size_t>(std::find(nodes_.begin(), nodes_.end(), *condition.point) - nodes_.begin());
      append_to(inputs, y[node]);
      inputs.push_back(t[node]);
      append_to(inputs, p);
      return through([&](const auto& x) { return condition.inside(interior(x, n)); }, condition.name, inputs);
    }
    append_to(inputs, y.front());
    append_to(inputs, y.back());
    append_to(inputs, p);
    append_to(inputs, {t.front(), t.back()});
    return through([&](const auto& x) { return condition.ends(boundary(x, n)); }, condition.name, inputs);
  }

  TwoPoint of_;
  std::vector<double>
      nodes_;  ///< a, the ends of the pieces and the points of interior rows, ascending; the last may be a guess
  std::vector<const Field*> fields_;  ///< of the arc that begins at each node
};

TwoPoint& TwoPoint::append(std::shared_ptr<const Field> field, double end) {
  for (const auto& [what, wanted, given] : {std::tuple{"states", states_wanted_, field->states()},
                                            std::tuple{"parameters", parameters_wanted_, field->parameters()}}) {
    if (wanted != given) {
      throw BadInput(fmt::format("the right-hand side up to {} has {} {}, the first one {}", end, given, what, wanted));
    }
  }
  pieces_.push_back(std::move(field));
  points_.push_back(end);
  return *this;
}

TwoPoint& TwoPoint::state(std::string name, TwoPointState state) {
  states_.push_back({{std::move(state)}, std::move(name)});
  return *this;
}

TwoPoint& TwoPoint::parameter(std::string name, double value, std::string unit) {
  parameters_.push_back({{.guess = value}, std::move(name), std::move(unit), true});
  return *this;
}

TwoPoint& TwoPoint::unknown_parameter(std::string name, FreeParameter free) {
  parameters_.push_back({{free}, std::move(name), "", false});
  return *this;
}

TwoPoint& TwoPoint::free_end(std::string name, double scale) {
  free_end_ = std::move(name);
  end_scale_ = scale;
  return *this;
}

TwoPoint& TwoPoint::row(std::string name, std::function<RowScalar(const Boundary<RowScalar>&)> g, double scale) {
  conditions_.push_back({std::move(name), scale, {}, std::move(g), {}});
  return *this;
}

TwoPoint& TwoPoint::row_at(std::string name, double point, std::function<RowScalar(const Interior<RowScalar>&)> g,
                           double scale) {
  conditions_.push_back({std::move(name), scale, point, {}, std::move(g)});
  return *this;
}

TwoPoint& TwoPoint::guess(std::function<std::vector<double>(double)> y) {
  guess_ = std::move(y);
  return *this;
}

std::shared_ptr<const Problem> TwoPoint::shared() const {
  check_points();
  check_states();
  check_parameters();
  check_names();
  auto problem = std::make_shared<Assembled>(*this);
  std::vector<std::string> unknowns, rows;
  for (const Unknown& unknown : problem->unknowns()) {
    unknowns.push_back(unknown.name);
    check_finite("guess of " + unknown.name, unknown.guess);
  }
  for (const Row& row : problem->rows()) rows.push_back(row.name);
  if (unknowns.size() != rows.size()) {
    throw BadInput(
        fmt::format("the problem has {} unknowns ({}) and {} conditions ({}) that could determine them: admissible "
                    "are as many conditions as unknowns",
                    unknowns.size(), joined(unknowns), rows.size(), joined(rows)));
  }
  if (unknowns.empty()) throw BadInput("the problem has no unknowns: every start value and every parameter is given");
  problem->try_rows();
  return problem;
}

void TwoPoint::check_points() const {
  for (const double point : points_) check_finite("point", point);
  for (std::size_t i = 0; i + 1 < points_.size(); ++i) {
    if (!(points_[i] < points_[i + 1])) {
      throw BadInput(
          fmt::format("point {} = {} is not admissible: above the one before it, {}", i + 1, points_[i + 1], points_[i]));
    }
  }
  for (const Condition& condition : conditions_) {
    check_scale("row '" + condition.name + "'", condition.scale);
    if (condition.point && !(*condition.point > points_.front() && *condition.point < points_.back())) {
      throw BadInput(fmt::format("point {} of row '{}' is not admissible: between {} and {}", *condition.point,
                                 condition.name, points_.front(), points_.back()));
    }
  }
  if (free_end_) check_scale(*free_end_, end_scale_);
}

void TwoPoint::check_states() const {
  if (static_cast<int>(states_.size()) != states_wanted_) {
    std::vector<std::string> names;
    for (const NamedState& state : states_) names.push_back(state.name);
    throw BadInput(
        fmt::format("the right-hand side has {} states, described are {} ({}): admissible is one .state() for each",
                    states_wanted_, states_.size(), joined(names)));
  }
  for (const NamedState& state : states_) {
    check_scale(state.name, state.scale);
    if (state.start) check_finite(value_name(state.name, points_.front()), *state.start);
    if (state.end) check_finite(free_end_ ? state.name + " at the end" : value_name(state.name, points_.back()), *state.end);
    if (state.guess) check_finite("guess of " + state.name, *state.guess);
  }
}

void TwoPoint::check_parameters() const {
  if (static_cast<int>(parameters_.size()) != parameters_wanted_) {
    std::vector<std::string> names;
    for (const NamedParameter& p : parameters_) names.push_back(p.name);
    throw BadInput(
        fmt::format("the right-hand side has {} parameters, described are {} ({}): admissible is one .parameter() or "
                    ".unknown_parameter() for each",
                    parameters_wanted_, parameters_.size(), joined(names)));
  }
  for (const NamedParameter& p : parameters_) {
    check_finite(p.known ? p.name : "guess of " + p.name, p.guess);
    check_scale(p.name, p.scale);
    if (!(p.guess > p.lower && p.guess < p.upper)) {
      throw BadInput(fmt::format("guess of {} = {} is not admissible: between its limits {} and {}", p.name, p.guess,
                                 p.lower, p.upper));
    }
  }
}

void TwoPoint::check_names() const {
  std::set<std::string> taken{"t"};
  const auto take = [&](const std::string& name) {
    if (name.empty()) throw BadInput("a name is '': admissible is any other text");
    if (!taken.insert(name).second) throw BadInput(fmt::format("the name '{}' is used twice (t is taken)", name));
  };
  for (const NamedState& state : states_) take(state.name);
  for (const NamedParameter& p : parameters_) take(p.name);
  if (free_end_) take(*free_end_);
}

}  // namespace costate
