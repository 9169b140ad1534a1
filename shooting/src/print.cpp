#include <costate/shooting/print.hpp>

#include <cstdio>
#include <fmt/format.h>

namespace costate {

std::string results(const Solution& solution) {
  std::string text;
  if (!solution.solved()) return text;
  for (const auto* list : {&solution.unknowns, &solution.reports}) {
    for (const Quantity& q : *list) {
      text += fmt::format("{:<34} {:>20.16g}  +- {:.1e}{}{}\n", q.name, q.value, q.error_bound, q.unit.empty() ? "" : "  ",
                          q.unit);
    }
  }
  return text;
}

int print(const Solution& solution) {
  fmt::print("{}", results(solution));
  if (!solution.solved()) fmt::print(stderr, "not solved: {}\n", solution.message);
  return solution.solved() ? 0 : 1;
}

}  // namespace costate
