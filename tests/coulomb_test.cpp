/// The optimum of the bead with Coulomb friction: references, closed form, Pontryagin's flow, derivatives, identities.
#include "coulomb/coulomb_scene.hpp"
#include "coulomb_reference.hpp"

#include <costate/error.hpp>
#include <costate/models/cycloid.hpp>
#include <costate/shooting/continuation.hpp>

#include <Eigen/LU>
#include <algorithm>
#include <gtest/gtest.h>
#include <random>

namespace costate::test {
namespace {

using coulomb::Scene;
using tools::Outcome;

Solution solved(const Scene& scene, double accuracy) {
  const Outcome outcome = coulomb::solve_scene(scene, {.accuracy = accuracy});
  EXPECT_TRUE(outcome.solved()) << outcome.message;
  return outcome.solution;
}

const Scene several[] = {{5.0, 4.0, 9.81, 1.0},  {1.0, 1.0, 9.81, 0.5},  {1.0, 6.0, 9.81, 0.1},
                         {10.0, 1.0, 9.81, 4.0}, {2.0, 3.0, 1.62, 0.25}, {0.01, 1.0, 9.81, 0.004}};

class CoulombReference : public testing::TestWithParam<CoulombCase> {};

TEST_P(CoulombReference, ReproducesInEveryUnknown) {
  const CoulombCase& c = GetParam();
  const Outcome outcome = coulomb::solve_scene(c.scene, {.accuracy = 1e-11});
  ASSERT_TRUE(outcome.solved()) << outcome.message;
  for (const auto& [name, value] : c.values) {
    const Quantity& found = outcome[name];
    EXPECT_NEAR(found.value, value, 1e-10 * std::abs(value) + c.unknown(name)) << name;
    EXPECT_NEAR(found.value, value, found.error_bound + c.unknown(name)) << name << ": the claimed bound does not hold";
    EXPECT_LE(found.error_bound, 1e-11 * std::max(1.0, std::abs(value))) << name;
  }
  if (outcome.closed_form) {
    EXPECT_EQ(outcome.cost.rhs_evaluations, 0);
    EXPECT_EQ(c.scene.friction, 0.0);
    return;
  }
  EXPECT_TRUE(outcome.solution.certificate.holds());
  EXPECT_LT(outcome.solution.certificate.condition, 5.0);
  if (c.turn) {
    const double slope_by_logit = *c.turn * (std::numbers::pi - *c.turn) / std::numbers::pi;
    const Quantity& turn = outcome.solution["turn"];
    EXPECT_NEAR(std::numbers::pi / (1.0 + std::exp(-turn.value)), *c.turn,
                slope_by_logit * (turn.error_bound +
                                  1e-16 * largest_friction(c.scene) / (largest_friction(c.scene) - c.scene.friction)) +
                    1e-15);
  }
}

TEST_P(CoulombReference, BoundsHoldAtEveryAccuracy) {
  const CoulombCase& c = GetParam();
  for (const double accuracy : {1e-3, 1e-6, 1e-9}) {
    const Outcome outcome = coulomb::solve_scene(c.scene, {.accuracy = accuracy});
    ASSERT_TRUE(outcome.solved()) << outcome.message;
    for (const auto& [name, value] : c.values) {
      EXPECT_NEAR(outcome[name].value, value, outcome[name].error_bound + c.unknown(name)) << name << " at " << accuracy;
      EXPECT_LE(outcome[name].error_bound, accuracy * std::max(1.0, std::abs(value))) << name << " at " << accuracy;
    }
  }
}

/// dq/ds along a path of parameters of a quantity q of a solution: q_y dy/ds + q_s, R_y dy/ds = −R_s.
double derivative_along(const Solution& solution, const std::string& name, const std::vector<double>& path) {
  Shooting shooting(solution.problem);
  shooting.set_flow_options({.tolerance = {.relative = 1e-13, .absolute = 1e-13}});
  const Shot& shot = shooting.evaluate(solution.y, path);
  const Eigen::VectorXd dy = -shooting.jacobian(shot).partialPivLu().solve(shooting.path_derivative(shot));
  const auto report = std::find_if(shot.reports().begin(), shot.reports().end(),
                                   [&](const Report& r) { return r.name == name; });
  double sum = report->value.derivative(static_cast<int>(shooting.size()));
  for (Eigen::Index i = 0; i < shooting.size(); ++i) sum += report->value.derivative(static_cast<int>(i)) * dy[i];
  return sum;
}

TEST_P(CoulombReference, CostatesAreTheDerivativesOfTheTime) {
  const CoulombCase& c = GetParam();
  // Shooting also without friction, where the tool has a closed form.
  const Solution s = solve(coulomb::make_problem(c.scene), Eigen::Vector2d::Zero(), {.accuracy = 1e-11, .max_step = 100.0});
  ASSERT_TRUE(s.solved()) << s.message;
  const double lambda_x = s["lambda_x"].value, lambda_y = s["lambda_y"].value, T = s["final_time"].value;
  // As μ → H/L the costates grow like 1/(H/L − μ) and cancel in the time: each is good to its own bound.
  const double both = c.scene.span * s["lambda_x"].error_bound + c.scene.drop * s["lambda_y"].error_bound;
  EXPECT_NEAR(c.scene.span * lambda_x + c.scene.drop * lambda_y, 0.5 * T, both + s["final_time"].error_bound + 1e-14 * T);
  // Sensitivities are good to the tolerance of their integration, amplified by no more than the bounded condition.
  const double lambda = std::max(std::abs(lambda_x),
                                 std::abs(lambda_y));  // λy goes through 0 on the way from L = 0 to H = 0
  EXPECT_NEAR(derivative_along(s, "final_time", {0.0, 1.0, 0.0, 0.0}), lambda_x, 1e-10 * lambda);
  EXPECT_NEAR(derivative_along(s, "final_time", {1.0, 0.0, 0.0, 0.0}), lambda_y, 1e-10 * lambda);
  EXPECT_NEAR(derivative_along(s, "final_time", {0.0, 0.0, 1.0, 0.0}) / (-0.5 * T / c.scene.gravity), 1.0, 1e-10);
  // What the decimal μ leaves open: relative, its rounding over the distance to the limit.
  const double distance = largest_friction(c.scene) - c.scene.friction;
  const double rounding = 4.0 * std::ldexp(c.scene.friction, -52) / distance;
  for (const auto& [name, slope] : c.per_mu) {
    // The end slope changes by the turn of the wire times a sensitivity, however little it changes with μ.
    const double turn = name == "alphaF" ? s["alpha0"].value - s["alphaF"].value : 0.0;
    EXPECT_NEAR(derivative_along(s, name, {0.0, 0.0, 0.0, 1.0}), slope, (1e-9 + rounding) * std::abs(slope) + 1e-12 * turn)
        << name;
  }
}

std::string coulomb_name(const testing::TestParamInfo<CoulombCase>& info) {
  std::string name = info.param.name;
  for (char& letter : name) {
    if (std::isalnum(static_cast<unsigned char>(letter)) == 0) letter = '_';
  }
  return name + "_" + std::to_string(info.index);
}
INSTANTIATE_TEST_SUITE_P(Coulomb, CoulombReference, testing::ValuesIn(coulomb_cases()), coulomb_name);

TEST(Coulomb, ThirtySixCasesAreTested) { EXPECT_EQ(coulomb_cases().size(), 36U); }

TEST(Coulomb, CostatesLeadToTheEndByTheClosedForm) {
  for (const Scene& scene : several) {
    const Solution s = solved(scene, 1e-11);
    const CoulombEnd end = coulomb_closed_form(scene, s["lambda_x"].value, s["lambda_y"].value);
    // The errors of the costates move the end; the shooting is conditioned within 5, so by about as much relatively.
    const double relative = 1e-10;
    EXPECT_NEAR(static_cast<double>(end.x / scene.span), 1.0, relative);
    EXPECT_NEAR(static_cast<double>(end.y / scene.drop), 1.0,
                relative * scene.span / scene.drop * std::max(1.0, scene.drop / scene.span));
    EXPECT_NEAR(static_cast<double>(end.t) / s.final_time(), 1.0, relative);
  }
}

// All integrals over φ are elementary; that of the time is (A/g r²) (r φ_F + 2μ (1 − φ_F cot φ_F)).
TEST(Coulomb, TimeIsElementary) {
  for (const Scene& scene : several) {
    const Solution s = solved(scene, 1e-11);
    const double mu = scene.friction, turn = std::numbers::pi / (1.0 + std::exp(-s["turn"].value));
    const double cot = std::cos(turn) / std::sin(turn);
    const double r = mu * cot + std::sqrt(1.0 + mu * mu / std::pow(std::sin(turn), 2));
    const double A = (1.0 + mu * mu + r * r) / (2.0 * s["lambda_x"].value);
    const double time = A / (scene.gravity * r * r) * (r * turn + 2.0 * mu * (1.0 - turn * cot));
    EXPECT_NEAR(time / s.final_time(), 1.0, 1e-10) << "turn and lambda_x are good to 1e-11, and amplified by some units";
  }
}

/// dT/dμ = −∫H_μ dt with the state, the costate and the control held.
TEST(Coulomb, TimeBySensitivityIsTheQuadratureOfTheHamiltonianBySlope) {
  constexpr double node = 0.7745966692414834;  // Gauss, three points
  for (const Scene& scene : several) {
    const Solution s = solved(scene, 1e-11);
    const auto rate = [&](double t) {
      const auto row = s.at(t);  // x, y, v, alpha, lambda_x, lambda_y, lambda_v
      const double v = row[2], alpha = row[3], sine = std::sin(alpha), cosine = std::cos(alpha), mu = scene.friction;
      const double drive = row[6] * scene.gravity;
      return alpha * (v * (row[4] * cosine + row[5] * sine) - drive * (sine - mu * cosine)) - drive * cosine;
    };
    constexpr int cells = 400;
    const double h = s.final_time() / cells;
    double sum = 0.0;
    for (int i = 0; i < cells; ++i) {
      const double middle = (i + 0.5) * h;
      sum += h / 18.0 * (5.0 * rate(middle - 0.5 * h * node) + 8.0 * rate(middle) + 5.0 * rate(middle + 0.5 * h * node));
    }
    const double slope = derivative_along(s, "final_time", {0.0, 0.0, 0.0, 1.0});
    EXPECT_NEAR(-sum / slope, 1.0, 1e-8);
    // And by differences, of the fourth order.
    const double step = 1e-3 * (largest_friction(scene) - scene.friction);
    const auto time = [&](double shift) {
      Scene moved = scene;
      moved.friction += shift * step;
      return solved(moved, 1e-11)["final_time"].value;
    };
    const double difference = (8.0 * (time(1) - time(-1)) - (time(2) - time(-2))) / (12.0 * step);
    EXPECT_NEAR(difference / slope, 1.0, 1e-8);
  }
}

TEST(Coulomb, ReducedArcIsThePontryaginFlow) {
  using Full = Pontryagin<coulomb::SlidingBead, coulomb::FastestSlope>;
  const FieldOf<Full> field;
  for (const Scene& scene : several) {
    const Solution s = solved(scene, 1e-11);
    const double T = s.final_time(), mu = scene.friction, up = std::exp(0.5 * mu * std::numbers::pi);
    Eigen::VectorXd p(4);
    p << s["lambda_x"].value, s["lambda_y"].value, mu, scene.gravity;
    Flow flow(field, {.tolerance = {1e-13, 1e-15}});
    const Trajectory path = flow.record(0.0, T, Eigen::Vector2d{0.0, up / scene.gravity}, Eigen::Vector2d::Zero(), p);
    for (const double part : {0.1, 0.3, 0.5, 0.8, 1.0}) {
      const auto row = s.at(part * T);
      const Eigen::VectorXd z = path.at(part * T);  // z, lambda_z, x, y
      const double grow = std::exp(mu * row[3]), size = scene.drop + scene.span;
      const double speed = std::sqrt(2.0 * scene.gravity * scene.drop);
      // The flow from the start in time amplifies the errors of the costates (1e-12) and of its own steps by up to some 1e3.
      EXPECT_NEAR(z[0] * grow / speed, row[2] / speed, 1e-9) << part;
      EXPECT_NEAR(z[1] / grow * scene.gravity, row[6] * scene.gravity, 1e-9) << part;
      EXPECT_NEAR(z[2] / size, row[0] / size, 1e-9) << part;
      EXPECT_NEAR(z[3] / size, row[1] / size, 1e-9) << part;
    }
  }
}

TEST(Coulomb, LawMaximisesTheHamiltonian) {
  std::mt19937_64 random(20250125);
  const auto within = [&](double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); };
  for (int i = 0; i < 200; ++i) {
    const double mu = within(0.0, 2.0), lambda_x = within(0.1, 2.0), lambda_y = within(-2.0, lambda_x / std::max(mu, 0.05));
    const Vec<double, 3> q{0.0, 0.0, within(0.0, 3.0)}, costate{lambda_x, lambda_y, within(0.0, 2.0)};
    const Vec<double, 2> p{mu, 9.81};
    const coulomb::SlidingBead model;
    const auto law = coulomb::FastestSlope{}.control<double>(q, costate, p);
    const double best = hamiltonian(model, q, costate, law, p);
    for (int k = 0; k <= 400; ++k) {
      const double alpha = law[0] + (k - 200) * 0.005 * std::numbers::pi;
      if (alpha > std::numbers::pi / 2 || alpha < -std::numbers::pi / 2) continue;
      EXPECT_LE(hamiltonian(model, q, costate, {alpha}, p), best + 1e-13 * (1.0 + std::abs(best))) << i;
    }
  }
}

TEST(Coulomb, JacobianIsThatOfDifferences) {
  for (const Scene& scene : several) {
    Shooting shooting(coulomb::make_problem(scene));
    shooting.set_flow_options({.tolerance = {.relative = 1e-14, .absolute = 1e-14}});
    const Eigen::Vector2d y{0.4, -0.3};
    const Eigen::MatrixXd exact = shooting.jacobian(shooting.evaluate(y));
    const double h = 5e-3;  // h⁴/30 of the fifth derivative, 1e-13/h of the integration's error
    for (Eigen::Index j = 0; j < 2; ++j) {
      const auto at = [&](double shift) {
        return shooting.residual(shooting.evaluate(y + shift * h * Eigen::Vector2d::Unit(j)));
      };
      const Eigen::VectorXd difference = (8.0 * (at(1) - at(-1)) - (at(2) - at(-2))) / (12.0 * h);
      EXPECT_LT((difference - exact.col(j)).cwiseAbs().maxCoeff(), 2e-10);
    }
  }
}

// H/L and μ alone make the solution; lengths and gravity scale it.
TEST(Coulomb, LengthsAndGravityScaleTheSolution) {
  const Scene scene{1.3, 2.1, 9.81, 0.4};
  const Solution s = solved(scene, 1e-11);
  for (const auto& [length, gravity] : {std::pair{1e-5, 1.0}, {3e4, 1.0}, {1.0, 1e-4}, {1.0, 1e4}, {1e3, 1e-3}}) {
    const Solution scaled = solved({scene.drop * length, scene.span * length, scene.gravity * gravity, scene.friction},
                                   1e-11);
    const double time = std::sqrt(length / gravity);
    EXPECT_NEAR(scaled.final_time() / (time * s.final_time()), 1.0, 1e-11);
    EXPECT_NEAR(scaled["lambda_x"].value * length / time / s["lambda_x"].value, 1.0, 1e-11);
    EXPECT_NEAR(scaled["lambda_y"].value * length / time / s["lambda_y"].value, 1.0, 1e-11);
    EXPECT_NEAR(scaled["alphaF"].value, s["alphaF"].value, 1e-11);
  }
}

// Without friction the same equations give the cycloid, which has a closed form of its own.
TEST(Coulomb, WithoutFrictionTheArcIsTheCycloid) {
  for (const double drop : {1e-3, 0.5, 7.0}) {
    const Solution s = solve(coulomb::make_problem({drop, 1.0, 9.81, 0.0}), Eigen::Vector2d::Zero(),
                             {.accuracy = 1e-11, .max_step = 100.0});
    ASSERT_TRUE(s.solved()) << s.message;
    const Cycloid c = cycloid(1.0, -drop, 0.0, 9.81).value();
    EXPECT_NEAR(s.final_time() / c.final_time, 1.0, 1e-11);
    EXPECT_NEAR(s["lambda_y"].value / -c.lambda_y, 1.0, 1e-11);
    EXPECT_NEAR(s["alphaF"].value, -c.theta2(), 1e-11);
  }
}

TEST(Coulomb, FollowingTheFrictionFromTheCycloidLeadsToTheSameSolution) {
  Scene scene{5.0, 4.0, 9.81, 0.0};
  Shooting shooting(coulomb::make_problem(scene));
  const Solution start = solve(shooting, Eigen::Vector2d::Zero(), {.accuracy = 1e-8, .max_step = 100.0});
  ASSERT_TRUE(start.solved()) << start.message;
  scene.friction = 1.2;
  const Followed path = follow(shooting, start.y, coulomb::parameters(scene));
  ASSERT_TRUE(path.reached) << path.message;
  EXPECT_LT((path.y - solved(scene, 1e-10).y).norm(), 1e-6) << "follow() solves to 1e-7";
}

// What verifies a root would see one whose costates do not belong to its motion.
TEST(Coulomb, PathChecksSeeAWrongExtremal) {
  const Solution s = solved({5.0, 4.0, 9.81, 1.0}, 1e-10);
  ArcPoint point = s.point(0.6 * s.final_time());
  const auto hamiltonian = [&](const ArcRecord& record) {
    point.record = &record;
    return std::abs(s.problem->check(point, s.parameters).front().value);
  };
  const ArcRecord right = s.arcs.front().record;
  EXPECT_LT(hamiltonian(right), 1e-14);
  int noticed = 0;
  for (std::size_t i = 0; i < right.constants.size(); ++i) {
    ArcRecord wrong = right;
    wrong.constants[i] *= 1.0 + 1e-6;
    if (hamiltonian(wrong) > 1e-8) ++noticed;
  }
  EXPECT_EQ(noticed, 5) << "amplitude, r, the end angle and both costates; the units of x and of the work enter no H";
}

TEST(Coulomb, ProblemRefusesWhatIsNotAdmissible) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const Scene& bad :
       {Scene{1.0, 0.0, 9.81, 0.1}, Scene{1.0, 1.0, 0.0, 0.1}, Scene{1.0, 1.0, 9.81, 1.0}, Scene{1.0, 1.0, 9.81, -0.1},
        Scene{nan, 1.0, 9.81, 0.1}, Scene{1.0, nan, 9.81, 0.1}, Scene{1.0, 1.0, 9.81, nan}}) {
    EXPECT_THROW((void)coulomb::make_problem(bad), BadInput);
  }
}

}  // namespace
}  // namespace costate::test
