// Thrust of constant size is steered so that a given height and horizontal speed are reached in the least time:
//   minimise T,   x' = vx,  y' = vy,  vx' = a cos u,  vy' = a sin u,   all 0 at t = 0,  y(T) = 5,  vx(T) = 45,  vy(T) = 0,  x(T) free.
// tan u is linear in time. J. T. Betts, Practical Methods for Optimal Control, 2nd ed., example 4.4: T = 0.554570878.
#include <costate/costate.hpp>

using namespace costate;

struct Thrust {
  static constexpr int states = 4, cyclic = 2, controls = 1, parameters = 1;
  template <class S>
  Vec<S, 4> dynamics(const Vec<S, 4>& q, const Vec<S, 1>& u, const Vec<S, 1>& p) const {
    return {q[2], q[3], p[0] * cos(u[0]), p[0] * sin(u[0])};
  }
};

int main() {
  ControlProblem problem(Thrust{});
  problem.state("x", {.start = 0.0}).state("y", {.start = 0.0, .end = 5.0});
  problem.state("vx", {.start = 0.0, .end = 45.0}).state("vy", {.start = 0.0, .end = 0.0});
  problem.control("steering", {.unit = "rad"}).parameter("a", 100.0).free_final_time(1.0).interior();
  return print(solve(problem.shared()));
}
