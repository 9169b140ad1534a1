// A unit mass is moved by unit distance, from rest to rest, in the least time:
//   minimise T,   x' = v,  v' = u,  |u| ≤ 1,   x(0) = 0,  x(T) = 1,  v(0) = v(T) = 0.
// In closed form: u = 1 until t1 = 1, then −1; T = 2. Nothing depends on x, which makes it a quadrature: it is declared `cyclic`.
// L. S. Pontryagin et al., The Mathematical Theory of Optimal Processes, 1962, §5.
#include <costate/costate.hpp>

using namespace costate;

struct Mass {
  static constexpr int states = 2, cyclic = 1, controls = 1, parameters = 0;
  template <class S>
  Vec<S, 2> dynamics(const Vec<S, 2>& q, const Vec<S, 1>& u, const Vec<S, 0>&) const {
    return {q[1], u[0]};
  }
};

int main() {
  ControlProblem problem(Mass{});
  problem.state("x", {.start = 0.0, .end = 1.0}).state("v", {.start = 0.0, .end = 0.0});
  problem.control("u", {.lower = -1.0, .upper = 1.0}).free_final_time(1.0).upper().lower();
  return print(solve(problem.shared()));
}
