/// \file
/// Who is measured, on what, and what a solve of it has cost.
#pragma once

#include <array>
#include <functional>
#include <string>
#include <vector>

namespace costate::bench {

struct Outcome {
  bool found = false;
  std::array<double, 8> unknowns{};
  int iterations = 0;
  long steps = 0, evaluations = 0;
};

/// Solves the problem from its rough guess at a setting of its tolerance. What it keeps from solve to solve is memory only.
using Solve = std::function<Outcome(double setting)>;

struct Contender {
  std::string problem, solver;
  std::vector<double> reference;  ///< the unknowns, with more digits
  std::vector<Solve> variants;    ///< of the way down to the setting; the fastest one counts
  double coarsest = 0.1, finest = 1e-15;

  /// Largest |difference| of an unknown from the reference.
  [[nodiscard]] double error(const Outcome& outcome) const;
};

/// A path of forty values of a parameter, once as a continuation and once by solves from the rough guess each.
struct Path {
  std::string name;
  std::function<bool()> along, cold;  ///< all the points; false if one has no root
};
inline constexpr int path_points = 40;
/// P1 in x and P2 in μ.
[[nodiscard]] std::vector<Path> paths();

/// P1, P2 and P3 (see the README), each with its yardstick first.
[[nodiscard]] std::vector<Contender> contenders();

/// A contender at the setting that is timed: of the variants, the one that is fastest at its loosest setting (half decades) that
/// reaches the true error.
struct Tuned {
  const Contender* contender = nullptr;
  const Solve* solve = nullptr;  ///< none: the error is not reached
  double setting = 0.0;
  Outcome outcome;
};
[[nodiscard]] Tuned tune(const Contender& contender, double target);

}  // namespace costate::bench
