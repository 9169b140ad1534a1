#include <costate/error.hpp>
#include <costate/extremal_statement.hpp>

#include <cmath>
#include <fmt/format.h>
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

}  // namespace

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
  if (!(s.time > 0.0 && std::isfinite(s.time))) {
    throw BadInput(
        fmt::format("final time = {:g} s is not admissible: a positive number, given by final_time() or free_final_time()",
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
