// Hamilton's principle as a control problem with many extremals: a pendulum is at the bottom at t = 0 and again at t = T.
//   minimise ∫ (½ u² + cos x) dt,   x' = u,   x(0) = x(T) = 0,   T = 10,   |u| ≤ 1.9.
// Extremals swing to and fro, x'' = −sin x: n half swings of modulus k take 2n K(k) = T, for n = 1, 2, 3 to either side, and there is
// rest; from |x'(0)| = 2 on the pendulum turns over and does not come back. The fastest, n = 1, break the bound and are refused.
// In closed form: J = 8n E(k) − (3 − 2k²) T.
#include <costate/costate.hpp>

#include <cstdio>

using namespace costate;

struct Pendulum {
  static constexpr int states = 1, controls = 1, parameters = 0;
  template <class S>
  Vec<S, 1> dynamics(const Vec<S, 1>&, const Vec<S, 1>& u, const Vec<S, 0>&) const {
    return {u[0]};
  }
  template <class S>
  S cost(const Vec<S, 1>& q, const Vec<S, 1>& u, const Vec<S, 0>&) const {
    return 0.5 * u[0] * u[0] + cos(q[0]);
  }
};

int main() {
  ControlProblem problem(Pendulum{});
  problem.state("x", {.start = 0.0, .end = 0.0}).control("u", {.lower = -1.9, .upper = 1.9}).final_time(10.0).interior();
  const Search search = find_extremals(problem.shared(), {.starts = 200, .box = {{-2.0, 2.0}}});
  for (const Extremal& extremal : search.extremals) {
    std::printf("extremal, %d hits\n", extremal.hits);
    print(extremal.solution);
  }
  for (const Extremal& root : search.refused) std::printf("refused: J = %.10g, %s\n", root.cost, root.verdict.c_str());
  std::printf("chance that the next start finds another: %.2g\n", search.unseen());
  return search.extremals.empty() ? 1 : 0;
}
