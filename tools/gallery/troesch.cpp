// Troesch's two-point problem, a plasma column under radiation pressure: the solution climbs in a layer of width 1/μ at t = 1.
//   y'' = μ sinh(μ y),   y(0) = 0,  y(1) = 1,   μ = 9.
// In closed form: y'(0) = s with ∫₀¹ dy/√(s² + 4 sinh²(μ y/2)) = 1, and y'(1)² = s² + 4 sinh²(μ/2).
// B. A. Troesch, J. Comput. Phys. 21 (1976) 279–290; problem 23 of the test set of J. R. Cash & F. Mazzia.
#include <costate/costate.hpp>

using namespace costate;

struct Troesch {
  static constexpr int states = 2, parameters = 1;
  template <class S>
  Vec<S, 2> rates(const S&, const Vec<S, 2>& y, const Vec<S, 1>& p) const {
    return {y[1], p[0] * sinh(p[0] * y[0])};
  }
};

int main() {
  TwoPoint problem(Troesch{}, 0.0, 1.0);
  problem.state("y", {.start = 0.0, .end = 1.0}).state("y'").parameter("mu", 9.0);
  return print(solve(problem.shared()));
}
