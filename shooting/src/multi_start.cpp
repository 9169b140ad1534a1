#include "attempt.hpp"
#include "hunt.hpp"

#include <costate/error.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <fmt/format.h>

namespace costate {

namespace {

/// Starts within the domains of the unknowns, by turns around the start asked for and around the guesses that the problem
/// states. Where these are the same, the other centre is 0: the scales are typical magnitudes.
class Around {
 public:
  Around(const Eigen::VectorXd& start, const Shooting& shooting, const RandomStarts& random)
      : centers_{start, other_than(start, shooting.problem().start())},
        scales_(shooting.unknown_scales()),
        bounds_(Bounds::of(shooting)),
        radius_(random.radius),
        uniform_(random.seed) {}

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

void check_random(const RandomStarts& random) {
  if (random.count < 0) throw BadInput(fmt::format("random.count = {} is not admissible: 0 or more", random.count));
  if (random.max_steps < 1)
    throw BadInput(fmt::format("random.max_steps = {} is not admissible: 1 or more", random.max_steps));
  if (random.max_total_steps < 1) {
    throw BadInput(fmt::format("random.max_total_steps = {} is not admissible: 1 or more", random.max_total_steps));
  }
  if (!(random.radius > 0.0 && std::isfinite(random.radius))) {
    throw BadInput(fmt::format("random.radius = {:g} is not admissible: a positive number of scales", random.radius));
  }
}

Solution attempt_at_random(Shooting& shooting, const Eigen::VectorXd& around, const SolveOptions& options,
                           const RandomStarts& random) {
  // Coarse: the starts only have to reach a root's neighbourhood, and a refused root must be known when it is met again.
  HuntOptions hunting{.solve = options, .tolerance = 1e-4, .max_steps = random.max_steps, .same = 1e-2};
  hunting.solve.homotopy.reset();  // what a start arrives at is near a root of the wanted problem already
  hunting.solve.max_total_steps = std::min(options.max_total_steps, random.max_total_steps);
  Hunt hunt(shooting, hunting);
  Around starts(around, shooting, random);
  Solution best;
  // Where as many arrivals in a row were at roots known to be refused, another kind of root is not to be expected.
  constexpr int most_stale = 40;
  int made = 0, arrived = 0, stale = 0;
  while (made < random.count && stale < most_stale && hunt.cost().steps < random.max_total_steps && !best.solved()) {
    ++made;
    const Hunt::Outcome outcome = hunt.follow(starts.next());
    if (outcome.root < 0) continue;
    const Solution& found = hunt.roots()[static_cast<std::size_t>(outcome.root)].solution;
    if (found.status == Solution::Status::failed) continue;
    ++arrived;
    stale = outcome.fresh ? 0 : stale + 1;
    if (found.solved() || best.status == Solution::Status::failed) best = found;
  }
  best.starts = made;
  best.arrived = arrived;
  best.cost = hunt.cost();
  return best;
}

}  // namespace costate
