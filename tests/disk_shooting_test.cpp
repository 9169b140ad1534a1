/// The three-arc shooting problem of the rolling disk: exact Jacobian, invariants, and the root that is no solution.
#include <costate/error.hpp>
#include <costate/models/disk.hpp>
#include <costate/shooting/solve.hpp>

#include <gtest/gtest.h>

namespace costate::test {
namespace {

using disk::ArcKind;
using disk::Scene;
using disk::Structure;

const Structure three_arcs{{ArcKind::saturated, +1.0}, {ArcKind::free}, {ArcKind::saturated, -1.0}};

Scene with_friction(double k) {
  Scene scene;
  scene.friction = k;
  return scene;
}

/// Near the solution for k_f = 0.0525.
Eigen::VectorXd near_solution() {
  Eigen::VectorXd y(6);
  y << 0.76, std::acos(0.77), 0.0, 1.08, 0.04, 1.08;
  return y;
}

struct Structured {
  std::string name;
  Scene scene;
  Structure arcs;
  std::vector<double> y;
};

/// A point, not a solution, for every way a structure can be anchored and joined.
std::vector<Structured> all_kinds() {
  Scene limited = with_friction(0.055);
  return {
      {"F", {}, {{ArcKind::free}}, {1.0, 0.5, 2.2}},
      {"CFC", limited, three_arcs, {0.76, 0.7, 0.05, 0.9, 0.3, 0.8}},
      {"FCF",
       with_friction(0.115),
       {{ArcKind::free}, {ArcKind::saturated, 1.0}, {ArcKind::free}},
       {2.4, 0.9, 0.3, 1.0, 0.6}},
      {"CC", limited, {{ArcKind::saturated, 1.0}, {ArcKind::saturated, -1.0}}, {0.78, 0.76, 0.25, 0.75, 0.1, 1.0, 1.1}},
      {"C", limited, {{ArcKind::saturated, -1.0}}, {0.7, 0.2, 0.75, 0.1, 0.9}},
      {"CCC",
       limited,
       {{ArcKind::saturated, 1.0}, {ArcKind::saturated, -1.0}, {ArcKind::saturated, 1.0}},
       {0.78, 0.76, 0.25, 0.75, 0.1, 1.0, 0.6, 0.3}},
      {"FCturningRight", with_friction(0.06), {{ArcKind::free}, {ArcKind::saturated, -1.0, -1.0}}, {-0.4, -0.3, 0.5, 0.4}},
      {"CBC",
       with_friction(0.042),
       {{ArcKind::saturated, 1.0}, {ArcKind::boundary, -1.0}, {ArcKind::saturated, -1.0}},
       {0.7, 0.45, 0.05, 0.5, 0.2, 0.4}},
      {"BCFCB",
       with_friction(0.048),
       {{ArcKind::boundary, 1.0},
        {ArcKind::saturated, 1.0},
        {ArcKind::free},
        {ArcKind::saturated, -1.0},
        {ArcKind::boundary, 1.0}},
       {0.35, 0.45, 0.3, 0.15, 0.6, 1.7, 0.6, 0.1}}};
}

void PrintTo(const Structured& given, std::ostream* out) { *out << given.name; }

class JacobianOf : public testing::TestWithParam<Structured> {};

// Central differences err by h²·R'''/6: halving h must divide the disagreement by four, until rounding ε|R|/h takes over.
TEST_P(JacobianOf, AgreesWithDifferencesToTheirOrder) {
  const Structured& given = GetParam();
  Shooting shooting(disk::make_problem(given.scene, given.arcs));
  shooting.set_flow_options({.tolerance = {.relative = 1e-13, .absolute = 1e-13}});
  const Eigen::VectorXd y = Eigen::Map<const Eigen::VectorXd>(given.y.data(), static_cast<Eigen::Index>(given.y.size()));
  Eigen::MatrixXd exact;
  shooting.jacobian(y, exact);
  const auto disagreement = [&](double h) {
    Eigen::MatrixXd difference(y.size(), y.size());
    for (Eigen::Index j = 0; j < y.size(); ++j) {
      Eigen::VectorXd ahead, behind;
      shooting.residual(y + h * Eigen::VectorXd::Unit(y.size(), j), ahead);
      shooting.residual(y - h * Eigen::VectorXd::Unit(y.size(), j), behind);
      difference.col(j) = (ahead - behind) / (2.0 * h);
    }
    return (difference - exact).cwiseAbs().maxCoeff();
  };
  const double coarse = disagreement(2e-3), fine = disagreement(1e-3);
  EXPECT_NEAR(coarse / fine, 4.0, 0.2) << given.name;
  const double scale = exact.cwiseAbs().maxCoeff();
  EXPECT_LT(disagreement(2e-5), 1e-7 * scale) << given.name;
}

TEST_P(JacobianOf, ParameterDerivativeAgreesWithDifferences) {
  const Structured& given = GetParam();
  Shooting shooting(disk::make_problem(given.scene, given.arcs));
  shooting.set_flow_options({.tolerance = {.relative = 1e-13, .absolute = 1e-13}});
  const Eigen::VectorXd y = Eigen::Map<const Eigen::VectorXd>(given.y.data(), static_cast<Eigen::Index>(given.y.size()));
  const std::vector<double> base = shooting.parameters();
  for (std::size_t j = 0; j < base.size(); ++j) {
    std::vector<double> path(base.size(), 0.0);
    path[j] = 1.0;
    shooting.set_parameters(base);
    const Eigen::VectorXd exact = shooting.path_derivative(shooting.evaluate(y, path));
    const double h = 1e-4 * std::abs(base[j]);
    Eigen::VectorXd ahead, behind;
    auto moved = base;
    moved[j] = base[j] + h;
    shooting.set_parameters(moved);
    shooting.residual(y, ahead);
    moved[j] = base[j] - h;
    shooting.set_parameters(moved);
    shooting.residual(y, behind);
    const double scale = 1.0 + exact.cwiseAbs().maxCoeff();
    EXPECT_LT(((ahead - behind) / (2.0 * h) - exact).cwiseAbs().maxCoeff(), 1e-5 * scale)
        << given.name << ", parameter " << shooting.problem().parameters()[j].name;
  }
}

// The guards are solved for with Newton's method: their gradients must be exact, too.
TEST_P(JacobianOf, GuardsAgreeWithDifferences) {
  const Structured& given = GetParam();
  Shooting shooting(disk::make_problem(given.scene, given.arcs));
  shooting.set_flow_options({.tolerance = {.relative = 1e-13, .absolute = 1e-13}});
  const Eigen::VectorXd y = Eigen::Map<const Eigen::VectorXd>(given.y.data(), static_cast<Eigen::Index>(given.y.size()));
  const std::vector<Guard> exact = shooting.evaluate(y).guards();
  const auto places = disk::guards_of(given.arcs, given.scene.friction.has_value());
  ASSERT_EQ(exact.size(), places.size());
  constexpr double h = 1e-5;
  for (Eigen::Index j = 0; j < y.size(); ++j) {
    const std::vector<Guard> ahead = shooting.evaluate(y + h * Eigen::VectorXd::Unit(y.size(), j)).guards();
    const std::vector<Guard> behind = shooting.evaluate(y - h * Eigen::VectorXd::Unit(y.size(), j)).guards();
    for (std::size_t i = 0; i < exact.size(); ++i) {
      EXPECT_EQ(exact[i].name, disk::name_of(places[i]));
      const double slope = exact[i].value.derivative(static_cast<int>(j));
      EXPECT_NEAR((ahead[i].value.value - behind[i].value.value) / (2.0 * h), slope, 1e-7 * (1.0 + std::abs(slope)))
          << given.name << ", " << exact[i].name << " by "
          << shooting.problem().unknowns()[static_cast<std::size_t>(j)].name;
    }
  }
}

// Packing what was read from a shot gives the unknowns of the shot.
TEST_P(JacobianOf, ChainHoldsTheUnknowns) {
  const Structured& given = GetParam();
  Shooting shooting(disk::make_problem(given.scene, given.arcs));
  shooting.set_flow_options({.tolerance = {.relative = 1e-13, .absolute = 1e-13}});
  const Eigen::VectorXd y = Eigen::Map<const Eigen::VectorXd>(given.y.data(), static_cast<Eigen::Index>(given.y.size()));
  const disk::Chain chain = disk::chain_of(shooting.problem(), shooting.evaluate(y));
  EXPECT_EQ(chain.structure(), given.arcs);
  const Eigen::VectorXd packed = disk::unknowns(chain);
  ASSERT_EQ(packed.size(), y.size());
  EXPECT_LT((packed - y).cwiseAbs().maxCoeff(), 1e-14);
  for (std::size_t i = 0; i + 1 < chain.arcs.size(); ++i) {
    EXPECT_NEAR(chain.arcs[i].end.phi, chain.arcs[i + 1].begin.phi, 1e-14) << i;
    EXPECT_NEAR(chain.arcs[i].end.lambda_phi, chain.arcs[i + 1].begin.lambda_phi,
                given.arcs[i].kind == ArcKind::free ? 1e-14 : 1.0);
  }
}

// φ → −φ, y → −y with λy → −λy, λφ → −λφ: rows and guards are those of the mirror image.
TEST_P(JacobianOf, MirrorImageTurnsTheOtherWay) {
  const Structured& given = GetParam();
  Structure mirrored = given.arcs;
  for (disk::ArcType& arc : mirrored) arc.turn = -arc.turn;
  Shooting left(disk::make_problem(given.scene, given.arcs)), right(disk::make_problem(given.scene, mirrored));
  for (Shooting* shooting : {&left, &right})
    shooting->set_flow_options({.tolerance = {.relative = 1e-13, .absolute = 1e-13}});
  const Eigen::VectorXd y = Eigen::Map<const Eigen::VectorXd>(given.y.data(), static_cast<Eigen::Index>(given.y.size()));
  Eigen::VectorXd image = y;
  for (std::size_t j = 0; j < left.problem().unknowns().size(); ++j) {
    const std::string& name = left.problem().unknowns()[j].name;
    const bool negated = name == "anchor_heading" || name == "speed_angle" || name == "lambda_across";
    if (negated) image[static_cast<Eigen::Index>(j)] *= -1.0;
  }
  const Shot &shot = left.evaluate(y), &seen = right.evaluate(image);
  const auto target = [&](const std::string& row) {  // L = 1
    return row == "end heading" ? given.scene.heading : row == "end y" ? given.scene.y : 0.0;
  };
  for (std::size_t i = 0; i < shot.rows().size(); ++i) {
    const std::string& name = left.problem().rows()[i].name;
    const bool negated = name == "start heading" || name == "end heading" || name == "end y";
    const double expected = (negated ? -1.0 : 1.0) * (shot.rows()[i].value + target(name)) - target(name);
    EXPECT_NEAR(seen.rows()[i].value, expected, 1e-11) << name;
  }
  ASSERT_EQ(shot.guards().size(), seen.guards().size());
  for (std::size_t i = 0; i < shot.guards().size(); ++i)
    EXPECT_NEAR(seen.guards()[i].value.value, shot.guards()[i].value.value, 1e-11) << shot.guards()[i].name;
}

INSTANTIATE_TEST_SUITE_P(Disk, JacobianOf, testing::ValuesIn(all_kinds()), [](const auto& info) { return info.param.name; });

// H is a first integral; the integration may move it by its own error, ten tolerances at most.
TEST(DiskShooting, HamiltonianDriftStaysWithinTenTolerances) {
  const Solution root = solve(disk::make_problem(with_friction(0.0525), three_arcs), near_solution(), {.accuracy = 1e-11});
  ASSERT_TRUE(root.solved()) << root.message;
  Shooting shooting(root.problem);
  for (const double tolerance : {1e-5, 1e-7, 1e-9, 1e-11, 1e-13}) {
    shooting.set_flow_options({.tolerance = {.relative = tolerance, .absolute = tolerance}});
    for (const ArcRecord& record : shooting.evaluate(root.y).arcs()) {
      const Trajectory arc = shooting.flows()[*record.field].record(record.t0, record.t1, record.state, record.quadrature,
                                                                    record.parameter);
      for (const auto& piece : arc.pieces()) {
        const Eigen::VectorXd both = arc.at(piece.node);
        const Eigen::Index n = record.state.size();
        const ArcPoint point{&record, piece.node, both.head(n), both.tail(both.size() - n), piece.node};
        for (const PathCheck& check : root.problem->check(point, shooting.parameters())) {
          if (check.kind != PathCheck::Kind::zero) continue;
          EXPECT_LE(std::abs(check.value), 10.0 * tolerance) << check.name << " on arc " << record.arc + 1;
        }
      }
    }
  }
}

// Below the merge the three-arc equations still have a root, with a free arc of negative duration.
TEST(DiskShooting, SpuriousThreeArcRootIsRefused) {
  const Solution solution = solve(disk::make_problem(with_friction(0.052), three_arcs), near_solution());
  EXPECT_FALSE(solution.solved());
  EXPECT_NEAR(solution["final_time"].value, 2.214179474611, 1e-9) << "this is not the root in question";
  EXPECT_NE(solution.message.find("duration_2"), std::string::npos) << solution.message;
}

// The other one, of vanishing saturated arcs, is divided out: even from its neighbourhood it is not found.
TEST(DiskShooting, TrivialRootIsDeflated) {
  Eigen::VectorXd y(6);
  y << 0.01, std::acos(0.5439), 0.5439, 0.01, 2.19, 0.01;
  const Solution solution = solve(disk::make_problem(with_friction(0.0525), three_arcs), y);
  if (solution.solved()) {
    EXPECT_NEAR(solution["t1"].value, 1.0855647258861120, 1e-8);
  } else {
    EXPECT_FALSE(solution.message.empty());
  }
}

TEST(DiskShooting, StructuresThatCannotBeAreRefused) {
  EXPECT_THROW((void)disk::make_problem({}, {}), BadInput);
  EXPECT_THROW((void)disk::make_problem({}, {{ArcKind::free}, {ArcKind::free}}), BadInput);
  EXPECT_THROW((void)disk::make_problem(with_friction(0.05), {{ArcKind::boundary, 1.0}, {ArcKind::free}}), BadInput);
  EXPECT_THROW((void)disk::make_problem(with_friction(0.05), {{ArcKind::saturated, 1.0}, {ArcKind::saturated, 1.0}}),
               BadInput);
  EXPECT_THROW((void)disk::make_problem({}, three_arcs), BadInput) << "no friction coefficient";
}

TEST(DiskShooting, UnknownsAreFoundByName) {
  const auto problem = disk::make_problem(with_friction(0.0525), three_arcs);
  EXPECT_EQ(problem->place_of("duration_2"), 4);
  EXPECT_THROW((void)problem->place_of("duration_4"), BadInput);
}

}  // namespace
}  // namespace costate::test
