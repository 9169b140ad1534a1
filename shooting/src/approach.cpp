#include "approach.hpp"

#include "diagnosis.hpp"
#include "newton.hpp"

#include <costate/error.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <fmt/format.h>

namespace costate {

FlowOptions flow_options(const SolveOptions& options, double tolerance) {
  // What is shorter than this share of an arc, or of a segment of it, may be overlooked; the second opinion looks more closely.
  constexpr double longest_step = 1.0 / 32.0;
  return {.tolerance = {.relative = tolerance, .absolute = tolerance},
          .method = options.method,
          .max_steps = options.max_steps,
          .longest_step = longest_step};
}

NewtonResult kinsol(Shooting& shooting, Eigen::VectorXd& point, const SolveOptions& options, Cost& cost) {
  const NewtonOptions newton{.residual_tolerance = 10.0 * shooting.flow_options().tolerance.relative,
                             .step_tolerance = 1e-15,
                             .max_step = options.max_step * std::sqrt(static_cast<double>(shooting.size())),
                             .max_iterations = options.max_iterations,
                             .line_search = options.line_search};
  const NewtonResult result =
      Kinsol(shooting.size()).solve(shooting, point, shooting.unknown_scales(), shooting.row_scales(), newton);
  cost.newton_iterations += result.iterations;
  return result;
}

bool near_root(Termination termination) {
  return termination == Termination::converged || termination == Termination::small_step ||
         termination == Termination::stalled;
}

namespace {

/// Segments that grow so little are nearly linear, so that Newton's method gets far.
constexpr MeshOptions short_segments{.growth = 20.0};

}  // namespace

bool Approach::run(const Start& start, Eigen::VectorXd& point) {
  point = start.unknowns;
  // A segment that needs more steps than this is one too long.
  constexpr long most_steps = 2000;
  FlowOptions flow = flow_options(options_, tolerance_);
  flow.max_steps = std::min(flow.max_steps, most_steps);
  shooting_.set_flow_options(flow);
  shooting_.set_mesh({});
  if (!options_.homotopy) check_well_posed(shooting_, point);
  if (!(options_.homotopy ? follow_homotopy(start, point) : from_start(start, point))) {
    shooting_.set_mesh({});
    point = start.unknowns;
    return false;
  }
  if (!shooting_.cuts().empty()) cut_by_growth(point, {});
  return true;
}

bool Approach::from_start(const Start& start, Eigen::VectorXd& point) {
  constexpr int rounds = 40;
  const bool grows = options_.multiple && !stays_whole(start);
  if (!grows && whole(start, point)) return true;
  if (options_.multiple && cut_along(start, point) && globalise(point, rounds)) return true;
  return grows && whole(start, point);
}

bool Approach::knows_states(const Start& start) const {
  for (std::size_t arc = 0; start.state && arc < shooting_.problem().structure().size(); ++arc) {
    if (start.state(static_cast<int>(arc), 0.0)) return true;
  }
  return false;
}

// Where the arcs cannot be sketched nothing can be said of them, and there is nothing to put nodes on.
bool Approach::stays_whole(const Start& start) {
  try {
    return can_stay_whole(shooting_, start, {});
  } catch (const LeftDomain&) {
    return true;
  }
}

/// Are there nodes along the states of the start?
bool Approach::cut_along(const Start& start, Eigen::VectorXd& point) {
  shooting_.set_mesh({});
  point = start.unknowns;
  try {
    apply(mesh_along_guess(shooting_, start, short_segments), shooting_, point);
  } catch (const LeftDomain&) {
    return false;
  }
  return !shooting_.cuts().empty();
}

/// Single shooting. Where all a caller gives is unknowns it may have others, and wants to know soon that these do not do.
bool Approach::whole(const Start& start, Eigen::VectorXd& point) {
  shooting_.set_mesh({});
  point = start.unknowns;
  if (effort_ == Effort::full && near_root(kinsol(shooting_, point, options_, cost_).termination)) return true;
  point = start.unknowns;
  return (effort_ != Effort::full || knows_states(start)) && globalise(point, 1);
}

/// Damped Newton steps; segments that cannot be integrated on the way are cut, and all are if no step helps.
bool Approach::globalise(Eigen::VectorXd& point, int rounds) {
  MeshOptions mesh = short_segments;
  for (int round = 0; round < rounds; ++round) {
    ShootingSystem system(shooting_);
    const double size = std::sqrt(static_cast<double>(shooting_.size()));
    const NewtonResult result = natural_newton(system, point, shooting_.unknown_scales(), Bounds::of(shooting_),
                                               {.residual_tolerance = 10.0 * tolerance_,
                                                .step_tolerance = 1e-4 * size,
                                                .relative = true,
                                                .max_step = std::numeric_limits<double>::infinity(),
                                                .max_iterations = 100});
    cost_.newton_iterations += result.iterations;
    if (result.converged() || result.termination == Termination::small_step) return true;
    reason_ = fmt::format("{}{}{}", describe(result.termination), result.message.empty() ? "" : ": ", result.message);
    try {
      if (result.termination == Termination::left_domain) {
        apply(split(shooting_, point, shooting_.failed_place()), shooting_, point);
        continue;
      }
      mesh.growth = std::sqrt(mesh.growth);
      if (mesh.growth < 2.0) return false;
      apply(remesh(shooting_, point, mesh), shooting_, point);
    } catch (const LeftDomain&) {
      return false;
    }
  }
  return false;
}

bool Approach::cut_by_growth(Eigen::VectorXd& point, const MeshOptions& mesh) {
  try {
    apply(remesh(shooting_, point, mesh), shooting_, point);
    return true;
  } catch (const LeftDomain&) {
    return false;
  }
}

namespace {

/// Gives a shooting its parameters back, whatever happens.
class Restored {
 public:
  explicit Restored(Shooting& shooting) : shooting_(shooting), parameters_(shooting.parameters()) {}
  Restored(const Restored&) = delete;
  Restored& operator=(const Restored&) = delete;
  ~Restored() { shooting_.set_parameters(parameters_); }

