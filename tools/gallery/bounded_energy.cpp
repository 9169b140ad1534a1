// The least effort with a bound: 5 is less than the 6 that the motion without a bound begins and ends with.
//   minimise ∫ ½ u² dt,   x' = v,  v' = u,  |u| ≤ 5,   x(0) = 0,  x(1) = 1,  v(0) = v(1) = 0.
// In closed form: u = 5 until t1 = (1 − √0.6)/2, then linear, then −5 from 1 − t1 on; λ(0) = (p, p/2) with p = √(500/3).
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
  problem.control("u", {.lower = -5.0, .upper = 5.0}).final_time(1.0).upper().interior().lower();
  return print(solve(problem.shared()));
}
