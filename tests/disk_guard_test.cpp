/// What holds a structure of the rolling disk together: guards at known solutions, and roots that are no solutions.
#include "disk_reference.hpp"

#include <costate/error.hpp>
#include <costate/shooting/solve.hpp>

#include <Eigen/LU>
#include <gtest/gtest.h>

namespace costate::test {
namespace {

using disk::ArcKind;
using disk::ArcType;
using disk::GuardKind;
using disk::Scene;
using disk::Structure;

Scene with_limit(double kappa) {
  Scene scene;
  scene.friction = kappa / scene.gravity;  // r = √6, c₁ = 1
  return scene;
}

Eigen::VectorXd vector(const std::vector<double>& values) {
  return Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
}

std::unique_ptr<Shooting> tight_shooting(const Scene& scene, const Structure& arcs) {
  auto shooting = std::make_unique<Shooting>(disk::make_problem(scene, arcs));
  shooting->set_flow_options({.tolerance = {.relative = 1e-13, .absolute = 1e-13}});
  return shooting;
}

double value_of(const Shot& shot, const disk::GuardPlace& place) {
  for (const Guard& guard : shot.guards()) {
    if (guard.name == disk::name_of(place)) return guard.value.value;
  }
  throw BadInput("no guard " + disk::name_of(place));
}

/// A scene, and unknowns that solve its equations.
struct Root {
  Scene scene;
  Eigen::VectorXd y;
};

/// Bends some unknowns until as many rows hold, the first ones, turns the motion so that it starts with heading 0, and takes
/// the end that it reaches for the scene's.
Root by_construction(Scene scene, const Structure& arcs, Eigen::VectorXd y, const std::vector<const char*>& bent) {
  const auto tight = tight_shooting(scene, arcs);
  Shooting& shooting = *tight;
  const auto n = static_cast<Eigen::Index>(bent.size());
  for (int i = 0; i < 12; ++i) {
    Eigen::MatrixXd whole, part(n, n);
    Eigen::VectorXd residual;
    shooting.residual(y, residual);
    shooting.jacobian(y, whole);
    std::vector<Eigen::Index> places;
    for (const char* name : bent) places.push_back(shooting.problem().place_of(name));
    for (Eigen::Index j = 0; j < n; ++j) part.col(j) = whole.col(places[static_cast<std::size_t>(j)]).head(n);
    const Eigen::VectorXd step = part.partialPivLu().solve(residual.head(n));
    for (Eigen::Index j = 0; j < n; ++j) y[places[static_cast<std::size_t>(j)]] -= step[j];
  }
  Eigen::VectorXd residual;
  shooting.residual(y, residual);
  EXPECT_LT(residual.head(n).cwiseAbs().maxCoeff(), 1e-11) << "the construction has not converged";
  if (shooting.problem().rows()[static_cast<std::size_t>(residual.size() - 4)].name == "start heading") {
    y[shooting.problem().place_of("anchor_heading")] -= residual[residual.size() - 4];
    shooting.residual(y, residual);
  }
  scene.heading += residual[residual.size() - 3];
  scene.x += residual[residual.size() - 2];
  scene.y += residual[residual.size() - 1];
  EXPECT_GT(scene.heading, 0.0) << "else the scene is solved in the mirror";
  return {scene, y};
}

class ReferenceChain : public testing::TestWithParam<DiskCase> {};

// The states of a reference, packed, are a root to their 18 digits; every guard is positive there.
TEST_P(ReferenceChain, IsARootWithPositiveGuards) {
  const DiskCase& expected = GetParam();
  EXPECT_EQ(disk::letters(expected.chain.structure()), expected.structure);
  const auto tight = tight_shooting(expected.scene, expected.chain.structure());
  Shooting& shooting = *tight;
  const Eigen::VectorXd y = disk::unknowns(expected.chain);
  EXPECT_LT(shooting.correction(y), 1e-9);
  for (const Guard& guard : shooting.evaluate(y).guards()) EXPECT_GT(guard.value.value, 1e-4) << guard.name;

  const disk::Chain found = disk::chain_of(shooting.problem(), shooting.evaluate(y));
  for (std::size_t i = 0; i < found.arcs.size(); ++i) {
    const std::pair<disk::ArcState, disk::ArcState> ends[] = {{found.arcs[i].begin, expected.chain.arcs[i].begin},
                                                              {found.arcs[i].end, expected.chain.arcs[i].end}};
    for (const auto& [at, known] : ends) {
      EXPECT_NEAR(at.phi, known.phi, 1e-9) << i;
      EXPECT_NEAR(at.V, known.V, 1e-9) << i;
      EXPECT_NEAR(at.lambda_phi, known.lambda_phi, 1e-9) << i;
      // Where V' vanishes it is the root of a difference of the reference's digits.
      const bool known_there = found.arcs[i].type.kind == ArcKind::saturated;
      EXPECT_NEAR(known_there ? at.acceleration : known.acceleration, known.acceleration, 1e-7) << i;
    }
  }
}

// From 1e-3 beside it Newton's method comes back to it, and the certificate holds.
TEST_P(ReferenceChain, IsFoundFromBeside) {
  const DiskCase& expected = GetParam();
  const Eigen::VectorXd y = disk::unknowns(expected.chain);
  const Eigen::VectorXd beside = y + 1e-3 * Eigen::VectorXd::LinSpaced(y.size(), -1.0, 1.0);
  const auto problem = disk::make_problem(expected.scene, expected.chain.structure());
  const Solution solution = solve(problem, beside, {.accuracy = 1e-10});
  ASSERT_TRUE(solution.solved()) << solution.message;
  EXPECT_LT((solution.y - y).cwiseAbs().maxCoeff(), 1e-9);
}

std::vector<DiskCase> cases_with_chains() {
  std::vector<DiskCase> cases;
  for (DiskCase& c : disk_cases()) {
    if (!c.chain.arcs.empty()) cases.push_back(std::move(c));
  }
  return cases;
}

INSTANTIATE_TEST_SUITE_P(Disk, ReferenceChain, testing::ValuesIn(cases_with_chains()), [](const auto& info) {
  std::string name = info.param.name;
  for (char& c : name) {
    if (std::isalnum(static_cast<unsigned char>(c)) == 0) c = '_';
  }
  return name;
});

// Friction binds at the start, where the disk turns left, and at the end, where it turns right.
TEST(DiskTurn, AMotionMayStartLeftAndEndRight) {
  const Structure arcs{{ArcKind::saturated, 1.0, 1.0}, {ArcKind::free}, {ArcKind::saturated, -1.0, -1.0}};
  const Root root = by_construction(with_limit(0.5), arcs, vector({0.1, 0.3, 0.68, 0.4, 1.1, 0.15}),
                                    {"duration_3", "duration_1"});
  const Solution solution = solve(disk::make_problem(root.scene, arcs), root.y, {.accuracy = 1e-10});
  ASSERT_TRUE(solution.solved()) << solution.message;
  EXPECT_GT(solution.at(0.0)[4], 0.1);
  EXPECT_LT(solution.at(solution.final_time())[4], -0.1);
  Shooting shooting(solution.problem);
  for (const Guard& guard : shooting.evaluate(solution.y).guards()) EXPECT_GT(guard.value.value, 0.0) << guard.name;
}

// An arc that turns left cannot begin where a free arc turns right; the rows, which have S = 0 there by construction, do not
// see it.
TEST(DiskTurn, AnArcThatTurnsAgainstTheFreeOneIsNotCertified) {
  const Structure arcs{{ArcKind::free}, {ArcKind::saturated, 1.0, 1.0}};
  const Root root = by_construction(with_limit(0.512444635), arcs, vector({-1.40278, -0.344967, 0.192543, 1.96923}),
                                    {"duration_2"});
  const Solution solution = solve(disk::make_problem(root.scene, arcs), root.y, {.accuracy = 1e-9});
  EXPECT_FALSE(solution.solved());
  EXPECT_NE(solution.message.find("Hamiltonian on a saturated arc"), std::string::npos) << solution.message;
  Shooting shooting(solution.problem);
  EXPECT_LT(value_of(shooting.evaluate(root.y), {GuardKind::turning_at_start, 1}), 0.0);
}

// Ω = λφ of the free arc passes zero at the junction: the guard passes it as well.
TEST(DiskTurn, TheGuardOfTheTurningRatePassesZero) {
  const Structure arcs{{ArcKind::free}, {ArcKind::saturated, -1.0, 1.0}, {ArcKind::free}};
  const auto tight = tight_shooting(with_limit(0.6), arcs);
  Shooting& shooting = *tight;
  for (const double angle : {0.2, -0.2}) {
    const Shot& shot = shooting.evaluate(vector({angle, 0.3, 1e-6, 1e-3, 1e-3}));
    EXPECT_NEAR(value_of(shot, {GuardKind::turning_at_start, 1}), std::sin(angle), 1e-5);
  }
}

// Duffing's equation carries V' through zero, and S ≥ 0 does not see it, but λ_V = S/V' is infinite there.
TEST(DiskCertificate, RefusesASaturatedArcOnWhichTheAccelerationChangesItsSign) {
  const Structure arcs{{ArcKind::saturated, 1.0}, {ArcKind::saturated, -1.0}};
  const Root root = by_construction(with_limit(0.39053), arcs,
                                    vector({0.444933, -0.400119, 0.134352, -0.385284, 0.254064, 0.490853, 0.76182}),
                                    {"anchor_acceleration", "lambda_along", "lambda_across"});
  const Solution solution = solve(disk::make_problem(root.scene, arcs), root.y, {.accuracy = 1e-9});
  EXPECT_FALSE(solution.solved());
  EXPECT_NE(solution.message.find("V' along the sign of a saturated arc"), std::string::npos) << solution.message;
}

// Three end conditions and the limit, for a path that V, V' and the duration make: it solves the scene of its own end, but is
// not isolated.
TEST(DiskCertificate, ASaturatedArcAloneIsRefusedAsSingular) {
  const Structure arcs{{ArcKind::saturated, -1.0}};
  const double kappa = 0.45, V = 0.3;
  const double acceleration = std::sqrt(kappa * kappa - V * V * (1.0 - V * V));
  const Root root = by_construction(with_limit(kappa), arcs, vector({V, acceleration, 0.7, 0.3, 0.6}),
                                    {"anchor_acceleration", "lambda_along"});
  const auto tight = tight_shooting(root.scene, arcs);
  Shooting& shooting = *tight;
  Eigen::VectorXd residual;
  shooting.residual(root.y, residual);
  EXPECT_LT(residual.cwiseAbs().maxCoeff(), 1e-11);
  const Solution solution = solve(disk::make_problem(root.scene, arcs), root.y, {.accuracy = 1e-9});
  EXPECT_FALSE(solution.solved());
  EXPECT_NE(solution.message.find("singular"), std::string::npos) << solution.message;
}

// On long arcs that turn over and over as well, the guard sees A pass zero where the path itself shows it.
TEST(DiskGuards, FrictionInsideAFreeArcIsGuardedWhereTheSpeedPassesZero) {
  const auto tight = tight_shooting(with_limit(0.5), {{ArcKind::free}});
  Shooting& shooting = *tight;
  int passing = 0, steady = 0;
  for (const double lambda : {0.2, 0.9, 0.999, 1.001, 1.01, 1.2, 2.0}) {
    for (double angle = -3.0; angle < 3.1; angle += 0.61) {
      const double across2 = lambda * lambda - std::cos(angle) * std::cos(angle);
      if (across2 < 0.0) continue;
      for (const double duration : {0.1, 1.3, 4.0, 9.0, 14.6, 20.0, 33.0}) {
        for (const double side : {1.0, -1.0}) {
          const Shot& shot = shooting.evaluate(vector({angle, side * std::sqrt(across2), duration}));
          const double guard = value_of(shot, {GuardKind::friction_inside, 0});
          const ArcRecord record = shot.arcs().front();
          const Trajectory path = shooting.flows()[*record.field].record(record.t0, record.t1, record.state,
                                                                         record.quadrature, record.parameter);
          const auto speed = [&](double t) {
            const double phi = path.at(t)[0];
            return record.parameter[0] * std::cos(phi) + record.parameter[1] * std::sin(phi);
          };
          bool passes = false;
          constexpr int looks = 200;
          for (int i = 1; i <= looks && !passes; ++i) {
            passes = (speed(duration * (i - 1) / looks) < 0.0) != (speed(duration * i / looks) < 0.0);
          }
          ++(passes ? passing : steady);
          const double expected = passes ? 1.0 - lambda * lambda / 0.25 : 1.0;
          EXPECT_NEAR(guard, expected, 1e-12) << lambda << ' ' << angle << ' ' << duration << ' ' << side;
        }
      }
    }
  }
  EXPECT_GT(passing, 100);
  EXPECT_GT(steady, 100);
}

TEST(DiskGuards, WithoutALimitOnlyDurationsAreGuarded) {
  Shooting shooting(disk::make_problem(Scene{}, {{ArcKind::free}}));
  const std::vector<Guard> guards = shooting.evaluate(vector({1.0, 0.5, 2.2})).guards();
  ASSERT_EQ(guards.size(), 1u);
  EXPECT_EQ(guards[0].kind, EventKind::arc_death);
  EXPECT_EQ(guards[0].value.value, 2.2);
}

TEST(DiskStructure, ArcsThatCannotMeetAreRefused) {
  const ArcType fast{ArcKind::boundary, 1.0}, slow{ArcKind::boundary, -1.0}, free{ArcKind::free};
  const ArcType up{ArcKind::saturated, 1.0}, down{ArcKind::saturated, -1.0}, up_right{ArcKind::saturated, 1.0, -1.0};
  ArcType fast_backward = fast;
  fast_backward.course = -1.0;
  const auto refuses = [](const Structure& arcs, const char* why) {
    const std::string objection = disk::objection_to(arcs);
    EXPECT_NE(objection.find(why), std::string::npos) << disk::letters(arcs) << ": " << objection;
    EXPECT_THROW((void)disk::make_problem(with_limit(0.45), arcs), BadInput);
  };
  refuses({down, up_right}, "opposite directions");
  refuses({free, {ArcKind::saturated, 0.5}}, "1 or -1");
  refuses({up, fast}, "leads away from the limit");
  refuses({fast, down}, "leads beyond the limit");
  refuses({down, slow}, "leads away from the limit");
  refuses({fast, up, free, up, slow}, "cannot come from");
  refuses({fast, up, free, up, fast_backward}, "cannot come from");
  for (const Structure& arcs : {Structure{fast, up, free, down, fast}, Structure{up, slow, down}, Structure{down, fast, up},
                                Structure{down, free, up_right}, Structure{fast_backward, down, free, up, fast_backward}}) {
    EXPECT_EQ(disk::objection_to(arcs), "") << disk::letters(arcs);
  }
}

}  // namespace
}  // namespace costate::test
