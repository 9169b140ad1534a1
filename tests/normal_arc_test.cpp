/// The bead's arc as it is integrated: against its own definition, the state–costate flow of Pontryagin's principle, and
/// differences.
#include "normal/extremal_search.hpp"
#include "normal/normal_scene.hpp"
#include "normal_reference.hpp"

#include <costate/flow.hpp>
#include <costate/shooting/shooting.hpp>

#include <gtest/gtest.h>
#include <random>

namespace costate::normal_friction {
namespace {

using test::NormalCase;

/// A random extremal point: force, θ₂ and τ in a range where it moves.
struct Sample {
  Push<double> push;
  double theta2, left;
};
std::vector<Sample> samples() {
  std::mt19937_64 random(7);
  const auto uniform = [&](double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); };
  std::vector<Sample> list;
  while (list.size() < 200) {
    const Sample s{{uniform(-20.0, 0.0), -9.8, uniform(-5.0, 5.0)}, uniform(-1.4, 1.2), uniform(-0.8, 0.8)};
    const SlopePoint<double> p(s.push, s.theta2, s.left);
    if (std::abs(p.q) > 0.5 && std::abs(p.d) > 0.5) list.push_back(s);
  }
  return list;
}

TEST(SlopePoint, IsWhatItsDefinitionSays) {
  using D = Dual<double, 1>;
  using DD = Dual<D, 1>;
  for (const Sample& s : samples()) {
    const SlopePoint<double> p(s.push, s.theta2, s.left);
    const DD theta = DD::variable(D::variable(s.theta2 - s.left, 0), 0), cosine = cos(theta);
    const DD f = s.push.x * cosine + s.push.y * sin(theta) + s.push.cubic * cosine * cosine * cosine;
    const double d_slope = -f.gradient[0].gradient[0];
    // A few roundings of terms of at most 40 m/s².
    EXPECT_NEAR(p.f, f.value.value, 1e-13);
    EXPECT_NEAR(p.d, -f.value.gradient[0], 1e-13);
    EXPECT_NEAR(p.q, p.d * std::cos(s.left) + p.f * std::sin(s.left), 1e-13);
    EXPECT_NEAR(p.gamma, d_slope * std::sin(s.left) + p.d * std::cos(s.left), 1e-13);
  }
}

// v' = f and λv' = −(λx cos θ + λy sin θ) along θ' = q²/(v_f Γ); here v_f = 1.
TEST(SlopePoint, MovesAsTheStateAndTheCostate) {
  using D = Dual<double, 1>;
  for (const Sample& s : samples()) {
    const SlopePoint<D> p(Push<D>{s.push.x, s.push.y, s.push.cubic}, D(s.theta2), D::variable(s.left, 0));
    const double slowness = p.slowness().value;  // dt/dθ, and dθ = −dτ
    EXPECT_NEAR(-p.speed_ratio().gradient[0], p.f.value * slowness, 1e-12 * (1.0 + std::abs(p.f.value * slowness)));
    EXPECT_NEAR(-p.lambda_v().gradient[0], -std::cos(s.left) * slowness, 1e-12 * (1.0 + std::abs(slowness)));
  }
}

TEST(BestSlope, MaximisesTheHamiltonianOverTheCircle) {
  const Bead model;
  std::mt19937_64 random(11);
  const auto uniform = [&](double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); };
  for (int sample = 0; sample < 100; ++sample) {
    const Vec<double, 3> q{0.0, 0.0, uniform(0.1, 30.0)}, costate{uniform(-1.0, 1.0), uniform(-1.0, 1.0), uniform(0.0, 1.0)};
    const Vec<double, 3> p{uniform(0.0, 15.0), uniform(-0.05, 0.05), 9.8};
    const auto best = BestSlope().control(q, costate, p);
    const double highest = hamiltonian(model, q, costate, best, p);
    for (int i = 0; i < 720; ++i) {
      const Vec<double, 1> other{i * std::numbers::pi / 360};
      EXPECT_LE(hamiltonian(model, q, costate, other, p), highest + 1e-13 * (1.0 + std::abs(highest)));
    }
    const auto dual = hamiltonian(model, lift<Dual<double, 1>>(q), lift<Dual<double, 1>>(costate),
                                  Vec<Dual<double, 1>, 1>{Dual<double, 1>::variable(best[0], 0)}, lift<Dual<double, 1>>(p));
    EXPECT_NEAR(dual.gradient[0], 0.0, 1e-12);
  }
}

