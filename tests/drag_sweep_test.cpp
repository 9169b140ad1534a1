/// Scenes of the bead with drag drawn at random across the domain, each solved from itself alone and integrated again by
/// other means.
#include "drag_check.hpp"

#include <cstdlib>
#include <gtest/gtest.h>
#include <map>
#include <random>

namespace costate::test {
namespace {

using drag::Scene;

/// v₀ 0.1 … 40 m/s and a 0.1 … 50 m, evenly in their logarithms; b −50 … a/4 m; μ 0 … 1 /s; |β| V² between 0.03 and 3 times
/// μ, where V² = v₀² + 2 g max(0, −b) is what a fall without friction would reach: linear and cubic friction are of one
/// size. Every second scene is soft. Every tenth end point lies at 0.99 of the height that can be reached, where that is
/// below a/4.
class Scenes {
 public:
  Scene draw() {
    Scene scene;
    ++count_;
    scene.speed = logarithmic(0.1, 40.0);
    scene.x = logarithmic(0.1, 50.0);
    scene.y = even(-50.0, scene.x / 4.0);
    scene.mu = even(0.0, 1.0);
    const double V2 = scene.speed * scene.speed + 2.0 * scene.gravity * std::max(0.0, -scene.y);
    scene.beta = (count_ % 2 == 0 ? 1.0 : -1.0) * scene.mu * logarithmic(0.03, 3.0) / V2;
    if (count_ % 10 < 2 && scene.beta * scene.speed * scene.speed < scene.mu) {
      const double height = drag_throw(scene);
      if (height < scene.x / 4.0) scene.y = 0.99 * height;
    }
    return scene;
  }

 private:
  double even(double low, double high) { return std::uniform_real_distribution<double>(low, high)(engine_); }
  double logarithmic(double low, double high) { return std::exp(even(std::log(low), std::log(high))); }

  std::mt19937_64 engine_{20250611};
  int count_ = 0;
};

int scenes_wanted() {
  const char* text = std::getenv("COSTATE_SCENES");
  return text == nullptr ? 40 : std::atoi(text);
}

std::string describe(const Scene& scene) {
  return fmt::format("--x {:.6g} --y {:.6g} --speed {:.6g} --mu {:.6g} --beta {:.6g}", scene.x, scene.y, scene.speed,
                     scene.mu, scene.beta);
}

TEST(DragSweep, ScenesAreSolvedOrCorrectlyCalledInfeasible) {
  Scenes scenes;
  std::map<std::string, int> kinds;
  std::vector<std::string> failures, wrong;
  double slowest = 0.0, total = 0.0;
  const int count = scenes_wanted();
  for (int i = 0; i < count; ++i) {
    const Scene scene = scenes.draw();
    const std::string name = (scene.beta > 0.0 ? "soft " : "hard ");
    const tools::Outcome outcome = drag::solve_scene(scene, {.accuracy = 1e-8});
    slowest = std::max(slowest, outcome.cost.seconds);
    total += outcome.cost.seconds;
    const bool resisted = scene.beta * scene.speed * scene.speed <= scene.mu;
    const bool out_of_reach = resisted && scene.y >= drag_throw(scene);
    switch (outcome.status) {
      case tools::Outcome::Status::solved: {
        const std::string objection = drag_objection(scene, outcome.solution, 1e-6);
        if (!objection.empty() || out_of_reach) wrong.push_back(describe(scene) + ": " + objection);
        ++kinds[name + "solved"];
        for (const Solution& other : outcome.other_extremals) {
          const std::string other_objection = drag_objection(scene, other, 1e-6);
          if (!other_objection.empty()) wrong.push_back(describe(scene) + ": another extremal " + other_objection);
          ++kinds[name + "other extremals"];
        }
        break;
      }
      case tools::Outcome::Status::infeasible:
        if (out_of_reach) {
          ++kinds[name + "out of reach"];
        } else if (scene.beta > 0.0) {
          ++kinds[name + "without a local minimum"];
          failures.push_back(describe(scene) + ": " + outcome.message);
        } else {
          wrong.push_back(describe(scene) + ": " + outcome.message);
        }
        break;
      case tools::Outcome::Status::failed:
        ++kinds[name + "failed"];
        failures.push_back(describe(scene) + ": " + outcome.message);
        break;
    }
  }
  for (const auto& [kind, number] : kinds) fmt::print("{:6}  {}\n", number, kind);
  for (const std::string& failure : failures) fmt::print("  {}\n", failure);
  fmt::print("{} scenes, {:.0f} ms each, the slowest {:.0f} ms\n", count, 1e3 * total / count, 1e3 * slowest);
  EXPECT_TRUE(wrong.empty()) << fmt::format("{}", fmt::join(wrong, "\n"));
  // One in a hundred; of a few scenes one, for the scene drawn third is one of the rare ones: thrust from the start towards
  // a high point.
  EXPECT_LE(kinds["hard failed"] + kinds["soft failed"], std::max(1, count / 100));
  EXPECT_GT(kinds["hard solved"] + kinds["soft solved"], count / 2);
}

}  // namespace
}  // namespace costate::test
