// The cheapest way between two states leads along a third, by an arc on which H_u vanishes identically (a singular arc):
//   minimise ∫ x² dt,   x' = u,  |u| ≤ 1,   x(0) = 1,  x(2) = ½.
// In closed form: u = −1 until t1 = 1, x = 0 until t2 = 3/2, then u = 1; J = 1/3 + 1/24 = 3/8.
#include <costate/costate.hpp>

using namespace costate;

struct Turnpike {
  static constexpr int states = 1, controls = 1, parameters = 0;
  template <class S>
  Vec<S, 1> dynamics(const Vec<S, 1>&, const Vec<S, 1>& u, const Vec<S, 0>&) const {
    return {u[0]};
  }
  template <class S>
  S cost(const Vec<S, 1>& q, const Vec<S, 1>&, const Vec<S, 0>&) const {
    return q[0] * q[0];
  }
};

int main() {
  ControlProblem problem(Turnpike{});
  problem.state("x", {.start = 1.0, .end = 0.5}).control("u", {.lower = -1.0, .upper = 1.0}).final_time(2.0);
  problem.lower().singular().upper();
  return print(solve(problem.shared()));
}
