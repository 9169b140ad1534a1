// A unit mass is moved by unit distance in unit time, from rest to rest, with the least effort:
//   minimise ∫ ½ u² dt,   x' = v,  v' = u,   x(0) = 0,  x(1) = 1,  v(0) = v(1) = 0.
// In closed form: u = 6 − 12 t, J = 6, λ(0) = (12, 6).
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
  problem.state("x", {.start = 0.0, .end = 1.0}).state("v", {.start = 0.0, .end = 0.0}).control("u");
  problem.final_time(1.0).interior();
  return print(solve(problem.shared()));
}
