/// \file
/// From starts to roots, many times over: a start is followed at a loose tolerance, and only a root not met before is solved
/// to the accuracy and verified.
#pragma once

#include "newton.hpp"

#include <costate/shooting/solve.hpp>

#include <random>

namespace costate {

/// Seeded uniform numbers, the same on every machine (the standard leaves its distributions to the implementation).
class Uniform {
 public:
  explicit Uniform(unsigned seed) : engine_(seed) {}
  /// In the open interval (a, b).
  double operator()(double a, double b) {
    constexpr double cells = 4294967296.0;  // 2³², as many as the engine has values
    return a + (b - a) * ((static_cast<double>(engine_()) + 0.5) / cells);
  }

 private:
  std::mt19937 engine_;
};

struct HuntOptions {
  SolveOptions solve;       ///< for roots not met before
  double tolerance = 1e-6;  ///< of the integrations that follow a start
  long max_steps = 1000;    ///< of these, per arc
  /// A start that arrives within this scaled distance of a root met before, with the same sign of det J, has found that
  /// root. Else it is solved, and the error bounds of the two decide.
  double same = 1e-5;
};

class Hunt {
 public:
  /// A root met, with what solving it gave: a solution, refused, or failed if it is a root of the loose integration alone.
  struct Root {
    Solution solution;
    int orientation = 0;  ///< sign of det J where the first start arrived
    int hits = 1;
  };
  /// Where a start led: to a root (its place), or nowhere.
  struct Outcome {
    Termination termination = Termination::converged;
    std::ptrdiff_t root = -1;
    bool fresh = false;  ///< the root had not been met before
  };

  Hunt(Shooting& shooting, const HuntOptions& options);

  Outcome follow(const Eigen::VectorXd& start);
  [[nodiscard]] const std::vector<Root>& roots() const { return roots_; }
  /// What everything has cost so far.
  [[nodiscard]] Cost cost() const;

 private:
  [[nodiscard]] bool near(const Eigen::VectorXd& y, int orientation, const Root& root) const;
  [[nodiscard]] static bool same(const Solution& a, const Solution& b);
  Outcome met(std::size_t place);

  Shooting& shooting_;
  HuntOptions options_;
  ShootingSystem system_;
  Bounds bounds_;
  Eigen::VectorXd scales_;
  std::vector<Root> roots_;
  Statistics before_;
  double began_ = thread_seconds();
  long iterations_ = 0;
};

}  // namespace costate
