// A hurry at either end and a long stay at rest between them: over T = 50 an error of λ(0) grows by e^50. The program cuts the arc as it
// must.
//   minimise ∫ ½ (x² + u²) dt,   x' = −x³ + u,   x(0) = 1.5,  x(50) = 1.
// In closed form for T → ∞, from H = 0: J = (G(1.5) − 1.5⁴/4) + (G(1) + 1/4), G(x) = (x² √(x⁴ + 1) + arsinh x²)/4.
// A. V. Rao & K. D. Mease, Optim. Control Appl. Meth. 21 (2000) 1–19.
#include <costate/costate.hpp>

using namespace costate;

struct Hypersensitive {
  static constexpr int states = 1, controls = 1, parameters = 0;
  template <class S>
  Vec<S, 1> dynamics(const Vec<S, 1>& q, const Vec<S, 1>& u, const Vec<S, 0>&) const {
    return {-q[0] * q[0] * q[0] + u[0]};
  }
  template <class S>
  S cost(const Vec<S, 1>& q, const Vec<S, 1>& u, const Vec<S, 0>&) const {
    return 0.5 * (q[0] * q[0] + u[0] * u[0]);
  }
};

int main() {
  ControlProblem problem(Hypersensitive{});
  problem.state("x", {.start = 1.5, .end = 1.0}).control("u").final_time(50.0).interior();
  return print(solve(problem.shared()));
}
