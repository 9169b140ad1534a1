/// The rolling disk from its scene alone: against 20-digit references, the elliptic closed form and its own scaling.
#include "disk/disk_scene.hpp"
#include "disk_elliptic.hpp"
#include "disk_check.hpp"
#include "disk_reference.hpp"

#include <costate/error.hpp>

#include <algorithm>
#include <gtest/gtest.h>

namespace costate::test {
namespace {

using disk::Outcome;
using disk::Scene;

class Reference : public testing::TestWithParam<DiskCase> {};

// Every case, to what the references promise and to what the solution itself claims.
TEST_P(Reference, ReproducesInEveryUnknown) {
  const DiskCase& expected = GetParam();
  const Outcome outcome = disk::solve_scene(expected.scene, {.accuracy = 1e-10});
  ASSERT_EQ(outcome.status, Outcome::Status::solved) << outcome.message;
  EXPECT_EQ(letters(*outcome.solution.problem), expected.structure);
  for (const auto& [name, value] : expected.values) {
    const Quantity& found = outcome.solution[name];
    EXPECT_NEAR(found.value, value, 1e-9 * std::max(1.0, std::abs(value))) << name;
    EXPECT_NEAR(found.value, value, found.error_bound) << name << ": the claimed bound does not hold";
    EXPECT_LE(found.error_bound, 1e-10 * std::max(1.0, std::abs(value))) << name;
  }
}

std::vector<DiskCase> solvable_cases() {
  std::vector<DiskCase> cases;
  for (DiskCase& c : disk_cases()) {
    // At the merge of the two saturated arcs the structure is a matter of the last bit of k_f.
    if (c.name != "a1_k_merge") cases.push_back(std::move(c));
  }
  return cases;
}

std::string case_name(const testing::TestParamInfo<DiskCase>& info) {
  std::string name = info.param.name;
  for (char& c : name) {
    if (std::isalnum(static_cast<unsigned char>(c)) == 0) c = '_';
  }
  return name + "_" + std::to_string(info.index);
}

INSTANTIATE_TEST_SUITE_P(Disk, Reference, testing::ValuesIn(solvable_cases()), case_name);

TEST(DiskScene, MergeOfTheSaturatedArcs) {
  for (const DiskCase& c : disk_cases()) {
    if (c.name != "a1_k_merge") continue;
    const Outcome outcome = disk::solve_scene(c.scene, {.accuracy = 1e-10});
    ASSERT_EQ(outcome.status, Outcome::Status::solved) << outcome.message;
    EXPECT_NEAR(outcome.solution["final_time"].value, c.values.at("final_time"), 1e-10);
    EXPECT_NEAR(outcome.solution["V0"].value, c.values.at("V0"), 1e-9);
  }
}

TEST(DiskScene, FrictionNeededByTheUnlimitedSolution) {
  const Outcome outcome = disk::solve_scene({}, {.accuracy = 1e-10});
  EXPECT_NEAR(outcome.F_max.value(), 0.06581888643051695, 1e-10);
  EXPECT_NEAR(outcome.F_min.value(), 0.05012209587242639, 1e-10);
}

// The smallest of the references' friction ranges that is not symmetric: F_min at an end, F_max at the other.
TEST(DiskScene, FrictionRangeOfAnUnsymmetricScene) {
  Scene scene;
  scene.x = 1.5;
  const Outcome outcome = disk::solve_scene(scene, {.accuracy = 1e-10});
  EXPECT_NEAR(outcome.F_max.value(), 0.08694948238482670, 1e-10);
}

TEST(DiskScene, FreeArcsAgreeWithEllipticFunctions) {
  for (const double m : {0.05, 0.4, 0.8, 0.98}) {
    for (const double alpha : {-0.7, 0.1, 0.8, 1.5, 2.4}) {
      for (const double heading : {0.7, 1.6, 2.5}) {
        const EllipticArc exact(m, alpha, heading);
        Scene scene;
        scene.x = exact.x;
        scene.y = exact.y;
        scene.heading = heading;
        const Outcome outcome = disk::solve_scene(scene, {.accuracy = 1e-10});
        ASSERT_EQ(outcome.status, Outcome::Status::solved)
            << outcome.message << " at m = " << m << ", alpha = " << alpha << ", heading = " << heading;
        // The end point is known to rounding only, and the unknowns depend on it with the condition of the system.
        const double tolerance = 1e-10 + 1e-15 * outcome.solution.certificate.condition;
        EXPECT_NEAR(outcome.solution["final_time"].value, exact.time, tolerance) << m << ' ' << alpha << ' ' << heading;
        EXPECT_NEAR(outcome.solution["lambda_x"].value, exact.lambda_x, tolerance) << m << ' ' << alpha << ' ' << heading;
        EXPECT_NEAR(outcome.solution["lambda_y"].value, exact.lambda_y, tolerance) << m << ' ' << alpha << ' ' << heading;
      }
    }
  }
}

// Lengths scale with r, times with r/c₁, friction coefficients with c₁²/(g r); costates with 1/c₁.
TEST(DiskScene, InvariantUnderTheScalingOfThePaper) {
  for (const std::optional<double> friction : {std::optional<double>(), std::optional<double>(0.0525)}) {
    Scene scene;
    scene.friction = friction;
    const Outcome plain = disk::solve_scene(scene, {.accuracy = 1e-11});
    ASSERT_EQ(plain.status, Outcome::Status::solved) << plain.message;
    for (const double lengths : {1e-3, 0.37, 250.0}) {
      for (const double speeds : {1e-2, 3.7, 1e3}) {
        Scene scaled = scene;
        scaled.x *= lengths;
        scaled.y *= lengths;
        scaled.radius *= lengths;
        scaled.speed *= speeds;
        if (friction) scaled.friction = *friction * speeds * speeds / lengths;
        const Outcome outcome = disk::solve_scene(scaled, {.accuracy = 1e-11});
        ASSERT_EQ(outcome.status, Outcome::Status::solved) << outcome.message;
        const double times = lengths / speeds;
        EXPECT_NEAR(outcome.solution["final_time"].value / times, plain.solution["final_time"].value, 1e-10);
        EXPECT_NEAR(outcome.solution["lambda_x"].value * speeds, plain.solution["lambda_x"].value, 1e-10);
        EXPECT_NEAR(outcome.solution["V0"].value / speeds, plain.solution["V0"].value, 1e-10);
        if (!friction) continue;
        EXPECT_NEAR(outcome.solution["t1"].value / times, plain.solution["t1"].value, 1e-10);
      }
    }
  }
}

TEST(DiskScene, TurningRightMirrorsTurningLeft) {
  Scene left;
  left.x = 1.5;
  left.friction = 0.078;
  Scene right = left;
  right.y = -left.y;
  right.heading = -left.heading;
  const Outcome a = disk::solve_scene(left, {.accuracy = 1e-10});
  const Outcome b = disk::solve_scene(right, {.accuracy = 1e-10});
  ASSERT_EQ(a.status, Outcome::Status::solved) << a.message;
  ASSERT_EQ(b.status, Outcome::Status::solved) << b.message;
  for (const char* same : {"final_time", "t1", "lambda_x", "V0"}) {
    EXPECT_NEAR(a.solution[same].value, b.solution[same].value, 1e-12) << same;
  }
  for (const char* negated : {"lambda_y", "lambda_phi0", "Omega0"}) {
    EXPECT_NEAR(a.solution[negated].value, -b.solution[negated].value, 1e-12) << negated;
  }
  EXPECT_NEAR(b.solution.at(b.solution.final_time())[1], right.y, 1e-10);
}

// A limit that never binds changes nothing: the free arc alone is solved.
TEST(DiskScene, FrictionThatNeverBindsLeavesOneArc) {
  Scene scene;
  scene.friction = 0.0659;
  const Outcome outcome = disk::solve_scene(scene, {});
  ASSERT_EQ(outcome.status, Outcome::Status::solved) << outcome.message;
  EXPECT_EQ(letters(*outcome.solution.problem), "F");
}

// Near F_max the arcs are 1.5 δ/|F'| long to first order; the row S/d² must not drown in rounding.
TEST(DiskScene, ShortestArcsFollowTheirExpansion) {
  const double F_max = 0.06581888643051695;
  // |F'| at the end of the free arc: |λ| A A_φ /g with A = |A_φ| = λx there.
  const double lambda = 0.543894664698973368;
  const double slope = std::numbers::sqrt2 * lambda * lambda * lambda / 9.80665;
  for (const double excess : {1e-5, 1e-7, 1e-9}) {
    Scene scene;
    scene.friction = F_max * (1.0 - excess);
    const Outcome outcome = disk::solve_scene(scene, {.accuracy = 1e-9});
    ASSERT_EQ(outcome.status, Outcome::Status::solved) << outcome.message;
    const double first_order = 1.5 * F_max * excess / slope;
    // The next term of the expansion is relative to the duration; 1e-9 s is what the accuracy admits.
    EXPECT_NEAR(outcome.solution["t1"].value, first_order, 2.0 * first_order * first_order + 1e-9) << excess;
  }
}

TEST(DiskScene, TooLittleFrictionIsInfeasibleAndNamesTheLimit) {
  Scene scene;
  scene.friction = 0.03;
  const Outcome outcome = disk::solve_scene(scene, {});
  EXPECT_EQ(outcome.status, Outcome::Status::infeasible);
  EXPECT_NE(outcome.message.find("k_min = 0.05098581"), std::string::npos) << outcome.message;
  EXPECT_NEAR(outcome.k_min.value(), 0.050985810648896412, 1e-15);
}

// The problem computes in units of r/(√6 c₁): what it gives out is in seconds all the same.
TEST(DiskScene, TrajectoryIsInSeconds) {
  Scene scene;
  scene.radius = 0.5;
  scene.speed = 2.0;
  scene.x = 0.3;
  scene.y = 0.2;
  scene.friction = 1.2;
  const Outcome outcome = disk::solve_scene(scene, {.accuracy = 1e-10});
  ASSERT_EQ(outcome.status, Outcome::Status::solved) << outcome.message;
  const Solution& solution = outcome.solution;
  EXPECT_NEAR(solution.final_time(), 0.259285522818559431, 1e-12);
  EXPECT_NEAR(solution.final_time(), solution["final_time"].value, 1e-13);
  const double junction = solution["t1"].value;
  EXPECT_NEAR(solution.arcs.at(1).begin, junction, 1e-13);
  const auto end = solution.at(solution.final_time());
  EXPECT_NEAR(end[0], 0.3, 1e-10);
  EXPECT_NEAR(end[1], 0.2, 1e-10);
  EXPECT_NEAR(end[2], scene.heading, 1e-10);
  // x' = V cos φ by a central difference whose error is h²x'''/6 + ε/h.
  const double t = 0.5 * junction, h = 1e-5;
  const auto middle = solution.at(t);
  EXPECT_NEAR((solution.at(t + h)[0] - solution.at(t - h)[0]) / (2.0 * h), middle[3] * std::cos(middle[2]), 1e-7);
  for (const CheckResult& check : solution.certificate.checks) EXPECT_LE(check.time, solution.final_time());
}

// x → −x, y → −y is V → −V, λ → −λ: the same motion seen backward along the heading.
TEST(DiskScene, BackwardSceneHasTheSameTime) {
  for (const double friction : {0.06, 0.0515}) {
    Scene forward;
    forward.friction = friction;
    Scene backward = forward;
    backward.x = backward.y = -1.0;
    const Outcome a = disk::solve_scene(forward, {}), b = disk::solve_scene(backward, {});
    ASSERT_EQ(a.status, Outcome::Status::solved) << a.message;
    ASSERT_EQ(b.status, Outcome::Status::solved) << b.message;
    EXPECT_NEAR(a.solution["final_time"].value, b.solution["final_time"].value, 1e-9);
    EXPECT_NEAR(a.solution["V0"].value, -b.solution["V0"].value, 1e-9);
  }
}

// Run backward and mirrored, a motion solves the scene (x cos φ_f + y sin φ_f, x sin φ_f − y cos φ_f, φ_f) in the same time.
TEST(DiskScene, TimeReversalKeepsTheTime) {
  struct Given {
    double x, y, heading, friction;
  };
  for (const Given& g : {Given{1.7523, 2.1246, 2.2731, 0.08552}, Given{2.2838, 2.9259, 2.3259, 0.07335},
                         Given{0.41416, 2.45421, 2.55159, 0.06657}, Given{1.5, 1.0, 1.5707963267948966, 0.078}}) {
    Scene scene, reversed;
    scene.x = g.x;
    scene.y = g.y;
    scene.heading = reversed.heading = g.heading;
    scene.friction = reversed.friction = g.friction;
    reversed.x = g.x * std::cos(g.heading) + g.y * std::sin(g.heading);
    reversed.y = g.x * std::sin(g.heading) - g.y * std::cos(g.heading);
    const Outcome a = disk::solve_scene(scene, {}), b = disk::solve_scene(reversed, {});
    ASSERT_EQ(a.status, Outcome::Status::solved) << a.message;
    ASSERT_EQ(b.status, Outcome::Status::solved) << b.message;
    EXPECT_NEAR(a.solution["final_time"].value, b.solution["final_time"].value, 1e-8);
    std::string backward = letters(*b.solution.problem);
    std::reverse(backward.begin(), backward.end());
    EXPECT_EQ(letters(*a.solution.problem), backward);
  }
}

// Small headings have several extremals; times of the fastest from a multistart (300 starts a scene) that shares no code.
TEST(DiskScene, FastestExtremalOfSmallHeadings) {
  struct Found {
    double x, y, heading, time;
  };
  for (const Found& known : {Found{-2.7232, 2.3772, 0.1546, 4.5878}, Found{2.2048, -3.1355, 0.7459, 5.8049},
                             Found{-1.8811, 3.8477, 0.7145, 6.481}, Found{0.9926, -2.5541, 0.1951, 4.792}}) {
    Scene scene;
    scene.x = known.x;
    scene.y = known.y;
    scene.heading = known.heading;
    const Outcome outcome = disk::solve_scene(scene, {});
    ASSERT_EQ(outcome.status, Outcome::Status::solved) << outcome.message;
    EXPECT_LT(outcome.solution["final_time"].value, known.time + 5e-4) << known.x;
  }
}

// The circle at constant speed needs the least friction only while the heading turns by π at most.
TEST(DiskScene, NoLimitIsClaimedBeyondHalfATurn) {
  Scene scene;
  scene.x = -0.6712469922641969;
  scene.y = 0.5014364701757417;
  scene.heading = 5.0;
  scene.friction = 0.045;  // more than the unlimited solution uses
  const Outcome outcome = disk::solve_scene(scene, {});
  EXPECT_EQ(outcome.status, Outcome::Status::solved) << outcome.message;
  EXPECT_FALSE(outcome.k_min.has_value());
  scene.friction = 0.0383;
  const Outcome limited = disk::solve_scene(scene, {});
  ASSERT_EQ(limited.status, Outcome::Status::solved) << limited.message;
  EXPECT_EQ(disk_objection(scene, limited.solution, 1e-6), "");
}

// A switching function of second order in the duration is no smaller for a coarse accuracy.
TEST(DiskScene, CoarseAccuracyAdmitsNoWrongStructure) {
  Scene scene;
  scene.x = 2.1831;
  scene.y = -3.0665;
  scene.heading = -1.90423;
  scene.friction = 0.0493;
  EXPECT_NE(disk::solve_scene(scene, {.accuracy = 1e-3}).status, Outcome::Status::solved);
}

TEST(DiskScene, TrajectoryStaysOnTheEnergySurface) {
  Scene scene;
  scene.friction = 0.0525;
  const Outcome outcome = disk::solve_scene(scene, {.accuracy = 1e-10});
  ASSERT_EQ(outcome.status, Outcome::Status::solved);
  const double L = scene.radius / std::sqrt(6.0);
  for (int i = 0; i <= 100; ++i) {
    const auto row = outcome.solution.at(outcome.solution.final_time() * i / 100);
    const double V = row[3], Omega = row[4], friction = row[10], multiplier = row[11];
    EXPECT_NEAR(V * V + L * L * Omega * Omega, 1.0, 1e-12);
    EXPECT_LE(friction, 0.0525 + 1e-12);
    EXPECT_LE(multiplier, 1e-9);  // [O] (4.9), corrected sign
  }
}

}  // namespace
}  // namespace costate::test
