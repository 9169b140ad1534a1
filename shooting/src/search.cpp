#include "hunt.hpp"

#include <costate/error.hpp>
#include <costate/shooting/search.hpp>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace costate {

namespace {

void check_options(const SearchOptions& options, const Problem& problem) {
  if (options.starts < 1) throw BadInput(fmt::format("starts = {} is not admissible: 1 or more", options.starts));
  if (options.enough < 1) throw BadInput(fmt::format("enough = {} is not admissible: 1 or more", options.enough));
  if (options.max_steps < 1) throw BadInput(fmt::format("max_steps = {} is not admissible: 1 or more", options.max_steps));
  if (!(options.max_seconds > 0.0)) {
    throw BadInput(fmt::format("max_seconds = {:g} is not admissible: a positive number of seconds", options.max_seconds));
  }
  if (!(options.accuracy >= finest_accuracy && options.accuracy <= coarsest_accuracy)) {
    throw BadInput(
        fmt::format("accuracy = {:g} is not admissible: {:g} … {:g}", options.accuracy, finest_accuracy, coarsest_accuracy));
  }
  if (!options.box.empty() && options.box.size() != problem.unknowns().size()) {
    throw BadInput(
        fmt::format("box has {} intervals, the problem {} unknowns", options.box.size(), problem.unknowns().size()));
  }
}

/// Where starts are drawn from, one interval an unknown.
std::vector<std::pair<double, double>> box_of(const SearchOptions& options, const Problem& problem) {
  std::vector<std::pair<double, double>> box;
  for (std::size_t i = 0; i < problem.unknowns().size(); ++i) {
    const Unknown& unknown = problem.unknowns()[i];
    const auto [given_lower, given_upper] = options.box.empty() ? std::pair(unknown.guess - 3.0 * unknown.scale,
                                                                            unknown.guess + 3.0 * unknown.scale)
                                                                : options.box[i];
    const double lower = std::max(given_lower, unknown.lower), upper = std::min(given_upper, unknown.upper);
    if (!(lower < upper && std::isfinite(lower) && std::isfinite(upper))) {
      throw BadInput(
          fmt::format("the box of {} = {:g} … {:g} is not admissible: two finite numbers, the first the smaller, with a "
                      "part within {:g} … {:g}",
                      unknown.name, given_lower, given_upper, unknown.lower, unknown.upper));
    }
    box.emplace_back(lower, upper);
  }
  return box;
}

/// The cost of a solution: the report of that name. Without a name "cost" or "final_time", or 0.
double cost_of(const Solution& solution, const std::string& name) {
  if (!name.empty()) return solution[name].value;
  for (const char* usual : {"cost", "final_time"}) {
    for (const Quantity& report : solution.reports) {
      if (report.name == usual) return report.value;
    }
  }
  return 0.0;
}

void count(std::vector<Search::Failure>& failures, const std::string& reason, int times) {
  const auto known = std::find_if(failures.begin(), failures.end(), [&](const auto& f) { return f.reason == reason; });
  if (known != failures.end()) {
    known->count += times;
  } else {
    failures.push_back({reason, times});
  }
}

/// Sorts the roots of a hunt by what came of them.
void sort_out(const Hunt& hunt, const std::string& cost, Search& search) {
  for (const Hunt::Root& root : hunt.roots()) {
    const Solution& solution = root.solution;
    switch (solution.status) {
      case Solution::Status::solved:
        search.converged += root.hits;
        search.extremals.push_back({solution, cost_of(solution, cost), root.hits});
        break;
      case Solution::Status::refused:
        search.rejected += root.hits;
        search.refused.push_back({solution, cost_of(solution, cost), root.hits, solution.message});
        break;
      case Solution::Status::failed:
        search.failed += root.hits;
        count(search.failures, "a root of the loose integration is not confirmed: " + solution.message, root.hits);
        break;
    }
  }
  const auto cheaper = [](const Extremal& a, const Extremal& b) { return a.cost < b.cost; };
  std::stable_sort(search.extremals.begin(), search.extremals.end(), cheaper);
  std::stable_sort(search.refused.begin(), search.refused.end(), cheaper);
  std::stable_sort(search.failures.begin(), search.failures.end(),
                   [](const auto& a, const auto& b) { return a.count > b.count; });
}

}  // namespace

double Search::success_rate() const { return starts > 0 ? static_cast<double>(converged) / starts : 0.0; }

double Search::unseen() const {
  int once = 0, all = 0;
  for (const auto* list : {&extremals, &refused}) {
    for (const Extremal& root : *list) {
      all += root.hits;
      once += root.hits == 1 ? 1 : 0;
    }
  }
  return all > 0 ? static_cast<double>(once) / all : 1.0;
}

std::string Search::summary() const {
  std::string text = fmt::format("{} starts: {} led to {} extremal{}, {} to {} refused root{}, {} nowhere; {:.2g} s\n",
                                 starts, converged, extremals.size(), extremals.size() == 1 ? "" : "s", rejected,
                                 refused.size(), refused.size() == 1 ? "" : "s", failed, cost.seconds);
  for (const Extremal& extremal : extremals)
    text += fmt::format("  extremal, cost {:.12g}, hits {}\n", extremal.cost, extremal.hits);
  for (const Extremal& root : refused) {
    text += fmt::format("  refused, cost {:.12g}, hits {}: {}\n", root.cost, root.hits, root.verdict);
  }
  for (const Failure& failure : failures) text += fmt::format("  {} times: {}\n", failure.count, failure.reason);
  return text;
}

Search find_extremals(std::shared_ptr<const Problem> problem, const SearchOptions& options) {
  check_options(options, *problem);
  const auto box = box_of(options, *problem);
  Shooting shooting(std::move(problem));
  HuntOptions hunting;
  hunting.solve = {.accuracy = options.accuracy, .method = options.method};
  hunting.max_steps = options.max_steps;
  Hunt hunt(shooting, hunting);
  Uniform uniform(options.seed);
  Search search;
  int extremals = 0;
  Eigen::VectorXd start(shooting.size());
  while (search.starts < options.starts && extremals < options.enough && hunt.cost().seconds < options.max_seconds) {
    for (Eigen::Index i = 0; i < start.size(); ++i) {
      const auto& [lower, upper] = box[static_cast<std::size_t>(i)];
      start[i] = uniform(lower, upper);
    }
    ++search.starts;
    const Hunt::Outcome outcome = hunt.follow(start);
    if (outcome.root < 0) {
      ++search.failed;
      count(search.failures, describe(outcome.termination), 1);
    } else if (outcome.fresh && hunt.roots()[static_cast<std::size_t>(outcome.root)].solution.solved()) {
      ++extremals;
    }
  }
  sort_out(hunt, options.cost, search);
  search.cost = hunt.cost();
  return search;
}

}  // namespace costate
