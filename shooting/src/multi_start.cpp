#include "hunt.hpp"

#include <costate/error.hpp>
#include <costate/shooting/search.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <fmt/format.h>

namespace costate {

namespace {

void check_options(const MultiStartOptions& options) {
  if (options.starts < 1) throw BadInput(fmt::format("starts = {} is not admissible: 1 or more", options.starts));
  if (options.max_steps < 1) throw BadInput(fmt::format("max_steps = {} is not admissible: 1 or more", options.max_steps));
  if (!(options.max_seconds > 0.0)) {
    throw BadInput(fmt::format("max_seconds = {:g} is not admissible: a positive number of seconds", options.max_seconds));
  }
  if (!(options.radius > 0.0 && std::isfinite(options.radius))) {
    throw BadInput(fmt::format("radius = {:g} is not admissible: a positive number of scales", options.radius));
  }
}

/// Starts within the domains of the unknowns, by turns around the start asked for and around the guesses that the problem
/// states. Where these are the same, the other centre is 0: the scales are typical magnitudes. Made of a shooting with whole
/// arcs.
class Around {
 public:
  Around(const Eigen::VectorXd& start, const Shooting& shooting, const MultiStartOptions& options)
      : centers_{start, other_than(start, shooting.problem().start())},
        scales_(shooting.unknown_scales()),
        bounds_(Bounds::of(shooting)),
        radius_(options.radius),
        uniform_(options.seed) {}

  Eigen::VectorXd next() {
    const Eigen::VectorXd& center = centers_[count_ % 2];
    const double radius = std::ldexp(radius_, std::countr_zero(count_++ / 2 + 1));
    Eigen::VectorXd start(center.size());
    for (Eigen::Index i = 0; i < start.size(); ++i) {
      const double reach = radius * scales_[i];
      double lower = std::max(center[i] - reach, bounds_.lower[i]), upper = std::min(center[i] + reach, bounds_.upper[i]);
      // A centre so far outside a domain that the box misses it: as wide a piece of the domain at that end.
      if (lower >= upper) {
        lower = std::max(bounds_.lower[i], std::min(lower, bounds_.upper[i] - 2.0 * reach));
        upper = std::min(bounds_.upper[i], lower + 2.0 * reach);
      }
      start[i] = uniform_(lower, upper);
    }
    return start;
  }

 private:
  static Eigen::VectorXd other_than(const Eigen::VectorXd& start, const Eigen::VectorXd& guess) {
    return guess == start ? Eigen::VectorXd::Zero(start.size()) : guess;
  }

  std::array<Eigen::VectorXd, 2> centers_;
  Eigen::VectorXd scales_;
  Bounds bounds_;
  double radius_;
  Uniform uniform_;
  unsigned count_ = 0;
};

}  // namespace

MultiStart multi_start(Shooting& shooting, const Eigen::VectorXd& start, const SolveOptions& options,
                       const MultiStartOptions& multiple) {
  check_options(multiple);
  if (start.size() != shooting.border()) {
    throw BadInput(fmt::format("the start has {} values, the problem {} unknowns", start.size(), shooting.border()));
  }
  if (!start.allFinite()) throw BadInput("the start has a value that is not a finite number");
  // Coarse: the starts only have to reach a root's neighbourhood, and a refused root must be known when it is met again.
  Hunt hunt(shooting, {.solve = options, .tolerance = 1e-4, .max_steps = multiple.max_steps, .same = 1e-2});
  Around around(start, shooting, multiple);
  MultiStart result;
  long last_resort = 0;  // Newton iterations that the hunt does not know of
  Eigen::VectorXd next = start;
  while (true) {
    const Hunt::Outcome outcome = hunt.follow(next);
    ++result.starts;
    if (outcome.root >= 0) {
      const Solution& found = hunt.roots()[static_cast<std::size_t>(outcome.root)].solution;
      if (found.status != Solution::Status::failed) ++result.converged;
      if (found.solved()) {
        result.solution = found;
        break;
      }
    }
    if (result.starts == multiple.starts || hunt.cost().seconds >= multiple.max_seconds) {
      result.solution = solve(shooting, start, options);
      last_resort = result.solution.cost.newton_iterations;
      if (!result.solution.solved()) {
        result.solution.message += fmt::format("; none of {} starts around it led to a solution either", result.starts);
      }
      break;
    }
    next = around.next();
  }
  result.solution.cost = hunt.cost();
  result.solution.cost.newton_iterations += last_resort;
  return result;
}

}  // namespace costate
