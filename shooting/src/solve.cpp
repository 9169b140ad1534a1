#include "attempt.hpp"

#include <costate/error.hpp>
#include <costate/shooting/solve.hpp>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <fmt/format.h>
#include <limits>
#include <utility>

namespace costate {

namespace {

void check_options(const SolveOptions& options) {
  if (!(options.accuracy >= finest_accuracy && options.accuracy <= coarsest_accuracy)) {
    throw BadInput(
        fmt::format("accuracy = {:g} is not admissible: {:g} … {:g}", options.accuracy, finest_accuracy, coarsest_accuracy));
  }
  if (options.max_steps < 1) throw BadInput(fmt::format("max_steps = {} is not admissible: 1 or more", options.max_steps));
  if (options.max_total_steps < 1) {
    throw BadInput(fmt::format("max_total_steps = {} is not admissible: 1 or more", options.max_total_steps));
  }
  if (options.max_iterations < 1) {
    throw BadInput(fmt::format("max_iterations = {} is not admissible: 1 or more", options.max_iterations));
  }
  if (!(options.max_step > 0.0 && std::isfinite(options.max_step))) {
    throw BadInput(fmt::format("max_step = {:g} is not admissible: a positive number", options.max_step));
  }
}

/// All that is tried from one call of solve.
class Campaign {
 public:
  Campaign(Shooting& shooting, Start given, const SolveOptions& options)
      : shooting_(shooting), given_(std::move(given)), options_(options), before_(shooting.statistics()) {}

  Solution run() {
    // Guesses that are good lead to a solution soon, a homotopy may take its time; else a start that was searched for is the
    // better one, if there is one.
    found_ = attempt(shooting_, given_, affordable(), options_.homotopy ? Effort::brief : Effort::glance);
    if (open()) {
      if (const auto searched = shooting_.problem().search_start(shooting_.parameters())) {
        SolveOptions direct = affordable();
        direct.homotopy.reset();  // the start is one of the wanted problem
        take(attempt(shooting_, *searched, direct, Effort::brief));
      }
    }
    if (open() && failed() && !options_.homotopy) again(Effort::brief, options_.method);
    if (!found_.solved() && left() > 0 && shooting_.statistics().exhausted > before_.exhausted &&
        options_.method != Method::bdf)
      again(Effort::brief, Method::bdf);
    if (open()) {
      RandomStarts random = *options_.random;
      random.max_total_steps = std::min(random.max_total_steps, left());
      take(attempt_at_random(shooting_, given_.unknowns, affordable(), random));
    }
    if (open() && failed()) again(Effort::full, options_.method);
    if (!found_.solved() && found_.starts > 1) {
      found_.message += fmt::format("; of {} starts {} led to a root, none to a solution", found_.starts, found_.arrived);
    }
    return std::move(found_);
  }

 private:
  [[nodiscard]] bool failed() const { return found_.status == Solution::Status::failed; }
  /// Is another start of any use? Not where a root is known that cannot be known as well as asked for.
  [[nodiscard]] bool open() const {
    const bool known = failed() && found_.arrived > 0;
    return !found_.solved() && !known && left() > 0;
  }
  [[nodiscard]] long left() const { return options_.max_total_steps - (shooting_.statistics().steps - before_.steps); }
  [[nodiscard]] SolveOptions affordable() const {
    SolveOptions options = options_;
    options.max_total_steps = std::max(1L, left());
    return options;
  }

  void again(Effort effort, Method method) {
    SolveOptions options = affordable();
    options.method = method;
    Solution next = attempt(shooting_, given_, options, effort);
    next.starts = 0;  // the first again
    take(std::move(next));
  }

  /// The better of what was found before and the next: a root that is refused says more than none. Counts and costs add up.
  void take(Solution next) {
    const int starts = found_.starts + next.starts, arrived = found_.arrived + next.arrived;
    Cost cost = found_.cost;
    cost.add(next.cost);
    const bool worse = next.status == Solution::Status::failed && (!failed() || next.message.empty());
    if (!worse) found_ = std::move(next);
    found_.starts = starts;
    found_.arrived = arrived;
    found_.cost = cost;
  }

  Shooting& shooting_;
  Start given_;
  const SolveOptions& options_;
  Statistics before_;
  Solution found_;
};

/// A shooting whose arcs are whole and that has no step limit when all is done, whatever happens.
class Released {
 public:
  explicit Released(Shooting& shooting) : shooting_(shooting) {}
  Released(const Released&) = delete;
  Released& operator=(const Released&) = delete;
  ~Released() {
    shooting_.set_mesh({});
    shooting_.set_step_limit(std::numeric_limits<long>::max());
  }

 private:
  Shooting& shooting_;
};

}  // namespace

double thread_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

Solution solve(Shooting& shooting, const Eigen::Ref<const Eigen::VectorXd>& start, const SolveOptions& options) {
  check_options(options);
  if (start.size() != shooting.border()) {
    throw BadInput(fmt::format("the start has {} values, the problem {} unknowns", start.size(), shooting.border()));
  }
  if (!start.allFinite()) throw BadInput("the start has a value that is not a finite number");
  Start given{start,
              [&problem = shooting.problem()](int arc, double fraction) { return problem.state_guess(arc, fraction); }};
  const Released released(shooting);
  if (!options.random) return attempt(shooting, given, options);
  check_random(*options.random);
  return Campaign(shooting, std::move(given), options).run();
}

Solution solve(std::shared_ptr<const Problem> problem, const Eigen::Ref<const Eigen::VectorXd>& start,
               const SolveOptions& options) {
  Shooting shooting(std::move(problem));
  return solve(shooting, start, options);
}

Solution solve(std::shared_ptr<const Problem> problem, const SolveOptions& options) {
  const Eigen::VectorXd start = problem->start();
  SolveOptions everything = options;
  if (!everything.random) everything.random.emplace();
  return solve(std::move(problem), start, everything);
}

}  // namespace costate
