/// The ends of the domain of the bead with Coulomb friction: solved as well as the middle, and conditioned as well.
#include "coulomb/coulomb_scene.hpp"
#include "coulomb_reference.hpp"

#include <gtest/gtest.h>

namespace costate::test {
namespace {

using coulomb::Scene;
using tools::Outcome;

/// Solves to 1e-8 and holds costates and time against the closed form, whose sums are of positive terms but for y.
Outcome expect_extreme(const Scene& scene, double closed_form_relative) {
  SCOPED_TRACE(testing::Message() << "H " << scene.drop << " L " << scene.span << " mu " << scene.friction << " g "
                                  << scene.gravity);
  Outcome outcome = coulomb::solve_scene(scene, {.accuracy = 1e-8});
  EXPECT_TRUE(outcome.solved()) << outcome.message;
  if (!outcome.solved()) return outcome;
  for (const Quantity& q : outcome.quantities()) {
    EXPECT_TRUE(std::isfinite(q.value)) << q.name;
    EXPECT_LE(q.error_bound, 1e-8 * std::max(1.0, std::abs(q.value))) << q.name;
  }
  EXPECT_LT(outcome.cost.seconds, 0.2);
  const CoulombEnd end = coulomb_closed_form(scene, outcome["lambda_x"].value, outcome["lambda_y"].value);
  EXPECT_NEAR(static_cast<double>(end.t) / outcome["final_time"].value, 1.0, closed_form_relative);
  EXPECT_NEAR(static_cast<double>(end.x) / scene.span, 1.0, closed_form_relative);
  const double T = outcome["final_time"].value;
  const double lambda_x = outcome["lambda_x"].value, lambda_y = outcome["lambda_y"].value;
  const double terms = scene.span * std::abs(lambda_x) + scene.drop * std::abs(lambda_y);
  EXPECT_NEAR(scene.span * lambda_x + scene.drop * lambda_y, 0.5 * T, 1e-8 * terms);
  return outcome;
}

TEST(CoulombExtremes, FrictionAlmostAtTheLimit) {
  // The costates fix the end as ε^{-1/4} fixes the time: a relative error e of them is e/ε of ε, ε ≈ 4 (1 − μL/H).
  for (const auto& [mu, relative] : {std::pair{1.249, 1e-6}, {1.249999, 1e-3}}) {
    const Outcome outcome = expect_extreme({5.0, 4.0, 9.81, mu}, relative);
    EXPECT_LT(outcome.solution.certificate.condition, 4.0);
  }
  // As μ → H/L the time grows as the inverse fourth root of the distance.
  double before = 0.0;
  for (const double distance : {1e-6, 1e-9, 1e-12}) {
    const Outcome outcome = coulomb::solve_scene({1.0, 1.0, 9.81, 1.0 - distance}, {.accuracy = 1e-8});
    ASSERT_TRUE(outcome.solved()) << outcome.message;
    EXPECT_LT(outcome.solution.certificate.condition, 4.0);
    const double time = outcome["final_time"].value;
    // A thousand times nearer: 1000^(1/4), up to the next term, of the order of √ε; and the last bits of μ at 1e-12.
    if (before > 0.0) {
      EXPECT_NEAR(time / before / std::pow(1000.0, 0.25), 1.0, 1e-2);
    }
    before = time;
  }
}

TEST(CoulombExtremes, FlatScenes) {
  // At 2μ = H/L, H/L → 0, the end slope changes over from that of a full arch (π − φ_F ~ √(H/L)) to that of friction (~ μ):
  // there, and only there, it hangs on μ without bound, whatever the formulation: (y − μx)/x = μ + ψ²/π + O(μ²/ψ), ψ = π −
  // φ_F, is flattest where ψ³ ~ μ², and by ψ ~ (H/L)^{2/3} its logarithm changes by (H/L)^{1/3} only.
  const auto conditioned = [](double chord) { return 4.0 + 0.7 * std::pow(chord, -1.0 / 3.0); };
  for (const double drop : {1e-2, 1e-3, 1e-4, 1e-5, 1e-6}) {
    for (const double part : {1e-6, 0.1, 0.3, 0.49, 0.5, 0.51, 0.6, 0.9, 0.99}) {
      const Outcome outcome = coulomb::solve_scene({drop, 1.0, 9.81, part * drop}, {.accuracy = 1e-8});
      ASSERT_TRUE(outcome.solved()) << drop << " " << part << ": " << outcome.message;
      EXPECT_TRUE(outcome.solution.certificate.holds());
      EXPECT_LT(outcome.solution.certificate.condition, std::abs(2.0 * part - 1.0) > 0.15 ? 6.0 : conditioned(drop))
          << drop << " " << part;
    }
  }
  expect_extreme({1e-2, 1.0, 9.81, 0.005}, 1e-6);
}

TEST(CoulombExtremes, SteepScenes) {
  for (const double span : {1e-2, 1e-4, 1e-6}) {
    for (const double mu : {1e-6, 0.5, 5.0, 0.99 / span}) {
      const Outcome outcome = expect_extreme({1.0, span, 9.81, mu}, mu * span > 0.9 ? 1e-5 : 1e-7);
      EXPECT_LT(outcome.solution.certificate.condition, 4.0) << span << " " << mu;
    }
  }
}

TEST(CoulombExtremes, LittleFrictionMuchFrictionAndUnits) {
  const Outcome little = expect_extreme({1.0, 1.0, 9.81, 1e-8}, 1e-8);
  EXPECT_NEAR(little["final_time"].value, 0.5828954631547426 + 1e-8 * 0.2607, 1e-11) << "the cycloid's time and dT/dmu at 0";
  expect_extreme({10.0, 1.0, 9.81, 4.0}, 1e-8);
  expect_extreme({1e6, 1.0, 9.81, 5e5}, 1e-8);
  expect_extreme({1e6, 1e6, 1e-6, 0.5}, 1e-8);
  expect_extreme({1e-6, 1e-6, 1e6, 0.5}, 1e-8);
  expect_extreme({1e6, 1e-6, 9.81, 1e6}, 1e-7);
  EXPECT_TRUE(coulomb::solve_scene({1.0, 1.0, 9.81, 1e-300}, {}).solved());
}

TEST(CoulombExtremes, BeyondTheLimitThereIsNoSolution) {
  const double above = std::nextafter(0.7, 1.0), below = std::nextafter(0.7, 0.0);
  for (const auto& [scene, solved] : {std::pair{Scene{0.7, 1.0, 9.81, above}, false},
                                      {Scene{0.7, 1.0, 9.81, 0.7}, false},
                                      {Scene{0.7, 1.0, 9.81, below}, true},
                                      {Scene{0.0, 1.0, 9.81, 0.0}, false},
                                      {Scene{-2.0, 1.0, 9.81, 0.0}, false},
                                      {Scene{-2.0, 1.0, 9.81, 0.5}, false}}) {
    const Outcome outcome = coulomb::solve_scene(scene, {});
    EXPECT_EQ(outcome.status, solved ? Outcome::Status::solved : Outcome::Status::infeasible) << outcome.message;
    ASSERT_EQ(outcome.limits.size(), 1U);
    EXPECT_EQ(outcome.limits[0].name, "mu_max");
    EXPECT_EQ(outcome.limits[0].value.value(), scene.drop / scene.span);
  }
}

}  // namespace
}  // namespace costate::test
