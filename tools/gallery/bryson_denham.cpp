// A mass thrown upwards comes back as fast as it left, with the least effort and under a ceiling (second-order state constraint):
//   minimise ∫ ½ u² dt,   x' = v,  v' = u,  x ≤ l,   x(0) = x(1) = 0,  v(0) = 1,  v(1) = −1.
// In closed form, l = 1/9: along the ceiling from 3l to 1 − 3l, J = 4/(9l) = 4. l = 1/5: it is touched once, J = 56/25.
// A. E. Bryson & Y.-C. Ho, Applied Optimal Control, 1975, §3.11.
#include <costate/costate.hpp>

#include <cstdio>

using namespace costate;

struct DoubleIntegrator {
  static constexpr int states = 2, controls = 1, parameters = 1;
  template <class S>
  Vec<S, 2> dynamics(const Vec<S, 2>& q, const Vec<S, 1>& u, const Vec<S, 1>&) const {
    return {q[1], u[0]};
  }
  template <class S>
  S cost(const Vec<S, 2>&, const Vec<S, 1>& u, const Vec<S, 1>&) const {
    return 0.5 * u[0] * u[0];
  }
};

ControlProblem<DoubleIntegrator> throw_below(double ceiling) {
  ControlProblem problem(DoubleIntegrator{});
  problem.state("x", {.start = 0.0, .end = 0.0}).state("v", {.start = 1.0, .end = -1.0}).control("u");
  problem.parameter("l", ceiling).final_time(1.0);
  problem.constraint("ceiling", [](const auto& q, const auto& p) { return q[0] - p[0]; });
  return problem;
}

int main() {
  std::printf("l = 1/9: an arc along the ceiling\n");
  auto low = throw_below(1.0 / 9.0);
  low.interior().boundary("ceiling").interior();
  const int failed = print(solve(low.shared()));

  std::printf("l = 1/5: the ceiling is touched\n");
  auto high = throw_below(0.2);
  high.interior().touch("ceiling").interior();
  return failed + print(solve(high.shared()));
}
