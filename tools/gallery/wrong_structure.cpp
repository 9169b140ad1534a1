// What is said of a solution that is none: the least effort with the bound u ≤ 5, stated without an arc along the bound.
//   minimise ∫ ½ u² dt,   x' = v,  v' = u,  u ≤ 5,   x(0) = 0,  x(1) = 1,  v(0) = v(1) = 0.
// The equations have a root, the motion without a bound, which begins with u = 6. It is refused, with the reason. The arcs it takes are
// `.upper().interior()`.
#include <costate/costate.hpp>

using namespace costate;

struct DoubleIntegrator {
  static constexpr int states = 2, controls = 1, parameters = 0;
  template <class S>
  Vec<S, 2> dynamics(const Vec<S, 2>& q, const Vec<S, 1>& u, const Vec<S, 0>&) const {
    return {q[1], u[0]};
  }
  template <class S>
  S cost(const Vec<S, 2>&, const Vec<S, 1>& u, const Vec<S, 0>&) const {
    return 0.5 * u[0] * u[0];
  }
};

int main() {
  ControlProblem problem(DoubleIntegrator{});
  problem.state("x", {.start = 0.0, .end = 1.0}).state("v", {.start = 0.0, .end = 0.0});
  problem.control("u", {.upper = 5.0}).final_time(1.0).interior();
  return print(solve(problem.shared()));
}
