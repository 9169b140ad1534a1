/// Scenes of the bead with drag, solved from themselves alone: references, identities, invariances, limits.
#include "drag_check.hpp"

#include <costate/error.hpp>
#include <costate/models/cycloid.hpp>
#include <costate/shooting/branch.hpp>

#include <fstream>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace costate::drag {
namespace {

using nlohmann::json;
using tools::Outcome;

/// The reference cases of the drag model. `second` are extremals that are no minima.
struct ReferenceCase {
  std::string name;
  Scene scene;
  json solution;
  std::vector<double> focal;
  bool second;
};
void PrintTo(const ReferenceCase& c, std::ostream* out) { *out << c.name; }

std::vector<ReferenceCase> reference_cases() {
  std::ifstream file(std::string(COSTATE_REFERENCE_DIR) + "/nonlinear_friction.json");
  std::vector<ReferenceCase> found;
  const json data = json::parse(file);
  for (const json& entry : data.at("cases")) {
    if (entry.at("model") != "C") continue;
    const json& p = entry.at("params");
    found.push_back({entry.at("id"),
                     {p.at("a"), p.at("b"), p.at("v0"), p.at("mu"), p.at("beta"), p.at("g")},
                     entry.at("solution"),
                     entry.at("checks").at("focal_points_s"),
                     !entry.at("local_minimum").get<bool>()});
  }
  return found;
}

class Reference : public testing::TestWithParam<ReferenceCase> {};

void expect_reference(const std::vector<Quantity>& found, const json& expected, double accuracy) {
  const std::pair<const char*, const char*> names[]{{"T", "final_time"}, {"theta1", "theta1"}, {"theta2", "theta2"},
                                                    {"lx", "lambda_x"},  {"ly", "lambda_y"},   {"lv0", "lambda_v0"},
                                                    {"vf", "v_f"}};
  for (const auto& [key, name] : names) {
    const double value = expected.at(key);
    const Quantity& quantity = find({&found}, name);
    EXPECT_NEAR(quantity.value, value, 1e-10 * std::abs(value)) << name;
    // The references have 16 digits; two units in the last place of theirs beside the claimed bound.
    EXPECT_NEAR(quantity.value, value, quantity.error_bound + 4e-16 * std::abs(value))
        << name << ": the claimed bound does not hold";
    EXPECT_LE(quantity.error_bound, accuracy * std::max(1.0, std::abs(value))) << name;
  }
}

TEST_P(Reference, ReproducesInEveryUnknown) {
  const ReferenceCase& c = GetParam();
  constexpr double accuracy = 1e-11;
  const Outcome outcome = solve_scene(c.scene, {.accuracy = accuracy});
  ASSERT_TRUE(outcome.solved()) << outcome.message;
  if (!c.second) {
    expect_reference(outcome.quantities(), c.solution, accuracy);
    return;
  }
  ASSERT_EQ(outcome.other_extremals.size(), 1U);
  const Solution& other = outcome.other_extremals.front();
  expect_reference(other.reports, c.solution, accuracy);
  EXPECT_NE(other.message.find("focal point"), std::string::npos) << other.message;
  const std::vector<double> focal = focal_times(other);
  ASSERT_EQ(focal.size(), c.focal.size());
  for (std::size_t i = 0; i < focal.size(); ++i) {
    // The references give the last node before the change of sign, of 200 over the path. FocalTimes of drag_test has
    // sharper ones.
    EXPECT_GE(focal[i], c.focal[i]);
    EXPECT_LE(focal[i], c.focal[i] + other.final_time() / 200);
  }
}

INSTANTIATE_TEST_SUITE_P(Drag, Reference, testing::ValuesIn(reference_cases()),
                         [](const auto& test) { return test.param.name; });

TEST(DragScene, WithoutFrictionIsTheCycloidInClosedForm) {
  Scene scene;
  scene.mu = scene.beta = 0.0;
  const Outcome outcome = solve_scene(scene, {});
  ASSERT_TRUE(outcome.closed_form);
  EXPECT_NEAR(outcome["final_time"].value, 1.3195056806149265, 1e-14);
  EXPECT_EQ(outcome.cost.steps, 0);
}

// T(μ, β) = T₀ + ∂T/∂μ μ + ∂T/∂β β with ∂T/∂μ = −∫H_μ dt = ∫λv v dt, ∂T/∂β = −∫λv v³ dt along the cycloid.
TEST(DragScene, WeakFrictionIsTheCycloidAndItsFirstVariation) {
  Scene scene;
  const Cycloid free = cycloid(scene.x, scene.y, scene.speed, scene.gravity).value();
  double by_mu = 0.0, by_beta = 0.0;
  constexpr int cells = 2000;  // midpoint rule: h² = 1e-7 relative
  for (int i = 0; i < cells; ++i) {
    const Cycloid::Point p = free.at(free.final_time * (i + 0.5) / cells);
    by_mu += p.lambda_v * p.v * free.final_time / cells;
    by_beta -= p.lambda_v * p.v * p.v * p.v * free.final_time / cells;
  }
  for (const auto& [mu, beta] : {std::pair{1e-5, 0.0}, std::pair{0.0, 1e-7}, std::pair{0.0, -1e-7}, std::pair{1e-5, 1e-7}}) {
    scene.mu = mu;
    scene.beta = beta;
    const Outcome outcome = solve_scene(scene, {.accuracy = 1e-11});
    ASSERT_TRUE(outcome.solved()) << outcome.message;
    // Second order: some (μT)², (β v² T)² of 1e-10.
    EXPECT_NEAR(outcome["final_time"].value - free.final_time, by_mu * mu + by_beta * beta, 1e-9) << mu << ' ' << beta;
  }
}

// ∂T/∂a = λx, ∂T/∂b = λy: the costates are the prices of the end point.
TEST(DragScene, CostatesAreTheDerivativesOfTheTime) {
  for (const double beta : {0.004, -0.01}) {
    Scene scene;
    scene.beta = beta;
    const Outcome middle = solve_scene(scene, {.accuracy = 1e-11});
    const auto time = [&](double dx, double dy) {
      Scene moved = scene;
      moved.x += dx;
      moved.y += dy;
      return solve_scene(moved, {.accuracy = 1e-11})["final_time"].value;
    };
    constexpr double h = 1e-3;  // truncation h²/6 times third derivatives below 1; noise 1e-11/h
    EXPECT_NEAR((time(h, 0) - time(-h, 0)) / (2 * h), middle["lambda_x"].value, 1e-6);
    EXPECT_NEAR((time(0, h) - time(0, -h)) / (2 * h), middle["lambda_y"].value, 1e-6);
  }
}

// Lengths by k, g by q: times by √(k/q), speeds by √(kq), μ by 1/time, β by 1/(speed² time).
TEST(DragScene, InvariantUnderScalingOfLengthAndTime) {
  const Outcome plain = solve_scene({}, {.accuracy = 1e-10});
  for (const double k : {1e-3, 0.4, 300.0}) {
    for (const double q : {0.02, 5.0}) {
      const double time = std::sqrt(k / q), speed = std::sqrt(k * q);
      Scene scene;
      scene = {scene.x * k,      scene.y * k, scene.speed * speed, scene.mu / time, scene.beta / (speed * speed * time),
               scene.gravity * q};
      const Outcome outcome = solve_scene(scene, {.accuracy = 1e-10});
      ASSERT_TRUE(outcome.solved()) << outcome.message;
      for (const auto& [name, unit] :
           {std::pair{"final_time", time}, std::pair{"lambda_x", 1 / speed}, std::pair{"lambda_y", 1 / speed},
            std::pair{"lambda_v0", time / speed}, std::pair{"theta1", 1.0}, std::pair{"v_f", speed}}) {
        const Quantity &a = plain[name], &b = outcome[name];
        EXPECT_NEAR(b.value / unit, a.value, a.error_bound + b.error_bound / unit + 1e-14 * std::abs(a.value))
            << name << ' ' << k << ' ' << q;
      }
      EXPECT_EQ(outcome.other_extremals.size(), 1U);
    }
  }
}

TEST(DragScene, ClaimedBoundsHoldAtEveryAccuracy) {
  for (const Scene& scene : {Scene{}, Scene{20, -3, 2, 0.8, -0.002, 9.8}, Scene{10, -4, 15, 0.5, -0.002, 9.8},
                             Scene{50, -2, 30, 0.9, -0.01, 9.8}}) {
    const Outcome exact = solve_scene(scene, {.accuracy = 1e-11});
    ASSERT_TRUE(exact.solved()) << exact.message;
    for (const double accuracy : {1e-4, 1e-6, 1e-8}) {
      const Outcome outcome = solve_scene(scene, {.accuracy = accuracy});
      ASSERT_TRUE(outcome.solved()) << outcome.message;
      for (const Quantity& quantity : outcome.quantities()) {
        const Quantity& best = exact[quantity.name];
        EXPECT_NEAR(quantity.value, best.value, quantity.error_bound + best.error_bound) << quantity.name << ' ' << accuracy;
        EXPECT_LE(quantity.error_bound, accuracy * std::max(1.0, std::abs(quantity.value))) << quantity.name;
      }
    }
  }
}

TEST(DragScene, GreatestHeightIsThatOfAThrow) {
  for (const Scene& scene :
       {Scene{1, 0, 2, 0.3, 0.0, 9.8}, Scene{1, 0, 40, 1.0, -0.01, 9.8}, Scene{1, 0, 0.1, 0.3, -5.0, 9.8},
        Scene{1, 0, 300, 0.0, -2.0, 9.8}, Scene{1, 0, 8, 0.3, 0.004, 9.8}}) {
    EXPECT_NEAR(greatest_height(scene) / test::drag_throw(scene), 1.0, 1e-11) << scene.speed;
  }
  Scene free;
  free.mu = free.beta = 0.0;
  EXPECT_NEAR(greatest_height(free), 4.0 / 19.6, 1e-15);
}

TEST(DragScene, ReachEndsAtTheGreatestHeight) {
  Scene scene{2.0, 0.0, 6.0, 0.3, -0.004, 9.8};
  const double height = greatest_height(scene);
  for (const double part : {0.9, 0.99, 0.9999}) {
    scene.y = part * height;
    const Outcome outcome = solve_scene(scene, {.accuracy = 1e-7});
    ASSERT_TRUE(outcome.solved()) << part << ' ' << outcome.message;
    EXPECT_EQ(test::drag_objection(scene, outcome.solution, 1e-6), "") << part;
  }
  scene.y = height;
  EXPECT_EQ(solve_scene(scene, {}).status, Outcome::Status::infeasible);
}

// A long way at a steady speed: errors of an integration in time would grow by a factor of more than e^{10000} here.
TEST(DragScene, LongWaysNearASteadyMotion) {
  Scene scene{1000.0, -10.0, 5.0, 0.3, -0.001, 9.8};
  const Outcome near = solve_scene(scene, {.accuracy = 1e-9});
  ASSERT_TRUE(near.solved()) << near.message;
  EXPECT_EQ(test::drag_objection(scene, near.solution, 1e-6), "");
  EXPECT_EQ(near.solution.problem->structure().size(), 2U);
  EXPECT_LT(near.solution.certificate.condition, 1e8);
  // Half-way the motion is steady: g sin θ = K(v), and dx/dt holds it for as long as the path lasts.
  const double T = near.solution.final_time();
  const std::vector<double> at = near.solution.at(0.5 * T);  // x, y, v, theta, …
  EXPECT_NEAR(scene.gravity * std::sin(at[3]), scene.friction().force(at[2]), 1e-12);
  EXPECT_NEAR(near.solution.at(0.6 * T)[0] - at[0], 0.1 * T * at[2] * std::cos(at[3]), 1e-8 * scene.x);
}

TEST(DragScene, OtherExtremalsAreExtremalsAndSlower) {
  for (const Scene& scene : {Scene{}, Scene{6, -1, 2, 0.1, 0.002, 9.8}, Scene{10, -46, 28.9, 0.41, 0.00023, 9.8}}) {
    const Outcome outcome = solve_scene(scene, {});
    ASSERT_TRUE(outcome.solved()) << outcome.message;
    EXPECT_EQ(test::drag_objection(scene, outcome.solution, 1e-6), "");
    ASSERT_FALSE(outcome.other_extremals.empty());
    for (const Solution& other : outcome.other_extremals) {
      EXPECT_EQ(test::drag_objection(scene, other, 1e-6), "");
      EXPECT_GT(other.final_time(), outcome.solution.final_time());
    }
  }
}

TEST(DragScene, ForeignProblemsHaveNoFamily) {
  class Foreign final : public Problem {
    void shoot(Shot&) const override {}
    [[nodiscard]] std::vector<Column> columns() const override { return {}; }
    [[nodiscard]] std::vector<double> observe(const ArcPoint&, const std::vector<double>&) const override { return {}; }
    [[nodiscard]] std::vector<PathCheck> check(const ArcPoint&, const std::vector<double>&) const override { return {}; }
  };
  EXPECT_THROW((void)family_of(Foreign()), BadInput);
}

// The second extremal (T = 1.86021418984332 s at β = 0.004 in the reference) followed in β by itself: no point of it is a minimum.
TEST(DragScene, TheSecondExtremalIsFollowedAndNeverAMinimum) {
  const Outcome outcome = solve_scene({}, {.accuracy = 1e-10});
  ASSERT_EQ(outcome.other_extremals.size(), 1U);
  const Solution& second = outcome.other_extremals.front();
  EXPECT_NEAR(second.final_time(), 1.86021418984332, 1e-9);
  const Branch branch = trace(second.problem, second.parameters, second.y, "beta", 0.0055, {.landings = {0.0045, 0.005}});
  ASSERT_TRUE(branch.reached) << branch.message;
  EXPECT_TRUE(branch.events.empty());
  EXPECT_LE(branch.cost.newton_iterations, 6 * static_cast<long>(branch.points.size()));
  for (const BranchPoint& point : branch.points) {
    Shooting shooting(second.problem);
    std::vector<double> parameters = second.parameters;
    parameters[beta_place] = point.parameter;
    shooting.set_parameters(parameters);
    const Solution solution = solve(shooting, point.y);
    ASSERT_TRUE(solution.solved()) << solution.message;
    EXPECT_TRUE(focal_objection(solution).find("not a minimum") != std::string::npos) << point.parameter;
  }
}

}  // namespace
}  // namespace costate::drag
