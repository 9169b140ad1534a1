// Van der Pol's oscillator is calmed by a bounded force; where it ends is free, so that λ(T) = 0.
//   minimise ∫ ½ (x² + y² + u²) dt,   x' = y,  y' = μ (1 − x²) y − x + u,  |u| ≤ 1,   x(0) = 0,  y(0) = 1,   T = 5,  μ = 1.
// The force is at its lower bound first, and follows H_u = 0 from t1 on.
#include <costate/costate.hpp>

using namespace costate;

struct VanDerPol {
  static constexpr int states = 2, controls = 1, parameters = 1;
  template <class S>
  Vec<S, 2> dynamics(const Vec<S, 2>& q, const Vec<S, 1>& u, const Vec<S, 1>& mu) const {
    const auto& [x, y] = q;
    return {y, mu[0] * (1.0 - x * x) * y - x + u[0]};
  }
  template <class S>
  S cost(const Vec<S, 2>& q, const Vec<S, 1>& u, const Vec<S, 1>&) const {
    return 0.5 * (q[0] * q[0] + q[1] * q[1] + u[0] * u[0]);
  }
};

int main() {
  ControlProblem problem(VanDerPol{});
  problem.state("x", {.start = 0.0}).state("y", {.start = 1.0}).control("u", {.lower = -1.0, .upper = 1.0});
  problem.parameter("mu", 1.0).final_time(5.0).lower().interior();
  return print(solve(problem.shared()));
}
