#include "normal_scene.hpp"

#include "extremal_search.hpp"
#include "linear_outcome.hpp"

#include <costate/models/tilted_cycloid.hpp>
#include <costate/shooting/continuation.hpp>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace costate::normal_friction {

namespace {

using tools::Outcome;

/// The motion with the friction's tangent at the chord's inclination in place of the friction.
std::optional<TiltedCycloid> tangent_cycloid(const Scene& scene) {
  const Push<double> push = push_of(scene, 0.0);
  return tilted_cycloid(scene.x, scene.y, scene.speed, push.x, push.y);
}

/// The same as a solution of the shooting problem.
tools::BranchStart start_from(const TiltedCycloid& cycloid, const Scene& scene) {
  return {make_problem(scene, {{.turn = cycloid.mirrored ? Side::right : Side::left}}), parameters(scene, 0.0),
          Eigen::Vector2d(std::remainder(cycloid.theta2(), 2.0 * std::numbers::pi), std::log(std::abs(cycloid.turn())))};
}

/// Work on one scene with β ≠ 0, and what it has cost.
class Search {
 public:
  Search(const Scene& scene, const SolveOptions& options, Cost& cost) : scene_(scene), options_(options), cost_(&cost) {
    // An arc is a quadrature: one that needs more steps is not worth a Newton iteration.
    options_.max_steps = std::min(options_.max_steps, 4000L);
  }

  /// Every extremal that could be solved, the fastest first.
  std::vector<Solution> run() {
    follow_tangent_friction();
    std::vector<RoughExtremal> tried;
    constexpr long most_steps = 200000;  // a solve takes some thousand
    for (const RoughExtremal& rough : find_extremals(scene_)) {
      if (cost_->steps > most_steps) break;
      if (known(rough) || std::any_of(tried.begin(), tried.end(), [&](const auto& other) { return alike(other, rough); })) {
        continue;
      }
      tried.push_back(rough);
      Shooting shooting(make_problem(scene_, rough.structure));
      finish(shooting, rough.unknowns,
             fmt::format("an extremal of {:.4g} s with {} corners", rough.time, rough.structure.size() - 1));
    }
    std::sort(found_.begin(), found_.end(),
              [](const Solution& a, const Solution& b) { return a.final_time() < b.final_time(); });
    return std::move(found_);
  }

  /// Why nothing was found.
  [[nodiscard]] const std::string& failures() const { return failures_; }

 private:
  void follow_tangent_friction() {
    const std::optional<TiltedCycloid> cycloid = tangent_cycloid(scene_);
    if (!cycloid) return;  // too little energy for the chord
    if (cycloid->turn() == 0.0) return explain("the path turns by less than double precision holds");
    const tools::BranchStart start = start_from(*cycloid, scene_);
    Shooting shooting(start.problem);
    shooting.set_parameters(start.parameters);
    const Followed path =
        follow(shooting, start.y, parameters(scene_),
               {.max_points = 100, .max_integration_steps = 15000, .method = options_.method});
    cost_->newton_iterations += path.newton_iterations;
    if (path.reached) {
      finish(shooting, path.y, "the extremal without corners");
    } else {
      cost_->add(shooting.statistics());
      explain("the way from friction linear in N: " + path.message);
    }
  }

  void explain(const std::string& failure) { failures_ += (failures_.empty() ? "" : "; ") + failure; }

  void finish(Shooting& shooting, const Eigen::VectorXd& start, const std::string& name) {
    Solution solution = solve(shooting, start, options_);
    cost_->newton_iterations += solution.cost.newton_iterations;
    cost_->add(shooting.statistics());
    if (solution.solved()) {
      found_.push_back(std::move(solution));
    } else {
      explain(name + ": " + solution.message);
    }
  }

