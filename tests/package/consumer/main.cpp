// A user of the installed libraries: the free disk from a rough start.
#include <costate/models/disk.hpp>
#include <costate/shooting/solve.hpp>

#include <cmath>
#include <cstdio>

int main() {
  using namespace costate;
  const auto problem = disk::make_problem(disk::Scene{}, {{disk::ArcKind::free}});
  const Eigen::Vector3d start{1.0, 0.5, 2.2};  // speed angle, λ across, duration
  const Solution solution = solve(problem, start, {.accuracy = 1e-9});
  if (!solution.solved()) {
    std::printf("not solved: %s\n", solution.message.c_str());
    return 1;
  }
  const double expected = 2.2117064716698363;
  std::printf("final time %.16g, expected %.16g\n", solution.final_time(), expected);
  return std::abs(solution.final_time() - expected) <= 1e-8 ? 0 : 1;
}
