// A cooling fin of two metals, hot at its root, insulated at its tip. How fast it loses heat is found from one measured temperature:
//   θ' = −q/k,  q' = −h θ,   k = 1 for x < 0.4, k = 5 beyond,   θ(0) = 1,  q(1) = 0,  θ(0.7) = ½ (an interior row),  h unknown.
// In closed form, with w = √h, v = √(h/5): θ = C cosh(v (1 − x)) beyond the joint; θ and q are continuous there.
#include <costate/costate.hpp>

using namespace costate;

struct Fin {
  static constexpr int states = 2, parameters = 1;
  double conductivity;
  template <class S>
  Vec<S, 2> rates(const S&, const Vec<S, 2>& y, const Vec<S, 1>& p) const {
    return {-y[1] / conductivity, -p[0] * y[0]};
  }
};

int main() {
  TwoPoint problem(Fin{.conductivity = 1.0}, 0.0, 0.4);
  problem.then(Fin{.conductivity = 5.0}, 1.0);
  problem.state("theta", {.start = 1.0}).state("q", {.end = 0.0}).unknown_parameter("h", {.guess = 1.0, .lower = 0.0});
  problem.row_at("measured", 0.7, [](const auto& at) { return at.state[0] - 0.5; });
  return print(solve(problem.shared()));
}
