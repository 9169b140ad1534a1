// Flow between two discs that rotate against each other, with layers at both of them:
//   ε f'''' + f f''' + g g' = 0,  ε g'' + f g' − f' g = 0,   f = f' = 0 at both ends,  g(0) = −1,  g(1) = 1,   ε = 10⁻³.
// The solution is odd about the middle. U. Ascher, R. Mattheij & R. Russell, Numerical Solution of Boundary Value Problems for Ordinary
// Differential Equations, SIAM 1995, ch. 1; problem 33 of the test set of J. R. Cash & F. Mazzia.
#include <costate/costate.hpp>

using namespace costate;

struct SwirlingFlow {
  static constexpr int states = 6, parameters = 1;
  template <class S>
  Vec<S, 6> rates(const S&, const Vec<S, 6>& y, const Vec<S, 1>& p) const {
    const auto& [g, dg, f, df, ddf, dddf] = y;
    return {dg, (df * g - f * dg) / p[0], df, ddf, dddf, -(f * dddf + g * dg) / p[0]};
  }
};

int main() {
  TwoPoint problem(SwirlingFlow{}, 0.0, 1.0);
  problem.state("g", {.start = -1.0, .end = 1.0}).state("g'");
  problem.state("f", {.start = 0.0, .end = 0.0}).state("f'", {.start = 0.0, .end = 0.0}).state("f''").state("f'''");
  problem.parameter("epsilon", 1e-3);
  return print(solve(problem.shared()));
}
