#include "hunt.hpp"

#include <costate/error.hpp>
#include <costate/shooting/search.hpp>

#include <algorithm>
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

/// Starts around a centre, within the domains of the unknowns.
class Around {
 public:
  Around(const Eigen::VectorXd& center, const Shooting& shooting, const MultiStartOptions& options)
      : center_(center),
        scales_(shooting.unknown_scales()),
        bounds_(Bounds::of(shooting.problem())),
        radius_(options.radius),
        uniform_(options.seed) {}

  Eigen::VectorXd next() {
    const double radius = std::ldexp(radius_, std::countr_zero(++count_));
    Eigen::VectorXd start(center_.size());
    for (Eigen::Index i = 0; i < start.size(); ++i) {
      const double reach = radius * scales_[i];
      double lower = std::max(center_[i] - reach, bounds_.lower[i]), upper = std::min(center_[i] + reach, bounds_.upper[i]);
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
  Eigen::VectorXd center_, scales_;
  Bounds bounds_;
  double radius_;
  Uniform uniform_;
  unsigned count_ = 0;
};

}  // namespace

MultiStart multi_start(Shooting& shooting, const Eigen::VectorXd& start, const SolveOptions& options,
                       const MultiStartOptions& multiple) {
  check_options(multiple);
  // Coarse: the starts only have to reach a root's neighbourhood, and a refused root must be known again when it is met again.
  Hunt hunt(shooting, {.solve = options, .tolerance = 1e-4, .max_steps = multiple.max_steps, .same = 1e-2});
  MultiStart result;
  result.solution = solve(shooting, start, options);
  result.starts = 1;
  result.converged = result.solution.status == Solution::Status::failed ? 0 : 1;
  long iterations = result.solution.cost.newton_iterations;
  Around around(start, shooting, multiple);
  Eigen::VectorXd next = start;  // the damped iteration may find what the solve did not
  bool centre = true;
  while (!result.solution.solved() && result.starts < multiple.starts && hunt.cost().seconds < multiple.max_seconds) {
    if (!centre) {
      next = around.next();
      ++result.starts;
    }
    const Hunt::Outcome outcome = hunt.follow(next);
    centre = false;
    if (outcome.root < 0) continue;
    const Solution& found = hunt.roots()[static_cast<std::size_t>(outcome.root)].solution;
    if (found.status != Solution::Status::failed) ++result.converged;
    if (found.solved() ||
        (outcome.fresh && result.solution.status == Solution::Status::failed && found.status == Solution::Status::refused)) {
      result.solution = found;
    }
  }
  if (!result.solution.solved() && result.starts > 1) {
    result.solution.message += fmt::format("; nor did {} starts around it lead to a solution", result.starts - 1);
  }
  result.solution.cost = hunt.cost();
  result.solution.cost.newton_iterations += iterations;
  return result;
}

}  // namespace costate
