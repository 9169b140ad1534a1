/// Curvature-coupled friction: against the references, the derived Pontryagin flow, differences, and its own scaling.
#include "curvature/curvature_scene.hpp"
#include "curvature/plan.hpp"
#include "curvature/reach.hpp"
#include "curvature/transcription.hpp"
#include "runge_kutta.hpp"

#include <costate/flow.hpp>
#include <costate/models/cycloid.hpp>

#include <fstream>
#include <gtest/gtest.h>
#include <map>
#include <nlohmann/json.hpp>
#include <ostream>
#include <random>

namespace costate::test {
namespace {

using curvature::Scene;
using tools::Outcome;

struct Case {
  std::string name;
  Scene scene;
  std::map<std::string, double> values;  ///< by the names of the problem's reports
  double rtol;
};
void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }

std::vector<Case> cases() {
  std::ifstream file(std::string(COSTATE_REFERENCE_DIR) + "/nonlinear_friction.json");
  const std::pair<const char*, const char*> fields[] = {{"T", "final_time"}, {"theta1", "theta1"}, {"theta2", "theta2"},
                                                        {"vf", "v_f"},       {"h0", "h0"},         {"lx", "lambda_x"},
                                                        {"ly", "lambda_y"},  {"lv0", "lambda_v0"}, {"lth0", "lambda_theta0"},
                                                        {"t1", "t1"}};
  std::vector<Case> all;
  const auto data = nlohmann::json::parse(file);
  for (const auto& entry : data.at("cases")) {
    if (entry.at("model") != "B") continue;
    const auto& p = entry.at("params");
    Case c{entry.at("id"), {}, {}, std::max(1e-9, entry.at("recommended_rtol").get<double>())};
    c.scene = {p.at("a"), p.at("b"), p.at("v0"), std::nullopt, p.at("mu"), p.at("beta"), p.at("g")};
    if (!p.at("theta0").is_null()) c.scene.slope = p.at("theta0").get<double>();
    for (const auto& [key, report] : fields) {
      if (entry.at("solution").contains(key)) c.values[report] = entry.at("solution").at(key);
    }
    all.push_back(std::move(c));
  }
  return all;
}

class Reference : public testing::TestWithParam<Case> {};

TEST_P(Reference, ReproducesInEveryUnknown) {
  const Case& expected = GetParam();
  const Outcome outcome = curvature::solve_scene(expected.scene, {.accuracy = 1e-9});
  ASSERT_TRUE(outcome.solved()) << outcome.message;
  const bool flies = expected.values.contains("t1");
  EXPECT_EQ(outcome.solution.problem->structure().size(), flies ? 2U : 1U);
  for (const auto& [name, value] : expected.values) {
    const Quantity& found = outcome[name];
    // A number that is 0, or nearly, has no relative error.
    EXPECT_NEAR(found.value, value, expected.rtol * std::max(1e-2, std::abs(value))) << name;
    EXPECT_LE(std::abs(found.value - value), found.error_bound + 1e-15 * std::abs(value)) << name << ": the claimed bound";
  }
  // Conditions of the formulation, which single shooting from the start has at 6e3 and more.
  EXPECT_LT(outcome.solution.certificate.condition, 2e4);
}

INSTANTIATE_TEST_SUITE_P(Curvature, Reference, testing::ValuesIn(cases()), [](const auto& info) { return info.param.name; });

TEST(Curvature, ThereAreEightReferenceCases) { EXPECT_EQ(cases().size(), 8U); }

// The reduced contact arc holds for any λ, H = 0 or not: its rates against those derived from the bead and H_u = 0.
TEST(Curvature, ContactArcIsThePontryaginFlow) {
  const curvature::ContactArc reduced;
  const Pontryagin<curvature::Bead, curvature::Contact> derived;
  for (const double eta : {0.05, 0.7, 2.0}) {
    for (const double theta : {-1.4, -0.3, 0.6}) {
      const double log_v = -0.4, v = std::exp(log_v), n = 0.8, mu = 0.3, beta = -0.07, lambda_x = 0.9, lambda_y = -0.35;
      const double slope = 3.0 * beta * eta * eta - mu;
      const auto r = reduced.rates<double>(0.0, {log_v, theta, eta, n}, {lambda_x, lambda_y, mu, beta});
      // g = 1: λv = n v, λθ = −n v² k'(η); dt = v η dω.
      const auto d = derived.rates<double>(0.0, {v, theta, n * v, -n * v * v * slope}, {lambda_x, lambda_y, mu, beta, 1.0});
      const double dt = v * eta;
      const double v_rate = v * r.state[0];
      const double turn_rate = -(r.state[3] * v * v * slope + 2.0 * n * v * v_rate * slope +
                                 n * v * v * 6.0 * beta * eta * r.state[2]);
      const double rounding = 1e-13 / eta;  // the square root of the law loses what η² is small by
      EXPECT_NEAR(v_rate / dt, d.state[0], rounding);
      EXPECT_NEAR(r.state[1] / dt, d.state[1], rounding);
      EXPECT_NEAR((r.state[3] * v + n * v_rate) / dt, d.state[2], rounding);
      EXPECT_NEAR(turn_rate / dt, d.state[3], 10 * rounding);
      EXPECT_NEAR(r.quadrature[0] / dt, d.quadrature[0], rounding);
      EXPECT_NEAR(r.quadrature[1] / dt, d.quadrature[1], rounding);
    }
  }
}

// The first arc of BF1 is a parabola with costates linear in time; the derived flow with its multiplier ends where it ends.
TEST(Curvature, BallisticArcIsThePontryaginFlow) {
  const Scene scene{4.0, -2.5, 2.0, std::nullopt, 0.2, -1e-3, 9.8};
  const Outcome outcome = curvature::solve_scene(scene, {.accuracy = 1e-10});
  ASSERT_TRUE(outcome.solved()) << outcome.message;
  const Solution& solution = outcome.solution;
  const double t1 = solution["t1"].value;
  const auto start = solution.at(0.0), end = solution.at(0.999 * t1);
  const FieldOf<Pontryagin<curvature::Bead, curvature::Ballistic>> field;
  Flow flow(field, {.tolerance = {1e-12, 1e-12}});
  Eigen::VectorXd p(5);
  p << start[6], start[7], scene.mu, scene.beta, scene.gravity;
  const FlowEnd& derived = flow.run(0.0, 0.999 * t1, Eigen::Vector4d(start[2], start[3], start[8], start[9]), p,
                                    {Eigen::MatrixXd(4, 0), Eigen::MatrixXd(5, 0)});
  const double bound = 1e-9;  // ten times the accuracy asked for
  EXPECT_NEAR(derived.state[0], end[2], bound);
  EXPECT_NEAR(derived.state[1], end[3], bound);
  EXPECT_NEAR(derived.state[2], end[8], bound);
  EXPECT_NEAR(derived.state[3], end[9], bound);
  EXPECT_NEAR(derived.quadrature[0], end[0], bound);
  EXPECT_NEAR(derived.quadrature[1], end[1], bound);
}

TEST(Curvature, JacobianAgreesWithDifferences) {
  Scene scene;
  for (const double slope : {-1.0, -0.75}) {  // one contact arc; a flight before it
    scene.slope = slope;
    const Outcome outcome = curvature::solve_scene(scene, {.accuracy = 1e-9});
    ASSERT_TRUE(outcome.solved()) << outcome.message;
    Shooting shooting(outcome.solution.problem);
    shooting.set_flow_options({.tolerance = {1e-13, 1e-13}});
    const Eigen::VectorXd y = outcome.solution.y;
    const Eigen::MatrixXd exact = shooting.jacobian(shooting.evaluate(y));
    constexpr double h = 1e-5;
    for (Eigen::Index j = 0; j < y.size(); ++j) {
      Eigen::VectorXd above, below;
      shooting.residual(y + h * Eigen::VectorXd::Unit(y.size(), j), above);
      shooting.residual(y - h * Eigen::VectorXd::Unit(y.size(), j), below);
      const Eigen::VectorXd difference = (above - below) / (2.0 * h);
      // h²/6 times third derivatives (up to 1e3 times the first), and the integrations' 1e-12 over h.
      const double tolerance = (1e3 * h * h + 1e-7) * std::max(1.0, exact.col(j).cwiseAbs().maxCoeff());
      EXPECT_LT((difference - exact.col(j)).cwiseAbs().maxCoeff(), tolerance)
          << shooting.problem().unknowns()[static_cast<std::size_t>(j)].name;
    }
  }
}

// v → cv, lengths → c² lengths, times → c times; and with g → γg, h → γh: β → β/γ², lengths → lengths/γ.
TEST(Curvature, InvariantUnderScaling) {
  const Scene plain;
  const Outcome one = curvature::solve_scene(plain, {.accuracy = 1e-10});
  ASSERT_TRUE(one.solved()) << one.message;
  for (const double c : {1e-2, 3.0}) {
    for (const double gamma : {0.165, 30.0}) {
      const double length = c * c / gamma, time = c / gamma;
      const Scene scene{plain.x * length,     plain.y * length, plain.speed * c,
                        plain.slope,          plain.mu,         plain.beta / (gamma * gamma),
                        plain.gravity * gamma};
      const Outcome outcome = curvature::solve_scene(scene, {.accuracy = 1e-10});
      ASSERT_TRUE(outcome.solved()) << outcome.message;
      EXPECT_NEAR(outcome["final_time"].value / time, one["final_time"].value, 1e-8);
      EXPECT_NEAR(outcome["lambda_x"].value * c, one["lambda_x"].value, 1e-8);
      EXPECT_NEAR(outcome["h0"].value / gamma, one["h0"].value, 1e-7);
    }
  }
}

// λ is the gradient of the time: ∂T/∂a = λx, ∂T/∂b = λy, ∂T/∂v₀ = −λv(0), ∂T/∂θ₀ = −λθ(0).
TEST(Curvature, CostatesAreTheGradientOfTheTime) {
  const auto time = [](double a, double b, double v, double theta) {
    const Outcome outcome = curvature::solve_scene({a, b, v, theta, 0.2, -1e-3, 9.8}, {.accuracy = 1e-10});
    EXPECT_TRUE(outcome.solved()) << outcome.message;
    return outcome.solved() ? outcome["final_time"].value : 0.0;
  };
  const Outcome at = curvature::solve_scene({}, {.accuracy = 1e-10});
  ASSERT_TRUE(at.solved());
  constexpr double h = 1e-4;
  const double tolerance = 1e-6;  // h² and 1e-10/h
  EXPECT_NEAR((time(4 + h, -2.5, 2, -1) - time(4 - h, -2.5, 2, -1)) / (2 * h), at["lambda_x"].value, tolerance);
  EXPECT_NEAR((time(4, -2.5 + h, 2, -1) - time(4, -2.5 - h, 2, -1)) / (2 * h), at["lambda_y"].value, tolerance);
  EXPECT_NEAR((time(4, -2.5, 2 + h, -1) - time(4, -2.5, 2 - h, -1)) / (2 * h), -at["lambda_v0"].value, tolerance);
  EXPECT_NEAR((time(4, -2.5, 2, -1 + h) - time(4, -2.5, 2, -1 - h)) / (2 * h), -at["lambda_theta0"].value, tolerance);
}

TEST(Curvature, WithoutAMinimumOrOutOfReachIsInfeasible) {
  for (const double beta : {0.0, 1e-3}) {
    Scene scene;
    scene.beta = beta;
    const Outcome outcome = curvature::solve_scene(scene, {});
    EXPECT_EQ(outcome.status, Outcome::Status::infeasible);
    EXPECT_NE(outcome.message.find("Legendre-Clebsch"), std::string::npos) << outcome.message;
  }
  Scene high;
  high.y = 0.0;
  const Outcome outcome = curvature::solve_scene(high, {});
  EXPECT_EQ(outcome.status, Outcome::Status::infeasible);
  ASSERT_EQ(outcome.limits.size(), 1U);
  EXPECT_EQ(outcome.limits[0].name, "y_max");
  EXPECT_LT(outcome.limits[0].value.value(), 0.0);
}

TEST(Curvature, WithoutFrictionAndWithAFreeSlopeItIsTheCycloid) {
  const Outcome outcome = curvature::solve_scene({6.0, -1.0, 2.0, std::nullopt, 0.0, 0.0, 9.8}, {});
  ASSERT_TRUE(outcome.solved());
  ASSERT_TRUE(outcome.closed_form);
  EXPECT_NEAR(outcome["final_time"].value, 1.3195056806149265, 1e-14);
}

// Friction costs time: as μ and |β| fall the time falls, toward the cycloid's from above.
TEST(Curvature, LessFrictionIsFasterAndNeverBeatsTheCycloid) {
  const double least = cycloid(4.0, -2.5, 2.0, 9.8)->final_time;
  double before = std::numeric_limits<double>::infinity();
  for (const double scale : {1.0, 0.3, 0.1, 0.03}) {
    const Outcome outcome = curvature::solve_scene({4.0, -2.5, 2.0, std::nullopt, 0.2 * scale, -1e-3 * scale, 9.8}, {});
    ASSERT_TRUE(outcome.solved()) << outcome.message;
    EXPECT_LT(outcome["final_time"].value, before);
    EXPECT_GT(outcome["final_time"].value, least);
    before = outcome["final_time"].value;
  }
}

// The bound on the reach against the highest motions the transcription finds: never below them, and close for slow beads.
TEST(Curvature, NoMotionIsAboveTheBoundOnTheReach) {
  for (const double x : {1.0, 5.0, 20.0}) {
    for (const double mu : {0.1, 0.4}) {
      const curvature::ScaledScene scene{x, -x, -0.5, mu, -0.05};
      const double bound = curvature::reach_bound(scene);
      double highest = -std::numeric_limits<double>::infinity();
      for (const curvature::ControlGuess& guess : curvature::high_controls(scene)) {
        highest = std::max(highest, -guess.miss);
      }
      EXPECT_LT(highest, bound) << x << ' ' << mu;
      EXPECT_GT(highest, bound - 0.5 * x) << x << ' ' << mu;
    }
  }
}

// Below the free flight: the time of a slower bead, as if braked at once, comes down to the infimum as its speed comes up to that
// which flies to the end point.
TEST(Curvature, BrakingAtOnceApproachesTheInfimum) {
  const Scene scene{4.0, -6.0, 8.0, -0.5, 0.2, -1e-3, 9.8};
  const Outcome refused = curvature::solve_scene(scene, {});
  ASSERT_EQ(refused.status, Outcome::Status::infeasible) << refused.message;
  const double infimum = refused.limits.back().value.value();
  ASSERT_EQ(refused.limits.back().name, "time_infimum");
  const double flying = scene.x / (infimum * std::cos(*scene.slope));
  ASSERT_LT(flying, scene.speed);
  double excess = std::numeric_limits<double>::infinity();
  for (const double below : {0.1, 0.03, 0.01, 0.003}) {
    Scene braked = scene;
    braked.speed = (1.0 - below) * flying;
    const Outcome outcome = curvature::solve_scene(braked, {});
    ASSERT_TRUE(outcome.solved()) << outcome.message;
    const double now = outcome["final_time"].value - infimum;
    EXPECT_GT(now, 0.0) << below;
    EXPECT_LT(now, 0.5 * excess) << below;
    excess = now;
  }
  EXPECT_LT(excess, 0.01 * infimum);
}

// No motion beats the infimum: whatever the normal force, b + g t²/2 ≥ a tan θ₀ at every point on the way while |θ| ≤ π/2.
TEST(Curvature, NoMotionGetsBelowTheFreeFlight) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  const double g = 9.8;
  int far = 0;
  for (int i = 0; i < 300; ++i) {
    const double mu = uniform(random), beta = -1e-4 * std::pow(100.0, uniform(random));
    const double slope = -1.5 + (1.5 + std::atan(mu)) * uniform(random);
    std::array<double, 4> q{0.0, 0.0, 0.5 + 10.0 * uniform(random), slope};  // x, y, v, θ
    double t = 0.0, h = 0.0;
    for (int piece = 0; piece < 200; ++piece) {
      if (piece % 10 == 0) h = uniform(random) < 0.4 ? 0.0 : 25.0 * uniform(random);
      const double K = -mu * h + beta * h * h * h;
      const double span = std::min(0.01, 0.05 * q[2] / (g - K));  // the speed changes by a twentieth at most
      q = runge_kutta<4>([&](double, const std::array<double, 4>& z) {
        return std::array{z[2] * std::cos(z[3]), z[2] * std::sin(z[3]), -g * std::sin(z[3]) + K, (h - g * std::cos(z[3])) / z[2]};
      }, t, t + span, q, 1e-10);
      t += span;
      if (!(std::abs(q[3]) <= std::numbers::pi / 2 && q[2] > 0.1)) break;
      EXPECT_GE(q[1] + 0.5 * g * t * t, q[0] * std::tan(slope) - 1e-8) << i << ", piece " << piece;
      ++far;
    }
  }
  EXPECT_GT(far, 5000);
}

}  // namespace
}  // namespace costate::test
