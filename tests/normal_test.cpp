/// The bead with normal-force friction from its scene alone: against references of 15 digits, closed forms, and identities.
#include "normal/normal_scene.hpp"
#include "normal_reference.hpp"

#include <Eigen/LU>
#include <gtest/gtest.h>

namespace costate::test {
namespace {

using normal_friction::Scene;
using normal_friction::solve_scene;
using tools::Outcome;

Outcome solved(const Scene& scene, double accuracy) {
  Outcome outcome = solve_scene(scene, {.accuracy = accuracy});
  EXPECT_EQ(outcome.status, Outcome::Status::solved) << outcome.message;
  return outcome;
}

class Reference : public testing::TestWithParam<NormalCase> {};

// The references are long doubles rounded to double; a component of λ is relative to |λ|, since one may nearly vanish.
TEST_P(Reference, ReproducesInEveryUnknown) {
  const NormalCase& expected = GetParam();
  const Outcome outcome = solved(expected.scene, 1e-11);
  ASSERT_TRUE(outcome.solved());
  const double lambda = std::hypot(expected.values.at("lambda_x"), expected.values.at("lambda_y"));
  for (const auto& [name, value] : expected.values) {
    const Quantity& found = outcome[name];
    const double size = name == "lambda_x" || name == "lambda_y" ? lambda : std::abs(value);
    EXPECT_NEAR(found.value, value, 1e-10 * size) << name;
    EXPECT_NEAR(found.value, value, found.error_bound + 4e-16 * size) << name << ": the claimed bound does not hold";
    EXPECT_LE(found.error_bound, 1e-11 * std::max(1.0, std::abs(value))) << name;
  }
  EXPECT_TRUE(outcome.other_extremals.empty());
}

std::string case_name(const testing::TestParamInfo<NormalCase>& info) {
  std::string name = info.param.name;
  for (char& c : name) {
    if (std::isalnum(static_cast<unsigned char>(c)) == 0) c = '_';
  }
  return name + "_" + std::to_string(info.index);
}
INSTANTIATE_TEST_SUITE_P(Normal, Reference, testing::ValuesIn(normal_cases()), case_name);

TEST(NormalFriction, WithoutFrictionIsTheCycloid) {
  const Outcome outcome = solved({6.0, -1.0, 2.0, 0.0, 0.0, 9.8}, 1e-10);
  ASSERT_TRUE(outcome.closed_form);
  EXPECT_EQ(outcome.closed_form->name, "cycloid");
  EXPECT_NEAR(outcome["final_time"].value, 1.3195056806149265, 1e-14);
  EXPECT_EQ(outcome.cost.steps, 0) << "nothing is integrated";
}

// T is smooth in β: what β = 1e-12 changes is 1e-6 of what β = 1e-6 does, up to the square of the latter.
TEST(NormalFriction, SmallFrictionConvergesToTheCycloid) {
  const double none = solved({6.0, -1.0, 2.0, 0.0, 0.0, 9.8}, 1e-12)["final_time"].value;
  for (const double sign : {1.0, -1.0}) {
    const Quantity coarse = solved({6.0, -1.0, 2.0, 0.0, sign * 1e-6, 9.8}, 1e-11)["final_time"];
    const Quantity fine = solved({6.0, -1.0, 2.0, 0.0, sign * 1e-12, 9.8}, 1e-11)["final_time"];
    EXPECT_GT(std::abs(coarse.value - none), 1e-6);
    EXPECT_NEAR(fine.value - none, 1e-6 * (coarse.value - none), 1e-13 + fine.error_bound);
  }
}

// Friction linear in N is followed by the same equations as any other: β far below what double precision sees.
TEST(NormalFriction, ClosedFormOfLinearFrictionIsWhatTheShootingFinds) {
  for (const Scene& scene :
       {Scene{3.0, -2.0, 2.0, 0.3, 0.0, 9.8}, Scene{3.0, -9.0, 35.0, 15.0, 0.0, 9.8}, Scene{1.0, 1.2, 10.0, 2.0, 0.0, 9.8},
        Scene{0.1, -20.0, 1.0, 5.0, 0.0, 9.8}, Scene{10.0, -0.1, 0.1, 0.009, 0.0, 9.8}}) {
    Scene nearly = scene;
    nearly.beta = 1e-30;
    const Outcome closed = solved(scene, 1e-11), shot = solved(nearly, 1e-11);
    ASSERT_TRUE(closed.closed_form && !shot.closed_form);
    for (const Quantity& expected : closed.quantities()) {
      EXPECT_NEAR(shot[expected.name].value, expected.value, shot[expected.name].error_bound + expected.error_bound)
          << expected.name;
    }
  }
}

// The end lies along the field of gravity and friction: the motion is straight, and a neighbour of cycloids.
TEST(NormalFriction, StraightAlongTheTiltedField) {
  const Outcome straight = solved({1.0, 1.0, 10.0, 1.0, 0.0, 9.8}, 1e-10);
  ASSERT_TRUE(straight.closed_form);
  EXPECT_EQ(straight.closed_form->name, "straight");
  const double end_speed = std::sqrt(100.0 - 4.0 * 9.8);
  EXPECT_NEAR(straight["final_time"].value, 2.0 * std::numbers::sqrt2 / (10.0 + end_speed), 1e-15);
  for (const double off : {1e-4, -1e-4}) {
    const Outcome cycloid = solved({1.0, 1.0 + off, 10.0, 1.0, 0.0, 9.8}, 1e-10);
    EXPECT_EQ(cycloid.closed_form->name, "cycloid");
    EXPECT_NEAR(cycloid["final_time"].value - straight["final_time"].value, straight["lambda_y"].value * off,
                1.0 * off * off);
    EXPECT_NEAR(cycloid["lambda_v0"].value, straight["lambda_v0"].value, std::abs(off));
  }
}

/// Slope of the time in one number of the scene by differences of fourth order, and how far it may be off: the claimed
/// errors of the times over h, and h⁴ times a fifth derivative, which is of order one in these scenes.
Quantity time_slope(const Scene& scene, double Scene::*place, double h) {
  double sum = 0.0, error = 0.0;
  for (const auto& [step, weight] : {std::pair{-2, 1.0}, {-1, -8.0}, {1, 8.0}, {2, -1.0}}) {
    Scene moved = scene;
    moved.*place += step * h;
    const Outcome outcome = solved(moved, 1e-10);
    sum += weight * outcome["final_time"].value;
    error += std::abs(weight) * outcome["final_time"].error_bound;
  }
  return {"slope", "", sum / (12.0 * h), error / (12.0 * h) + 100.0 * h * h * h * h};
}

void expect_slope(const Quantity& slope, double expected) {
  EXPECT_NEAR(slope.value, expected, slope.error_bound);
  EXPECT_LT(slope.error_bound, 1e-6 * (1.0 + std::abs(expected))) << "the comparison says something";
}

const Scene smooth{3.0, -2.0, 2.0, 0.3, -0.001, 9.8};
const Scene cornered{13.6961, -4.90538, 13.9873, 0.98, -0.00165, 9.8};

// ∂T/∂(a, b) = (λx, λy) and ∂T/∂v₀ = −λv(0).
TEST(NormalFriction, CostatesAreTheSlopesOfTheTime) {
  for (const Scene& scene : {smooth, cornered}) {
    const Outcome outcome = solved(scene, 1e-11);
    expect_slope(time_slope(scene, &Scene::x, 1e-3), outcome["lambda_x"].value);
    expect_slope(time_slope(scene, &Scene::y, 1e-3), outcome["lambda_y"].value);
    expect_slope(time_slope(scene, &Scene::speed, 1e-3), -outcome["lambda_v0"].value);
  }
  EXPECT_EQ(solved(cornered, 1e-9).solution.arcs.size(), 2U) << "a corner is among the cases";
}

// dT/dμ = −∫ H_μ dt = ∫ λv g cos θ dt: by the sensitivities of the shooting, the quadrature and differences.
TEST(NormalFriction, SlopeInTheFrictionCoefficient) {
  for (const Scene& scene : {smooth, cornered}) {
    const Outcome outcome = solved(scene, 1e-11);
    const Solution& solution = outcome.solution;
    double quadrature = 0.0;
    for (const ArcTrace& arc : solution.arcs) {
      constexpr int cells = 2000;  // Simpson's rule
      for (int i = 0; i <= cells; ++i) {
        const double t = arc.begin + (arc.end - arc.begin) * i / cells;
        const std::vector<double> at = solution.problem->observe(arc.point(arc.own(t)), solution.parameters);
        const double weight = (i == 0 || i == cells ? 1.0 : i % 2 == 1 ? 4.0 : 2.0) / 3.0;
        quadrature += weight * (arc.end - arc.begin) / cells * at[6] * at[7];
      }
    }
    Shooting shooting(solution.problem);
    shooting.set_parameters(solution.parameters);
    shooting.set_flow_options({.tolerance = {1e-13, 1e-13}});
    std::vector<double> path(solution.parameters.size(), 0.0);
    path[normal_friction::mu_place] = 1.0;
    const Shot& shot = shooting.evaluate(solution.y, path);
    const Eigen::VectorXd moved = -shooting.jacobian(shot).fullPivLu().solve(shooting.path_derivative(shot));
    const auto report = std::find_if(shot.reports().begin(), shot.reports().end(),
                                     [](const Report& r) { return r.name == "final_time"; });
    double sensitivity = 0.0;
    for (const auto& entry : report->value.gradient())
      sensitivity += entry.derivative * (entry.column < moved.size() ? moved[entry.column] : 1.0);
    EXPECT_NEAR(sensitivity, quadrature, 1e-9);
    expect_slope(time_slope(scene, &Scene::mu, 3e-4), sensitivity);
  }
}

// Lengths by s, times by r: g by s/r², v₀ by s/r, β by (r²/s)²; the slopes stay, and T is r times as long.
TEST(NormalFriction, ScalesWithLengthAndTime) {
  for (const Scene& scene : {smooth, cornered}) {
    const Outcome reference = solved(scene, 1e-11);
    for (const auto& [s, r] : {std::pair{10.0, 0.5}, {1e-3, 2.0}, {1e3, 30.0}}) {
      const double unit = s / (r * r);
      const Outcome scaled = solved({s * scene.x, s * scene.y, s / r * scene.speed, scene.mu, scene.beta / (unit * unit),
                                     unit * scene.gravity},
                                    1e-10);
      EXPECT_NEAR(scaled["final_time"].value, r * reference["final_time"].value, 2e-10 * r * reference["final_time"].value);
      EXPECT_NEAR(scaled["theta1"].value, reference["theta1"].value, 2e-10);
      EXPECT_NEAR(scaled["theta2"].value, reference["theta2"].value, 2e-10);
      EXPECT_EQ(scaled.solution.arcs.size(), reference.solution.arcs.size());
    }
  }
}

TEST(NormalFriction, ReachEndsWhereTheEnergyDoes) {
  // Linear friction: exactly at y_max = v₀²/(2g) − μa.
  const double y_max = 16.0 / 19.6 - 0.3 * 1.5;
  EXPECT_EQ(solve_scene({1.5, y_max - 1e-9, 4.0, 0.3, 0.0, 9.8}, {}).status, Outcome::Status::solved);
  const Outcome beyond = solve_scene({1.5, y_max + 1e-9, 4.0, 0.3, -1e-4, 9.8}, {});
  EXPECT_EQ(beyond.status, Outcome::Status::infeasible);
  EXPECT_NE(beyond.message.find("y_max"), std::string::npos);
  ASSERT_EQ(beyond.limits.front().name, "y_max");
  EXPECT_NEAR(beyond.limits.front().value.value(), y_max, 1e-15);
  // Soft friction takes at least (μ − β g²) g a.
  EXPECT_EQ(solve_scene({1.5, y_max + 1e-9, 4.0, 0.3, 1e-3, 9.8}, {}).status, Outcome::Status::solved);
  EXPECT_EQ(solve_scene({1.5, y_max + 1.5 * 0.09604 + 1e-9, 4.0, 0.3, 1e-3, 9.8}, {}).status, Outcome::Status::infeasible);
}

TEST(NormalFriction, ThrustAlongAnOverhangIsShown) {
  for (const NormalCase& c : normal_cases()) {
    const Outcome outcome = solved(c.scene, 1e-8);
    ASSERT_EQ(outcome.limits.back().name, "N_min");
    const double least = outcome.limits.back().value.value();
    EXPECT_EQ(least < 0.0, c.values.at("theta1") < -std::numbers::pi / 2) << c.name;
    EXPECT_NEAR(least, c.scene.gravity * std::min(std::cos(c.values.at("theta1")), std::cos(c.values.at("theta2"))), 1e-6)
        << c.name;
  }
}

}  // namespace
}  // namespace costate::test
