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
    const Push<double> push = push_of(scene_, 0.0);
    const std::optional<TiltedCycloid> start = tilted_cycloid(scene_.x, scene_.y, scene_.speed, push.x, push.y);
    if (!start) return;  // too little energy for the chord
    if (start->turn() == 0.0) return explain("the path turns by less than double precision holds");
    Shooting shooting(make_problem(scene_, {{.turn = start->mirrored ? Side::right : Side::left}}));
    shooting.set_parameters(parameters(scene_, 0.0));
    const Eigen::Vector2d y(std::remainder(start->theta2(), 2.0 * std::numbers::pi), std::log(std::abs(start->turn())));
    const Followed path = follow(shooting, y, parameters(scene_), {.max_points = 100, .max_integration_steps = 15000});
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
