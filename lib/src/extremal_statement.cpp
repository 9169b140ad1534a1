#include <costate/error.hpp>
#include <costate/extremal_statement.hpp>

#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <set>

namespace costate {

namespace {

void check_finite(const std::string& what, const std::optional<double>& value) {
  if (value && !std::isfinite(*value)) throw BadInput(fmt::format("{} = {:g} is not admissible: a number", what, *value));
}

void check_state(const std::string& name, const State& state) {
  check_finite("start of " + name, state.start);
  check_finite("end of " + name, state.end);
  check_finite("guess of " + name, state.guess);
  check_finite("costate of " + name, state.costate);
  if (!(state.scale > 0.0 && std::isfinite(state.scale))) {
    throw BadInput(fmt::format("scale of {} = {:g} is not admissible: a positive number", name, state.scale));
  }
  if (!(state.costate_scale >= 0.0 && std::isfinite(state.costate_scale))) {
    throw BadInput(
        fmt::format("costate scale of {} = {:g} is not admissible: a positive number, or 0", name, state.costate_scale));
  }
}

void check_control(const std::string& name, const Control& control) {
  check_finite("lower bound of " + name, control.lower);
  check_finite("upper bound of " + name, control.upper);
  check_finite("guess of " + name, control.guess);
  if (control.lower && control.upper && !(*control.lower < *control.upper)) {
    throw BadInput(fmt::format("lower bound of {} = {:g} is not admissible: below its upper bound {:g}", name,
                               *control.lower, *control.upper));
  }
  if (!(control.scale >= 0.0 && std::isfinite(control.scale))) {
    throw BadInput(fmt::format("scale of {} = {:g} is not admissible: a positive number, or 0", name, control.scale));
  }
}

/// Names that follow from the statement, see extremal_problem().
std::set<std::string> derived_names(const ExtremalStatement& s) {
  std::set<std::string> derived{"final_time"};
  for (const auto& [name, state] : s.states) {
    derived.insert({name + "_start", "lambda_" + name});
    if (state.end) derived.insert(name + "_end");
  }
  for (const auto& [name, control] : s.controls) {
    if (control.lower) derived.insert(name + "_lower");
    if (control.upper) derived.insert(name + "_upper");
  }
  return derived;
}

}  // namespace

void check_constant(const std::vector<std::pair<std::string, Control>>& controls, std::span<const double> values) {
  for (std::size_t i = 0; i < values.size(); ++i) {
    const auto& [name, control] = controls.at(i);
    const double infinity = std::numeric_limits<double>::infinity();
    const double lower = control.lower.value_or(-infinity), upper = control.upper.value_or(infinity);
    if (!(std::isfinite(values[i]) && values[i] >= lower && values[i] <= upper)) {
      throw BadInput(fmt::format("constant {} = {:g} of an arc is not admissible: a number within {:g} … {:g}", name,
                                 values[i], lower, upper));
    }
  }
}

int constraint_order(const std::string& name, int stated, const StateConstraint& constraint,
                     const std::vector<std::vector<double>>& points) {
  if (stated != 0 && stated != 1 && stated != 2) {
    throw BadInput(fmt::format("order of {} = {} is not admissible: 1, 2, or 0 to have it found", name, stated));
  }
  int found = 0;
  for (int order = 1; order <= 2 && found == 0; ++order) {
    for (const auto& x : points) {
      if (constraint.control_dependence(order, x) > 1e-10) found = order;
    }
  }
  if (stated != 0 && found != 0 && stated != found) {
    throw BadInput(
        fmt::format("order of {} = {} is not admissible: {}, as the control enters its time derivative of that order first",
                    name, stated, found));
  }
  if (stated != 0) return stated;
  if (found != 0) return found;
  throw BadInput(
      fmt::format("neither the first nor the second time derivative of the constraint {} depends on the control near the "
                  "ends: give its order, 1 or 2 (higher ones are not supported)",
                  name));
}

void check_statement(const ExtremalStatement& s) {
  std::set<std::string> names;
  const auto once = [&](const std::string& name) {
    if (name.empty()) throw BadInput("a state, control, parameter, constraint or condition has no name");
    if (!names.insert(name).second) throw BadInput(fmt::format("the name '{}' is used twice", name));
  };
  for (const auto& [name, state] : s.states) {
    once(name);
    check_state(name, state);
  }
  for (const auto& [name, control] : s.controls) {
    once(name);
    check_control(name, control);
  }
  for (const Parameter& parameter : s.parameters) {
    once(parameter.name);
    check_finite(parameter.name, parameter.value);
  }
  for (const auto& constraint : s.constraints) once(constraint.name);
  for (const auto& [name, constraint] : s.mixed) once(name);
  for (const auto& [name, condition] : s.end_conditions) once(name);
  for (const std::string& name : derived_names(s)) {
    if (names.contains(name)) {
      throw BadInput(fmt::format("the name '{}' is taken: it is derived from the statement, give another", name));
    }
  }
  if (!(s.time > 0.0 && std::isfinite(s.time))) {
    throw BadInput(
        fmt::format("final time = {:g} s is not admissible: a positive number, given by final_time() or free_final_time()",
                    s.time));
  }
  if (s.minimum_time && !s.free_time) {
    throw BadInput(fmt::format(
        "final time = {:g} s is not admissible for a system that minimises the time: leave it free, or state a cost()",
        s.time));
  }
  if (s.arcs.empty())
    throw BadInput("the problem has no arcs: state them in order of time with interior(), upper(), lower(), …");
  for (std::size_t a = 0; a < s.arcs.size(); ++a) {
    const double duration = s.arcs[a].known.duration;
    if (!(duration >= 0.0 && std::isfinite(duration))) {
      throw BadInput(fmt::format("duration of arc {} = {:g} s is not admissible: a positive number, or 0 for a share", a + 1,
                                 duration));
    }
  }
}

}  // namespace costate
