// Bratu's problem has two solutions for λ below λ*, none above. The lower one is solved at λ = 1 and followed through the fold, at
// which the branch turns back, to the upper one at λ = 1.
//   y'' + λ exp y = 0,   y(0) = y(1) = 0.
// In closed form: y'(0) = θ tanh(θ/4), λ = θ²/(2 cosh²(θ/4)), whose maximum λ* = 3.51383071912516 is where (θ/4) tanh(θ/4) = 1.
#include <costate/costate.hpp>

#include <cstdio>

using namespace costate;

struct Bratu {
  static constexpr int states = 2, parameters = 1;
  template <class S>
  Vec<S, 2> rates(const S&, const Vec<S, 2>& y, const Vec<S, 1>& p) const {
    return {y[1], -p[0] * exp(y[0])};
  }
};

int main() {
  TwoPoint stated(Bratu{}, 0.0, 1.0);
  stated.state("y", {.start = 0.0, .end = 0.0}).state("y'").parameter("lambda", 1.0);
  const auto problem = stated.shared();
  std::printf("lambda = 1, lower solution\n");
  const Solution lower = solve(problem);
  if (print(lower) != 0) return 1;

  // Beyond the fold λ falls again: the branch comes back to the λ it started from.
  const Branch branch = trace(problem, lower.parameters, lower.y, "lambda", 4.0);
  std::printf("the branch: %zu points, %s\n", branch.points.size(), branch.message.c_str());
  for (const BranchEvent& event : branch.events) {
    std::printf("%-34s %20.16g  +- %.1e\n", "lambda at the fold", event.point.parameter, event.error_bound);
  }
  std::printf("lambda = 1, upper solution\n");
  return print(solve(problem, branch.points.back().y));
}
