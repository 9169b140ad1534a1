/// Curvature-coupled friction along a branch: guards, and arcs that come and go at the start of the motion.
#include "curvature/arc_changes.hpp"
#include "curvature/curvature_scene.hpp"
#include "event_check.hpp"
#include "guard_check.hpp"

#include <costate/error.hpp>

#include <fstream>
#include <nlohmann/json.hpp>

namespace costate::test {
namespace {

using curvature::ArcKind;
using curvature::Plan;
using curvature::Scene;
using tools::Outcome;

Outcome solved(const Scene& scene) {
  Outcome outcome = curvature::solve_scene(scene, {.accuracy = 1e-9});
  EXPECT_TRUE(outcome.solved()) << outcome.message;
  return outcome;
}

TEST(CurvatureGuards, ArePositiveAtTheReferences) {
  std::ifstream file(std::string(COSTATE_REFERENCE_DIR) + "/nonlinear_friction.json");
  const auto data = nlohmann::json::parse(file);
  int count = 0;
  for (const auto& entry : data.at("cases")) {
    if (entry.at("model") != "B") continue;
    const auto& p = entry.at("params");
    Scene scene{p.at("a"), p.at("b"), p.at("v0"), std::nullopt, p.at("mu"), p.at("beta"), p.at("g")};
    if (!p.at("theta0").is_null()) scene.slope = p.at("theta0").get<double>();
    const Outcome outcome = solved(scene);
    Shooting shooting(outcome.solution.problem);
    for (const Guard& guard : shooting.evaluate(outcome.solution.y).guards()) {
      EXPECT_GT(guard.value.value, 1e-3) << entry.at("id") << ' ' << guard.name;
    }
    ++count;
  }
  EXPECT_EQ(count, 8);
}

/// A plan with arcs of the given kinds from the last to the first, and lengths that keep every state regular.
Plan plan_with(std::vector<ArcKind> kinds) {
  Plan plan{.arcs = {}, .theta_start = -0.9, .theta_end = 0.3, .eta_end = 1.1, .slope_end = 0.1, .log_speed_ratio = 1.2};
  for (const ArcKind kind : kinds) plan.arcs.push_back({kind, kind == ArcKind::contact ? 0.2 : 0.15, {}});
  return plan;
}

TEST(CurvatureGuards, HaveTheGradientsThatDifferencesSay) {
  constexpr ArcKind contact = ArcKind::contact, ballistic = ArcKind::ballistic;
  Scene given{4.0, -2.5, 2.0, -0.7, 0.2, -4e-3, 9.8}, free = given;
  free.slope.reset();
  for (const Scene& scene : {given, free}) {
    for (const std::vector<ArcKind>& kinds :
         {std::vector{contact}, {ballistic}, {ballistic, contact}, {contact, ballistic}, {contact, ballistic, contact}}) {
      const Plan plan = plan_with(kinds);
      Shooting shooting(curvature::make_problem(scene, plan));
      expect_gradients_of_guards(shooting, curvature::unknowns(scene, plan), 1000.0);
    }
  }
}

// In SI units and from what is reported: (μ λv v − λθ)/t₁ at the start of the flight.
TEST(CurvatureGuards, SwitchingAtTheStartIsWhatTheCostatesSay) {
  const Scene scene{4.0, -2.5, 2.0, -0.4, 0.2, -1e-3, 9.8};
  const Outcome outcome = solved(scene);
  Shooting shooting(outcome.solution.problem);
  const double guard = guard_value(shooting.evaluate(outcome.solution.y), curvature::start_switching);
  const double expected = (scene.mu * outcome["lambda_v0"].value * scene.speed - outcome["lambda_theta0"].value) /
                          outcome["t1"].value;
  EXPECT_NEAR(guard, expected, 1e-7) << "the digits of both, over t1";
  EXPECT_GT(guard, 0.0);
}

TEST(CurvaturePlan, IsTheInverseOfItsUnknowns) {
  Plan plan = plan_with({ArcKind::ballistic, ArcKind::contact});
  plan.arcs[1].nodes = {{0.2, -0.1, 0.8, 0.4}, {0.7, -0.5, 0.6, 0.9}};
  for (const std::optional<double> slope : {std::optional(-0.7), std::optional<double>()}) {
    const Scene scene{.slope = slope};
    const Eigen::VectorXd y = curvature::unknowns(scene, plan);
    const auto problem = curvature::make_problem(scene, plan);
    const Eigen::VectorXd other = y + Eigen::VectorXd::LinSpaced(y.size(), 0.1, 0.9);
    EXPECT_EQ(curvature::unknowns(scene, curvature::plan_of(*problem, other)), other);
    EXPECT_THROW((void)curvature::plan_of(*problem, y.head(2)), BadInput);
  }
}

/// A scene whose first arc comes or goes as one of its numbers moves.
struct Crossing {
  const char* parameter;
  double Scene::*number;
  double contact, flight;  ///< values of it on both sides
  Scene scene{};
};
void PrintTo(const Crossing& c, std::ostream* out) { *out << c.parameter; }

class FirstFlight : public testing::TestWithParam<Crossing> {
 protected:
  static Scene at(double value) {
    Scene scene = GetParam().scene;
    if (GetParam().number != nullptr)
      scene.*GetParam().number = value;
    else
      scene.slope = value;
    return scene;
  }

