// Goddard's rocket climbs as high as its fuel takes it, no faster than 0.1: full thrust, a singular arc, an arc along the speed limit
// (first-order state constraint), coasting.
//   maximise r(T),   r' = v,  v' = (3.5 u − D)/m − 1/r²,  m' = −7 u,  D = 310 v² exp(−500 (r − 1)),  0 ≤ u ≤ 1,  v ≤ 0.1,
//   r(0) = 1,  v(0) = 0,  m(0) = 1,  m(T) = 0.6,  T free.
// H. Seywald & E. M. Cliff, J. Guidance Control Dyn. 16 (1993) 776–777; numbers after the tutorial of OptimalControl.jl.
#include <costate/costate.hpp>

using namespace costate;

struct Goddard {
  static constexpr int states = 3, controls = 1, parameters = 0;
  template <class S>
  Vec<S, 3> dynamics(const Vec<S, 3>& q, const Vec<S, 1>& u, const Vec<S, 0>&) const {
    const auto& [r, v, m] = q;
    const S thrust = 3.5 * u[0], drag = 310.0 * v * v * exp(-500.0 * (r - 1.0));
    return {v, (thrust - drag) / m - 1.0 / (r * r), -2.0 * thrust};
  }
  template <class S>
  S cost(const Vec<S, 3>&, const Vec<S, 1>&, const Vec<S, 0>&) const {
    return S(0.0);  // a system without a cost is one of minimum time
  }
};

int main() {
  ControlProblem problem(Goddard{});
  problem.state("r", {.start = 1.0}).state("v", {.start = 0.0}).state("m", {.start = 1.0, .end = 0.6});
  problem.control("thrust", {.lower = 0.0, .upper = 1.0}).free_final_time(0.2);
  problem.terminal_cost([](const auto& at) { return -at.end[0]; });
  problem.constraint("speed", [](const auto& q, const auto&) { return q[1] - 0.1; });
  problem.upper().singular().boundary("speed").lower();
  return print(solve(problem.shared()));
}
