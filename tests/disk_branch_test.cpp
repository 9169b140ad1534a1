/// Branches of the rolling disk in its friction coefficient: where arcs are born and die, and every reference on the way.
#include "disk_reference.hpp"

#include "disk/arc_changes.hpp"
#include "disk/disk_scene.hpp"

#include <costate/shooting/branch.hpp>

#include <gtest/gtest.h>

namespace costate::test {
namespace {

using disk::Scene;

/// The branch of a scene from one coefficient to another.
Branch follow_friction(Scene scene, double from, double to, std::vector<double> landings = {}) {
  scene.friction = from;
  const disk::Outcome start = disk::solve_scene(scene, {.accuracy = 1e-10});
  EXPECT_TRUE(start.solved()) << start.message;
  if (!start.solved()) return {};
  const auto other = disk::branch_start(scene, start);
  const tools::BranchStart at = other ? *other
                                      : tools::BranchStart{start.solution.problem, start.solution.parameters,
                                                           start.solution.y};
  return trace(at.problem, at.parameters, at.y, "friction", to, {.tolerance = 1e-12, .landings = std::move(landings)},
               [&](const Junction& junction) { return disk::arc_changes(scene, junction); });
}

Scene square(double a) {
  Scene scene;
  scene.x = scene.y = a;
  return scene;
}

struct Expected {
  EventKind kind;
  double friction;
  std::string after;
  double digits = 1e-15;  ///< what the reference is known to
};

/// Thresholds of the references to `tolerance`, which is that of the issue or the digits they are given with, and within the claimed bound.
void expect_events(const Branch& branch, const std::vector<Expected>& expected, double tolerance) {
  ASSERT_EQ(branch.events.size(), expected.size()) << branch.message;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const BranchEvent& event = branch.events[i];
    EXPECT_EQ(event.kind, expected[i].kind) << i;
    EXPECT_NEAR(event.point.parameter, expected[i].friction, tolerance) << event.name;
    EXPECT_EQ(event.after, expected[i].after);
    EXPECT_LT(event.error_bound, 1e-10) << event.name;
    EXPECT_NEAR(event.point.parameter, expected[i].friction, event.error_bound + expected[i].digits) << event.name;
  }
}

const std::string CFC = "saturated-free-saturated";

TEST(DiskBranch, ReferenceArcsAreBornAndMerge) {
  const Branch branch = follow_friction(square(1.0), 0.07, 0.05099);
  EXPECT_TRUE(branch.reached) << branch.message;
  expect_events(branch,
                {{EventKind::arc_birth, 0.06581888643051695, CFC},
                 {EventKind::arc_death, 0.05237396485496459, "saturated-saturated"}},
                1e-12);
  const long on_points = branch.cost.newton_iterations - branch.event_iterations;
  EXPECT_LE(on_points, 6 * static_cast<long>(branch.points.size()));
  EXPECT_LE(branch.cost.newton_iterations, 10 * static_cast<long>(branch.points.size()));
}

// The same changes, met from below: births are deaths and the other way round.
TEST(DiskBranch, IsTheSameUpward) {
  const Branch branch = follow_friction(square(1.0), 0.0515, 0.07);
  EXPECT_TRUE(branch.reached) << branch.message;
  expect_events(branch,
                {{EventKind::arc_birth, 0.05237396485496459, CFC}, {EventKind::arc_death, 0.06581888643051695, "free"}},
                1e-11);
}

TEST(DiskBranch, BoundaryArcsAreBornAtTheEnds) {
  const Branch branch = follow_friction(square(2.0), 0.075, 0.042);
  EXPECT_TRUE(branch.reached) << branch.message;
  expect_events(branch,
                {{EventKind::arc_birth, 0.071775417441888832557, CFC},
                 {EventKind::arc_birth, 0.048860436374286505, "boundary-saturated-free-saturated-boundary", 1e-13}},
                1e-11);
}

TEST(DiskBranch, ABoundaryArcIsBornAtTheSwitch) {
  const Branch branch = follow_friction(square(0.5), 0.048, 0.0422);
  EXPECT_TRUE(branch.reached) << branch.message;
  expect_events(branch,
                {{EventKind::arc_birth, 0.0469130, CFC, 5e-8},
                 {EventKind::arc_death, 0.0438673154872, "saturated-saturated", 5e-14},
                 {EventKind::arc_birth, 0.0427954594874, "saturated-boundary-saturated", 1e-13}},
                1e-7);
  EXPECT_NEAR(branch.events.at(1).point.parameter, 0.04386731548722007, 1e-10);
  EXPECT_NEAR(branch.events.at(2).point.parameter, 0.042795459487443364, 1e-10);
}

// Below k_min = c₁² a/(g (a² + L²)) no motion with a monotone heading exists.
TEST(DiskBranch, EndsAtTheLeastFriction) {
  for (const double a : {1.0, 0.5}) {
    const double least = a / (9.80665 * (a * a + 1.0));
    const Branch branch = follow_friction(square(a), 0.052, 0.9 * least);
    EXPECT_FALSE(branch.reached);
    ASSERT_FALSE(branch.events.empty()) << branch.message;
    EXPECT_EQ(branch.events.back().kind, EventKind::limit) << branch.message;
    EXPECT_NEAR(branch.events.back().point.parameter, least, 1e-10);
    EXPECT_LE(std::abs(branch.events.back().point.parameter - least), branch.events.back().error_bound) << a;
    for (const BranchPoint& point : branch.points) EXPECT_GE(point.parameter, least * (1.0 - 1e-10));
  }
}

TEST(DiskBranch, LandsOnEveryReferenceOfTheFigure) {
  std::vector<double> landings;
  std::vector<DiskCase> cases;
  for (const DiskCase& c : disk_cases()) {
    if (!c.name.starts_with("a1_k0") || *c.scene.friction < 0.05099) continue;
    landings.push_back(*c.scene.friction);
    cases.push_back(c);
  }
  ASSERT_GE(cases.size(), 10u);
  const Branch branch = follow_friction(square(1.0), 0.07, 0.05099, landings);
  ASSERT_TRUE(branch.reached) << branch.message;
  for (const DiskCase& c : cases) {
    const auto found = std::find_if(branch.points.begin(), branch.points.end(),
                                    [&](const BranchPoint& p) { return p.parameter == *c.scene.friction; });
    ASSERT_NE(found, branch.points.end()) << c.name;
    EXPECT_TRUE(found->requested);
    EXPECT_EQ(disk::letters(disk::chain_of(*branch.stretches[found->stretch].problem,
                                           [&] {
                                             Shooting shooting(branch.stretches[found->stretch].problem);
                                             std::vector<double> parameters = branch.stretches[found->stretch].parameters;
                                             parameters[branch.stretches[found->stretch].place] = found->parameter;
                                             shooting.set_parameters(parameters);
                                             return shooting.evaluate(found->y);
                                           }())
                                .structure()),
              c.structure)
        << c.name;
    for (const BranchReport& report : found->reports) {
      const auto value = c.values.find(report.name);
      if (value == c.values.end()) continue;
      EXPECT_NEAR(report.value, value->second, 1e-9) << c.name << ' ' << report.name;
    }
  }
}

// t_f(k): the derivative from the sensitivities against differences of solved scenes.
TEST(DiskBranch, DerivativesOfTheFinalTime) {
  const Branch branch = follow_friction(square(1.0), 0.06, 0.052, {0.055});
  ASSERT_TRUE(branch.reached) << branch.message;
  const auto point = std::find_if(branch.points.begin(), branch.points.end(),
                                  [](const BranchPoint& p) { return p.parameter == 0.055; });
  ASSERT_NE(point, branch.points.end());
  const auto time_at = [](double friction, const char* name) {
    Scene scene;
    scene.friction = friction;
    return disk::solve_scene(scene, {.accuracy = 1e-12}).solution[name].value;
  };
  for (const char* name : {"final_time", "t1", "V0", "lambda_x"}) {
    const auto report = std::find_if(point->reports.begin(), point->reports.end(),
                                     [&](const BranchReport& r) { return r.name == name; });
    ASSERT_NE(report, point->reports.end());
    // Differences of fourth order: h⁴ times a fifth derivative of at most (1/δ)⁵ with δ = 0.0026, the distance to the merge, and
    // rounding of 1e-12/h.
    constexpr double h = 2e-5;
    const double near = (time_at(0.055 + h, name) - time_at(0.055 - h, name)) / (2.0 * h);
    const double far = (time_at(0.055 + 2.0 * h, name) - time_at(0.055 - 2.0 * h, name)) / (4.0 * h);
    EXPECT_NEAR(report->derivative, (4.0 * near - far) / 3.0, 1e-6 * std::max(1.0, std::abs(report->derivative))) << name;
  }
}

}  // namespace
}  // namespace costate::test