  /// Follows the scene, and returns the one event there must be.
  static BranchEvent only_event(double from, double to) {
    const Outcome start = solved(at(from));
    const Scene scene = at(from);
    const Branch branch = trace(start.solution.problem, start.solution.parameters, start.solution.y, GetParam().parameter,
                                to, {}, [&](const Junction& junction) { return curvature::arc_changes(scene, junction); });
    EXPECT_TRUE(branch.reached) << branch.message;
    EXPECT_EQ(branch.events.size(), 1u);
    const Outcome end = solved(at(to));
    EXPECT_NEAR(report(branch.points.back(), "final_time"), end["final_time"].value, 1e-8)
        << "the end of the branch is what the scene alone gives";
    return branch.events.empty() ? BranchEvent{} : branch.events.front();
  }
};

TEST_P(FirstFlight, IsBornAndDiesInOnePlace) {
  const auto [name, number, contact, flight, scene] = GetParam();
  const BranchEvent birth = only_event(contact, flight), death = only_event(flight, contact);
  EXPECT_EQ(birth.kind, EventKind::arc_birth);
  EXPECT_EQ(birth.name, curvature::start_force);
  EXPECT_EQ(birth.before, "contact");
  EXPECT_EQ(birth.after, "ballistic-contact");
  EXPECT_EQ(death.kind, EventKind::arc_death);
  EXPECT_EQ(death.name, curvature::length_of_arc(0));
  EXPECT_EQ(death.after, "contact");
  EXPECT_NEAR(birth.point.parameter, death.point.parameter, birth.error_bound + death.error_bound + 1e-9 * std::abs(flight));

  // Scenes solved cold on both sides know the place too: h₀ and t₁ vanish there, and the number is a smooth function of either.
  const double place = birth.point.parameter;
  for (const auto& [side, quantity] : {std::pair{contact, "h0"}, {flight, "t1"}}) {
    expect_zero_at(place, side, [&](double value) { return solved(at(value))[quantity].value; });
  }
}

INSTANTIATE_TEST_SUITE_P(Curvature, FirstFlight,
                         testing::Values(Crossing{"slope", nullptr, -0.9, -0.6},
                                         Crossing{"beta", &Scene::beta, -2e-3, -1e-3, {.slope = -0.7}},
                                         Crossing{"mu", &Scene::mu, 0.5, 0.3, {.slope = -0.7}},
                                         Crossing{"x", &Scene::x, 4.0, 1.5}),
                         [](const auto& info) { return info.param.parameter; });

// A bead fast enough flies to the end point, the slope being free; a slower one is pressed on the wire at the end.
TEST(LastContact, IsBornWhereAFlightEnds) {
  const auto at = [](double speed) { return Scene{1.1, -2.0, speed, std::nullopt, 0.67, -2.4e-3, 9.8}; };
  const double fast = 4.0, slow = 2.0;
  const Outcome start = solved(at(fast)), end = solved(at(slow));
  const Branch branch = trace(start.solution.problem, start.solution.parameters, start.solution.y, "speed", slow, {},
                              [&](const Junction& junction) { return curvature::arc_changes(at(fast), junction); });
  ASSERT_TRUE(branch.reached) << branch.message;
  ASSERT_EQ(branch.events.size(), 1u);
  const BranchEvent& birth = branch.events.front();
  EXPECT_EQ(birth.name, curvature::end_switching);
  EXPECT_EQ(birth.before, "ballistic");
  EXPECT_EQ(birth.after, "ballistic-contact");
  EXPECT_NEAR(report(branch.points.back(), "final_time"), end["final_time"].value, 1e-8);

  const double place = birth.point.parameter;
  const auto still_to_go = [&](const Outcome& outcome) {
    const double theta = outcome["theta2"].value, x = outcome["lambda_x"].value, y = outcome["lambda_y"].value;
    return at(fast).mu - (y * std::cos(theta) - x * std::sin(theta)) / (x * std::cos(theta) + y * std::sin(theta));
  };
  // The arc is analytic in ω, and its duration as the square of its length there.
  const auto length = [](const Outcome& outcome) { return std::sqrt(outcome["final_time"].value - outcome["t1"].value); };
  expect_zero_at(place, fast, [&](double speed) { return still_to_go(solved(at(speed))); });
  expect_zero_at(place, slow, [&](double speed) { return length(solved(at(speed))); });
}

TEST(CurvatureArcChanges, WithAFreeSlopeThereAreNoneAtTheStart) {
  const Scene scene{.slope = std::nullopt};
  const Outcome outcome = solved(scene);
  Shooting shooting(outcome.solution.problem);
  const Shot& shot = shooting.evaluate(outcome.solution.y);
  const std::vector<std::size_t> zeros{0};
  EXPECT_TRUE(
      curvature::arc_changes(scene, {shooting.problem(), shooting.parameters(), outcome.solution.y, shot, zeros}).empty());
}

}  // namespace
}  // namespace costate::test
