// From one circular orbit to another in the least time by a constant low thrust, whose direction is steered and whose fuel makes the craft
// lighter. Lengths in radii of the first orbit, times in its period/2π; u is the angle of the thrust to the horizon.
//   minimise T,   r' = v,  v' = w²/r − 1/r² + a sin u,  w' = −v w/r + a cos u,  m' = −0.07487,  a = 0.1405/m,
//   (r, v, w, m)(0) = (1, 0, 1, 1),   (r, v, w)(T) = (1.525, 0, 1/√1.525).
// From Earth to Mars; A. E. Bryson & Y.-C. Ho, Applied Optimal Control, 1975, §2.5, where T is given and r(T) = 1.525 is the largest.
#include <costate/costate.hpp>

#include <cmath>

using namespace costate;

struct Craft {
  static constexpr int states = 4, controls = 1, parameters = 2;
  template <class S>
  Vec<S, 4> dynamics(const Vec<S, 4>& q, const Vec<S, 1>& u, const Vec<S, 2>& p) const {
    const auto& [r, v, w, m] = q;
    return {v, w * w / r - 1.0 / (r * r) + p[0] / m * sin(u[0]), -v * w / r + p[0] / m * cos(u[0]), -p[1]};
  }
};

int main() {
  ControlProblem problem(Craft{});
  problem.state("r", {.start = 1.0, .end = 1.525}).state("v", {.start = 0.0, .end = 0.0});
  problem.state("w", {.start = 1.0, .end = 1.0 / std::sqrt(1.525)}).state("m", {.start = 1.0});
  problem.control("u", {.unit = "rad"}).parameter("thrust", 0.1405).parameter("flow", 0.07487);
  problem.free_final_time(3.0).interior();
  return print(solve(problem.shared()));
}
