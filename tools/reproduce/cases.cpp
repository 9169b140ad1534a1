#include "cases.hpp"

#include "coulomb/coulomb_scene.hpp"
#include "disk/disk_scene.hpp"
#include "drag/drag_scene.hpp"
#include "normal/normal_scene.hpp"

#include <costate/models/cycloid.hpp>

#include <cmath>
#include <fmt/format.h>
#include <stdexcept>

namespace costate::reproduce {

namespace {

/// Moves the values of a case into a scene; a name that the model does not know is a mistake in the data.
template <class Scene>
Scene scene_of(const Case& wanted, const std::map<std::string, double Scene::*>& flags, Scene scene = {}) {
  for (const auto& [name, value] : wanted.scene) {
    const auto flag = flags.find(name);
    if (flag == flags.end()) throw std::runtime_error(fmt::format("{} has no scene value '{}'", wanted.model, name));
    scene.*(flag->second) = value;
  }
  return scene;
}

Computed by_name(const std::vector<Quantity>& quantities) {
  Computed computed;
  for (const Quantity& quantity : quantities) computed[quantity.name] = quantity;
  return computed;
}

/// The thresholds of a scene are exact up to rounding.
void add_limits(const tools::Outcome& outcome, Computed& computed) {
  for (const tools::SceneValue& limit : outcome.limits) {
    if (limit.value) computed[limit.name] = {limit.name, limit.unit, *limit.value, 1e-14 * std::abs(*limit.value)};
  }
}

const tools::Outcome& solved(const Case& wanted, const tools::Outcome& outcome) {
  if (outcome.solved()) return outcome;
  throw std::runtime_error(fmt::format("{}: {}", wanted.model, outcome.message));
}

Computed disk_case(const Case& wanted, const SolveOptions& options) {
  disk::Scene scene;
  for (const auto& [name, value] : wanted.scene) {
    if (name != "friction") throw std::runtime_error(fmt::format("disk has no scene value '{}'", name));
    scene.friction = value;
  }
  const disk::Outcome outcome = disk::solve_scene(scene, options);
  Computed computed = by_name(solved(wanted, outcome).quantities());
  add_limits(outcome, computed);
  // The extremes of friction have the error of the costates they are made of.
  for (const char* name : {"F_max", "F_min"}) computed.at(name).error_bound = computed.at("lambda_x").error_bound;
  return computed;
}

Computed coulomb_case(const Case& wanted, const SolveOptions& options) {
  using coulomb::Scene;
  const Scene scene = scene_of<Scene>(wanted, {{"drop", &Scene::drop}, {"span", &Scene::span}, {"mu", &Scene::friction}});
  tools::Outcome outcome;
  if (wanted.curve.empty()) {
    outcome = coulomb::solve_scene(scene, options);
    static_cast<void>(solved(wanted, outcome));
  } else {
    for (const coulomb::Curve curve : coulomb::curves) {
      constexpr double epsilon = 0.6;  // of the parabola in Table 1 of [K]
      if (wanted.curve == coulomb::name_of(curve)) outcome = coulomb::solve_curve(curve, scene, epsilon);
    }
  }
  Computed computed = by_name(outcome.quantities());
  add_limits(outcome, computed);
  if (const auto time = computed.find("final_time"); time != computed.end()) {
    const double unit = std::sqrt(scene.span / (2.0 * scene.gravity));
    computed["tau"] = {"tau", "1", time->second.value / unit, time->second.error_bound / unit};
  }
  if (wanted.curve == "cycloid") {
    const Cycloid c = cycloid(scene.span, -scene.drop, 0.0, scene.gravity).value();
    const double R = 0.25 / (scene.gravity * c.lambda_x * c.lambda_x);
    computed["C0"] = {"C0", "m", R, 1e-14 * R};
    computed["tau0"] = {"tau0", "rad", 2.0 * c.psi2, 1e-14};
  }
  return computed;
}

/// Models whose scenes have the same flags.
template <class Scene>
Scene bead_scene(const Case& wanted) {
  return scene_of<Scene>(wanted, {{"x", &Scene::x},
                                  {"y", &Scene::y},
                                  {"speed", &Scene::speed},
                                  {"mu", &Scene::mu},
                                  {"beta", &Scene::beta},
                                  {"gravity", &Scene::gravity}});
}

}  // namespace

const Computed& Cases::operator()(const Case& wanted) {
  auto found = solved_.find(wanted);
  if (found == solved_.end()) found = solved_.emplace(wanted, solve(wanted)).first;
  return found->second;
}

Computed Cases::solve(const Case& wanted) const {
  const SolveOptions options{.accuracy = accuracy_};
  if (wanted.model == "disk") return disk_case(wanted, options);
  if (wanted.model == "coulomb") return coulomb_case(wanted, options);
  if (wanted.model == "normal-friction") {
    return by_name(solved(wanted, normal_friction::solve_scene(bead_scene<normal_friction::Scene>(wanted), options)).quantities());
  }
  if (wanted.model == "drag") {
    return by_name(solved(wanted, drag::solve_scene(bead_scene<drag::Scene>(wanted), options)).quantities());
  }
  throw std::runtime_error(fmt::format("there is no model '{}'", wanted.model));
}

}  // namespace costate::reproduce