 private:
  Shooting& shooting_;
  std::vector<double> parameters_;
};

}  // namespace

bool Approach::follow_homotopy(const Start& start, Eigen::VectorXd& point) {
  const Homotopy& homotopy = *options_.homotopy;
  const auto& parameters = shooting_.problem().parameters();
  const auto found = std::find_if(parameters.begin(), parameters.end(),
                                  [&](const Parameter& parameter) { return parameter.name == homotopy.parameter; });
  if (found == parameters.end()) {
    std::string known;
    for (const Parameter& parameter : parameters) known += (known.empty() ? "" : ", ") + parameter.name;
    throw BadInput(fmt::format("the problem has no parameter '{}' for a homotopy; it has {}", homotopy.parameter,
                               known.empty() ? "none" : known));
  }
  if (!std::isfinite(homotopy.from))
    throw BadInput(fmt::format("homotopy from {} is not admissible: a finite number", homotopy.from));
  const auto place = static_cast<std::size_t>(found - parameters.begin());
  const std::vector<double> target = shooting_.parameters();
  const double from = homotopy.from, to = target[place];
  const bool geometric = from * to > 0.0;
  const auto value = [&](double s) {
    if (s == 1.0) return to;
    return geometric ? from * std::pow(to / from, s) : std::lerp(from, to, s);
  };
  std::vector<double> at = target;
  at[place] = from;
  const Restored restored(shooting_);
  shooting_.set_parameters(at);
  check_well_posed(shooting_, point);
  bool good = from_start(start, point);
  if (good) cut_by_growth(point, short_segments);
  double s = 0.0, step = 0.25;
  constexpr double shortest = 1e-4;
  while (good && s < 1.0) {
    const double next = std::min(1.0, s + step);
    std::vector<double> path(target.size(), 0.0);
    path[place] = value(next) - value(s);
    at[place] = value(next);
    if (follow_step(point, at, path)) {
      cut_by_growth(point, short_segments);
      s = next;
      step *= 2.0;
    } else {
      step = 0.5 * (next - s);
      good = step > shortest;
    }
  }
  if (good) return true;
  reason_ = fmt::format("the homotopy ends at {} = {:.6g}: {}", homotopy.parameter, value(s), reason_);
  return false;
}

/// From the solution at the shooting's present parameters along the tangent, and back to the curve. On failure nothing has changed.
bool Approach::follow_step(Eigen::VectorXd& point, const std::vector<double>& target, const std::vector<double>& path) {
  const std::vector<double> before = shooting_.parameters();
  const Eigen::VectorXd start = point;
  const Mesh mesh{shooting_.cuts(), shooting_.node_sizes(), start.tail(start.size() - shooting_.border())};
  try {
    const Shot& shot = shooting_.evaluate(point, path);
    const Eigen::VectorXd tangent = -shooting_.decompose(shot).solve(shooting_.path_derivative(shot));
    shooting_.set_parameters(target);
    if (tangent.allFinite()) {
      constexpr int rounds = 6;
      point += tangent;
      if (globalise(point, rounds)) return true;
    }
  } catch (const LeftDomain& left) {
    reason_ = left.what();
  }
  shooting_.set_parameters(before);
  shooting_.set_mesh(mesh);
  point = start;
  return false;
}

}  // namespace costate