// The maxima at ±A are equally high at σ = 0, where the third, at π, is lower: the law takes one of the two.
TEST(BestSlope, TakesOneOfTwoEqualMaxima) {
  const double theta = BestSlope::of({1.2, 0.0, -1.0});  // 3 cos²A = 1.2
  EXPECT_NEAR(std::abs(theta), std::acos(std::sqrt(0.4)), 1e-14);
  EXPECT_GT(BestSlope::of({1.2, 1e-6, -1.0}), 0.0);
  EXPECT_LT(BestSlope::of({1.2, -1e-6, -1.0}), 0.0);
}

class Flows : public testing::TestWithParam<NormalCase> {};

// The full flow knows nothing of the reduction: z = (v, λv), p = (λx, λy, μ, β, g), w = (x, y), over the time.
TEST_P(Flows, ReducedArcIsPontryaginsFlow) {
  const Scene& scene = GetParam().scene;
  const tools::Outcome outcome = solve_scene(scene, {.accuracy = 1e-11});
  ASSERT_TRUE(outcome.solved());
  using Full = Pontryagin<Bead, BestSlope>;
  const FieldOf<Full> field;
  constexpr double tolerance = 1e-12;
  Flow flow(field, {.tolerance = {tolerance, tolerance}});
  const double T = outcome["final_time"].value;
  const Eigen::Vector2d start(scene.speed, outcome["lambda_v0"].value);
  Eigen::VectorXd p(5);
  p << outcome["lambda_x"].value, outcome["lambda_y"].value, scene.mu, scene.beta, scene.gravity;
  const FlowEnd end = flow.run(0.0, T, start, p, {Eigen::MatrixXd::Identity(2, 2), Eigen::MatrixXd::Zero(5, 2)});
  // A few hundred steps of at most the tolerance, relative to the state; and what they grow by.
  const double growth = 1.0 + end.state_directions.cwiseAbs().maxCoeff() + end.quadrature_directions.cwiseAbs().maxCoeff();
  const double admissible = 300 * tolerance * growth * (1.0 + scene.speed);
  EXPECT_NEAR(end.quadrature[0], scene.x, admissible);
  EXPECT_NEAR(end.quadrature[1], scene.y, admissible);
  EXPECT_NEAR(end.state[0], outcome["v_f"].value, admissible);
  EXPECT_NEAR(end.state[1], 0.0, admissible);
  EXPECT_NEAR(Full().hamiltonian({end.state[0], end.state[1]}, {p[0], p[1], p[2], p[3], p[4]}), 0.0, admissible);
  if (outcome.closed_form) return;
  for (const double share : {0.2, 0.5, 0.9}) {
    const std::vector<double> reduced = outcome.solution.at(share * T);
    const FlowEnd& full = flow.run(0.0, share * T, start, p, {Eigen::MatrixXd(2, 0), Eigen::MatrixXd(5, 0)});
    EXPECT_NEAR(full.quadrature[0], reduced[0], admissible);
    EXPECT_NEAR(full.quadrature[1], reduced[1], admissible);
    EXPECT_NEAR(full.state[0], reduced[2], admissible);
    EXPECT_NEAR(full.state[1], reduced[6], admissible);
  }
}
INSTANTIATE_TEST_SUITE_P(Normal, Flows, testing::ValuesIn(test::normal_cases()),
                         [](const auto& info) { return "case_" + std::to_string(info.index); });

/// Scenes with one, two and three arcs.
const Scene one_arc{3.0, -2.0, 2.0, 0.3, -0.001, 9.8};
const Scene two_arcs{13.6961, -4.90538, 13.9873, 1.0, -0.00168, 9.8};
const Scene three_arcs{1.0, -1.0, 1.0, 0.893, -0.00338, 9.8};

