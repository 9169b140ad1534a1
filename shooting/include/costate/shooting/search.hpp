/// \file
/// Every extremal a problem has in a box of its unknowns, as far as seeded random starts find them.
#pragma once

#include <costate/shooting/solve.hpp>

#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace costate {

struct SearchOptions {
  unsigned seed = 1;  ///< of the starts: the same seed gives the same search on every machine
  int starts = 100;   ///< at most
  /// Lower and upper end for every unknown, between which starts are drawn evenly; where the domain of an unknown is
  /// narrower, the domain. Empty: guess ± 3 scale.
  std::vector<std::pair<double, double>> box{};
  double accuracy = 1e-8;  ///< of the extremals
  std::string cost{};      ///< the report that orders them; empty: "cost", or else "final_time", if the problem reports one
  double max_seconds = std::numeric_limits<double>::infinity();  ///< CPU time after which no other start is made
  int enough = std::numeric_limits<int>::max();                  ///< extremals after which none is made
  /// Steps per arc a start may cost: from a start whose arcs need more little is to be expected, and most starts are such.
  long max_steps = 1000;
  Method method = Method::adams;
};

/// A root of the shooting equations.
struct Extremal {
  Solution solution;
  double cost = 0.0;      ///< the report asked for; 0 if the problem has none
  int hits = 0;           ///< starts that led here
  std::string verdict{};  ///< why it is no solution; empty if it is one
};

struct Search {
  /// Why starts led nowhere, and how many of them.
  struct Failure {
    std::string reason;
    int count = 0;
  };
  std::vector<Extremal> extremals;  ///< verified, no two the same, the least cost first
  std::vector<Extremal> refused;    ///< roots that are no solutions: outside a domain, or against a path check
  int starts = 0;                   ///< made
  int converged = 0;                ///< of these, led to an extremal
  int rejected = 0;                 ///< … to a root that is refused
  int failed = 0;                   ///< … nowhere
  std::vector<Failure> failures;    ///< most frequent first
  Cost cost;

  /// Share of the starts that led to an extremal.
  [[nodiscard]] double success_rate() const;
  /// Chance that the next start that arrives at a root arrives at one not met so far, by the share of arrivals at roots met
  /// once (I. J. Good, Biometrika 40 (1953) 237–264): how complete the search is within its box. 1 if no start arrived.
  [[nodiscard]] double unseen() const;
  /// A paragraph: how many starts, extremals with cost and hits, refused roots and failures with their reasons.
  [[nodiscard]] std::string summary() const;
};

/// Starts damped Newton iterations all over the box at a loose tolerance and solves each root not met before to the
/// accuracy. Two roots are the same if no unknown differs by more than the error bounds of the two. (Starts that arrive
/// within 10⁻⁵ scale of a root on the same side of det J = 0 are counted there without being solved.)
/// \throws BadInput for options out of range, or a cost that the problem does not report.
[[nodiscard]] Search find_extremals(std::shared_ptr<const Problem> problem, const SearchOptions& options = {});

}  // namespace costate
