/// Scenes of the rolling disk drawn at random, with friction around the limit that the unlimited motion uses: each solved from itself
/// alone and integrated again by other means, or refused with its reason.
#include "disk_check.hpp"

#include "disk/disk_scene.hpp"

#include <cstdlib>
#include <gtest/gtest.h>
#include <map>
#include <random>

namespace costate::test {
namespace {

int scenes_wanted() {
  const char* text = std::getenv("COSTATE_SCENES");
  return text == nullptr ? 30 : std::atoi(text);
}

std::string describe(const disk::Scene& scene) {
  return fmt::format("--x {:.6g} --y {:.6g} --heading {:.6g} --friction {:.8g}", scene.x, scene.y, scene.heading,
                     scene.friction.value_or(0.0));
}

/// x_f, y_f evenly in [−0.5, 3], φ_f in [0.3, 3], k_f/F_max in [0.7, 1.1]; r = √6, c₁ = 1.
TEST(DiskSweep, ScenesAreSolvedOrRefusedWithAReason) {
  std::mt19937_64 engine(20250612);
  const auto even = [&](double low, double high) { return std::uniform_real_distribution<double>(low, high)(engine); };
  std::map<std::string, int> kinds;
  std::vector<std::string> refusals, wrong;
  double slowest = 0.0, total = 0.0;
  std::string slow;
  int solved = 0;
  const int count = scenes_wanted();
  for (int i = 0; i < count; ++i) {
    disk::Scene scene;
    scene.x = even(-0.5, 3.0);
    scene.y = even(-0.5, 3.0);
    scene.heading = even(0.3, 3.0);
    const double part = even(0.7, 1.1);
    const disk::Outcome unlimited = disk::solve_scene(scene, {.accuracy = 1e-8});
    total += unlimited.cost.seconds;
    if (!unlimited.solved()) {
      ++kinds["refused without friction"];
      refusals.push_back(describe(scene) + ": " + unlimited.message);
      continue;
    }
    scene.friction = part * *unlimited.F_max;
    const disk::Outcome outcome = disk::solve_scene(scene, {.accuracy = 1e-8});
    if (outcome.cost.seconds > slowest) {
      slowest = outcome.cost.seconds;
      slow = describe(scene);
    }
    total += outcome.cost.seconds;
    if (!outcome.solved()) {
      ++kinds[outcome.status == tools::Outcome::Status::infeasible ? "no solution" : "refused"];
      refusals.push_back(describe(scene) + ": " + outcome.message);
      continue;
    }
    ++solved;
    ++kinds[letters(*outcome.solution.problem)];
    // The forward system of the check amplifies errors by up to 10⁵ (its condition at distances of 4 L).
    std::string objection = disk_objection(scene, outcome.solution, 1e-5);
    const double gain = unlimited.solution.final_time() - outcome.solution.final_time();
    if (objection.empty() && gain > 1e-8) objection = fmt::format("faster by {:.3g} s than without a limit", gain);
    if (!objection.empty()) wrong.push_back(describe(scene) + ": " + letters(*outcome.solution.problem) + ": " + objection);
  }
  for (const auto& [kind, number] : kinds) fmt::print("{:6}  {}\n", number, kind);
  for (const std::string& refusal : refusals) fmt::print("  {}\n", refusal);
  fmt::print("{} scenes, {:.0f} ms each, the slowest {:.0f} ms: {}\n", count, 1e3 * total / count, 1e3 * slowest, slow);
  EXPECT_TRUE(wrong.empty()) << fmt::format("{}", fmt::join(wrong, "\n"));
  // 937 of the first 1000; of a few it may be some less.
  EXPECT_GE(solved, count * 4 / 5);
}

}  // namespace
}  // namespace costate::test