  [[nodiscard]] bool known(const RoughExtremal& rough) const {
    return std::any_of(found_.begin(), found_.end(), [&](const Solution& s) {
      return s.y.size() == rough.unknowns.size() && std::abs(s.y[0] - rough.unknowns[0]) < 0.02 &&
             std::abs(s.final_time() / rough.time - 1.0) < 0.01;
    });
  }
  static bool alike(const RoughExtremal& a, const RoughExtremal& b) {
    return a.structure == b.structure && (a.unknowns - b.unknowns).cwiseAbs().maxCoeff() < 0.05;
  }

  Scene scene_;
  SolveOptions options_;
  Cost* cost_;
  std::vector<Solution> found_;
  std::string failures_;
};

void solve_nonlinear(const Scene& scene, const SolveOptions& options, Outcome& outcome) {
  Search search(scene, options, outcome.cost);
  std::vector<Solution> found = search.run();
  if (found.empty()) {
    outcome.status = Outcome::Status::failed;
    outcome.message =
        search.failures().empty()
            ? "no extremal leads to the end point: near y_max hard friction makes the bead gain by chattering between N < 0 "
              "and N > 0; try a lower y or a higher speed"
            : search.failures();
    return;
  }
  outcome.status = Outcome::Status::solved;
  outcome.solution = std::move(found.front());
  outcome.other_extremals.assign(std::make_move_iterator(found.begin() + 1), std::make_move_iterator(found.end()));
}

/// Least g cos θ along the path of a solved scene.
double least_normal_force(const Outcome& outcome) {
  constexpr std::size_t normal_place = 7;
  double least = std::numeric_limits<double>::infinity();
  if (outcome.closed_form) {
    for (const std::vector<double>& row : outcome.closed_form->trajectory.rows) least = std::min(least, row.back());
    return least;
  }
  // θ is monotone on each arc, and cos θ least at one of its ends or where it passes π.
  for (const ArcTrace& arc : outcome.solution.arcs) {
    constexpr int cells = 100;
    for (int i = 0; i <= cells; ++i) {
      const ArcPoint point = arc.point(static_cast<double>(i) / cells);
      least = std::min(least, outcome.solution.problem->observe(point, outcome.solution.parameters)[normal_place]);
    }
  }
  return least;
}

}  // namespace

std::optional<tools::BranchStart> branch_start(const Scene& scene) {
  if (scene.beta != 0.0) return std::nullopt;
  const std::optional<TiltedCycloid> cycloid = tangent_cycloid(scene);  // the motion itself: the friction is its own tangent
  if (!cycloid || cycloid->turn() == 0.0) return std::nullopt;
  tools::BranchStart start = start_from(*cycloid, scene);
  start.parameters = parameters(scene);
  return start;
}

Outcome solve_scene(const Scene& scene, const SolveOptions& options) {
  const double began = thread_seconds();
  Outcome outcome;
  const double loss = scene.mu - std::max(scene.beta, 0.0) * scene.gravity * scene.gravity;
  const double y_max = scene.speed * scene.speed / (2.0 * scene.gravity) - loss * scene.x;
  if (!(scene.speed * scene.speed - 2.0 * scene.gravity * (scene.y + loss * scene.x) > 0.0)) {
    outcome.status = Outcome::Status::infeasible;
    outcome.message = fmt::format(
        "y = {:g} m is out of reach: with speed = {:g} m/s, mu = {:g}, beta = {:g} s^4/m^2 and N >= 0 the bead "
        "cannot rise to y_max = {:.12g} m at x = {:g} m",
        scene.y, scene.speed, scene.mu, scene.beta, y_max, scene.x);
  } else if (scene.beta == 0.0) {
    outcome = linear_outcome(scene);
  } else {
    solve_nonlinear(scene, options, outcome);
  }
  outcome.limits = {{"y_max", "m", y_max}, {"N_min", "m/s^2", std::nullopt}};
  if (outcome.solved()) outcome.limits.back().value = least_normal_force(outcome);
  outcome.cost.seconds = thread_seconds() - began;
  return outcome;
}

}  // namespace costate::normal_friction