TEST(Corners, StructuresAreFound) {
  for (const auto& [scene, arcs] : {std::pair{one_arc, 1U}, {two_arcs, 2U}, {three_arcs, 3U}}) {
    const std::vector<RoughExtremal> found = find_extremals(scene);
    ASSERT_EQ(found.size(), 1U);
    EXPECT_EQ(found[0].structure.size(), arcs);
    const tools::Outcome outcome = solve_scene(scene, {.accuracy = 1e-9});
    ASSERT_TRUE(outcome.solved()) << outcome.message;
    EXPECT_EQ(outcome.solution.arcs.size(), arcs);
    EXPECT_NEAR(outcome["final_time"].value, found[0].time, 1e-5 * found[0].time) << "interpolated and solved";
  }
}

TEST(Corners, StateAndCostatesAreContinuousAndTheSlopeJumps) {
  const tools::Outcome outcome = solve_scene(three_arcs, {.accuracy = 1e-10});
  ASSERT_TRUE(outcome.solved());
  const auto& arcs = outcome.solution.arcs;
  for (std::size_t i = 1; i < arcs.size(); ++i) {
    EXPECT_NEAR(arcs[i].begin, outcome["t" + std::to_string(i)].value, 1e-10);
    const auto at = [&](const ArcTrace& arc, double sigma) {
      return outcome.solution.problem->observe(arc.point(sigma), outcome.solution.parameters);
    };
    const std::vector<double> before = at(arcs[i - 1], 1.0), after = at(arcs[i], 0.0);
    for (const std::size_t column : {0U, 1U, 2U, 4U, 5U, 6U}) EXPECT_NEAR(before[column], after[column], 1e-9) << column;
    EXPECT_GT(std::abs(after[3] - before[3]), 0.1);
    // Both slopes are maxima of H, and as high.
    const Vec<double, 3> p{three_arcs.mu, three_arcs.beta, three_arcs.gravity};
    const Vec<double, 3> q{before[0], before[1], before[2]}, costate{before[4], before[5], before[6]};
    EXPECT_NEAR(hamiltonian(Bead(), q, costate, Vec<double, 1>{before[3]}, p), 0.0, 1e-9);
    EXPECT_NEAR(hamiltonian(Bead(), q, costate, Vec<double, 1>{after[3]}, p), 0.0, 1e-9);
  }
}

TEST(Jacobian, IsWhatDifferencesSay) {
  for (const Scene& scene : {one_arc, two_arcs, three_arcs}) {
    const RoughExtremal rough = find_extremals(scene).at(0);
    Shooting shooting(make_problem(scene, rough.structure));
    shooting.set_flow_options({.tolerance = {1e-13, 1e-13}});
    const Eigen::VectorXd y = rough.unknowns;
    const Eigen::MatrixXd exact = shooting.jacobian(shooting.evaluate(y));
    for (Eigen::Index j = 0; j < y.size(); ++j) {
      constexpr double h = 2e-5;
      const auto at = [&](double step) {
        Eigen::VectorXd moved = y;
        moved[j] += step * h;
        return shooting.residual(shooting.values(moved));
      };
      // Of fourth order: h⁴ times a fifth derivative of the order of the column, and integration error over h.
      const Eigen::VectorXd difference = (at(-2.0) - 8.0 * at(-1.0) + 8.0 * at(1.0) - at(2.0)) / (12.0 * h);
      EXPECT_LT((difference - exact.col(j)).cwiseAbs().maxCoeff(), 1e-6 * (1.0 + exact.col(j).cwiseAbs().maxCoeff())) << j;
    }
  }
}

TEST(Jacobian, StaysWellConditionedFromSlowStartsToFastOnes) {
  double worst = 0.0;
  for (const double speed : {1e-4, 0.1, 1.0, 10.0, 100.0, 1e4}) {
    const tools::Outcome outcome = solve_scene({3.0, -2.0, speed, 0.3, -0.001, 9.8}, {.accuracy = 1e-9});
    ASSERT_TRUE(outcome.solved()) << speed << ": " << outcome.message;
    worst = std::max(worst, outcome.solution.certificate.condition * std::min(1.0, speed));
  }
  EXPECT_LT(worst, 100.0) << "like 1/v0 from rest, bounded otherwise";
}

TEST(NormalProblem, IsOneArcUnlessToldOtherwise) { EXPECT_EQ(make_problem(Scene{})->structure().size(), 1U); }

TEST(NormalProblem, AStructureWithoutArcsIsBadInput) { EXPECT_THROW((void)make_problem(Scene{}, {}), BadInput); }

}  // namespace
}  // namespace costate::normal_friction
