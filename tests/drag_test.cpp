/// The extremals of the bead with drag as quadratures, against the full state–costate flow; their shooting problem; focal
/// points.
#include "drag_check.hpp"

#include <costate/shooting/shooting.hpp>

#include <Eigen/LU>
#include <gtest/gtest.h>
#include <numbers>

namespace costate::drag {
namespace {

using Eigen::VectorXd;

/// Some orbit of each family that ends with λv = 0, in units with g = 1: its constants, where it starts, and its friction.
struct Case {
  const char* name;
  Family family;
  double first, second, start;
  Friction<double> friction;
};
void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }

const Case cases[]{{"turning_hard", Family::turning, 1.5, 1.2, -0.8, {0.3, -0.02}},
                   {"turning_soft", Family::turning, 1.5, 1.2, -0.8, {0.3, 0.004}},
                   {"turning_close_to_steady", Family::turning, 1.5, 7.0, -0.8, {0.3, -0.02}},
                   {"turning_beyond_the_end", Family::turning, 1.5, -0.5, -2.8, {0.3, -0.02}},
                   {"turning_before_the_start", Family::turning, 1.5, 1.2, 0.3, {0.3, -0.02}},
                   {"turning_without_friction", Family::turning, 1.5, 1.2, -0.8, {0.0, 0.0}},
                   {"passing_far", Family::passing, 1.5, 0.3, 2.4, {0.3, -0.02}},
                   {"passing_close", Family::passing, 1.5, 3.0, 2.4, {0.3, -0.02}},
                   {"passing_soft", Family::passing, 1.5, 1.0, 2.0, {0.3, 0.004}},
                   {"monotone_losing", Family::monotone, 1.0, 0.6, 2.4, {0.3, -0.02}},
                   {"monotone_gaining", Family::monotone, 2.0, -1.1, 1.0, {0.3, -0.02}},
                   {"monotone_thrust", Family::monotone, 5.0, 1.3, 0.5, {0.3, 0.06}}};

class EveryOrbit : public testing::TestWithParam<Case> {};

constexpr double tolerance = 1e-12;

/// What an orbit says of its path.
struct Path {
  double x, y, t;
  double v0, lambda_v0, v_f, lambda_vf, lambda_x, lambda_y;
};

template <template <class> class OrbitOf>
Path path_of(const OrbitArc<OrbitOf>& base, double start, const Eigen::Vector4d& p) {
  const Vec<double, 4> parameter{p[0], p[1], p[2], p[3]};
  const auto orbit = base.orbit(parameter);
  VectorXd sum = VectorXd::Zero(3);
  const auto leg = [&](double side, double from, double to) {
    const FieldOf<OrbitArc<OrbitOf>> field({side, base.map});
    Flow flow(field, {.tolerance = {tolerance, tolerance}});
    sum += flow.run(from, to, VectorXd(), p, {Eigen::MatrixXd(0, 0), Eigen::MatrixXd(4, 0)}).quadrature;
  };
  const double end = orbit.end_place(), middle = orbit.middle();
  leg(-1.0, orbit.variable(start, -1.0), middle);
  leg(1.0, middle, orbit.variable(end, 1.0));
  const auto a = orbit.at_place(start), b = orbit.at_place(end);
  return {sum[0], sum[1], sum[2], a.v, a.lambda_v, b.v, b.lambda_v, orbit.constants.lambda_x, orbit.constants.lambda_y};
}

Path path_of(const Case& c) {
  const Eigen::Vector4d p(c.first, c.second, c.friction.mu, c.friction.beta);
  switch (c.family) {
    case Family::turning: return path_of(OrbitArc<TurningOrbit>{}, c.start, p);
    case Family::passing: return path_of(OrbitArc<PassingOrbit>{}, c.start, p);
    case Family::monotone: break;
  }
  const MonotoneOrbit<double> plain(c.first, c.second, c.friction);
  return path_of(OrbitArc<MonotoneOrbit>{1.0, speed_map(plain.constants, c.start, c.first)}, c.start, p);
}

// z = (v, λv) of the model as Pontryagin's principle gives it, in time: it knows nothing of D, of η or of the end speed.
// Errors of about a hundred steps on either side, each of at most a few times the tolerance, grow like the distance from
// the steady motion: by less than 1e5 in the cases close to it (z = 4.6 and 3), by less than a hundred in the others.
TEST_P(EveryOrbit, IsTheFullFlow) {
  const Case& c = GetParam();
  const Path path = path_of(c);
  ASSERT_GT(path.t, 0.0);
  const FieldOf<Flight> field;
  Flow flow(field, {.tolerance = {tolerance, tolerance}});
  VectorXd p(5);
  p << path.lambda_x, path.lambda_y, c.friction.mu, c.friction.beta, 1.0;
  const FlowEnd& end = flow.run(0.0, path.t, Eigen::Vector2d(path.v0, path.lambda_v0), p,
                                {Eigen::MatrixXd(2, 0), Eigen::MatrixXd(5, 0)});
  const bool close = std::string(c.name).find("close") != std::string::npos;
  const double bound = (close ? 1e5 : 100.0) * 100 * tolerance;
  EXPECT_NEAR(end.quadrature[0], path.x, bound);
  EXPECT_NEAR(end.quadrature[1], path.y, bound);
  EXPECT_NEAR(end.state[0], path.v_f, bound);
  EXPECT_NEAR(end.state[1], 0.0, bound);
  EXPECT_NEAR(path.lambda_vf, 0.0, 1e-14);
  EXPECT_NEAR(path.v_f * std::hypot(path.lambda_x, path.lambda_y), 1.0, 1e-14) << "H = 0 at the end";
  EXPECT_NEAR(Flight().hamiltonian({path.v0, path.lambda_v0},
                                   {path.lambda_x, path.lambda_y, c.friction.mu, c.friction.beta, 1.0}),
              0.0, 1e-13);
}

/// The scene whose extremal the orbit is, with g = 1 in SI units, and its guess.
std::pair<Scene, Guess> scene_of(const Case& c) {
  const Path path = path_of(c);
  const Scene scene{path.x, path.y, path.v0, c.friction.mu, c.friction.beta, 1.0};
  const std::vector<double> p = parameters(scene);
  const Scaled<double> unit([&](std::size_t i) { return p[i]; });
  Guess guess{c.family, c.first, c.second, path.t / unit.time};
  switch (c.family) {
    case Family::turning:
      guess.first = c.start;
      guess.second = std::asinh(c.second);  // tan θ₂ where there is no friction: it has no unit
      break;
    case Family::passing:
    case Family::monotone: guess.first = c.first / unit.speed; break;
  }
  return {scene, guess};
}

TEST_P(EveryOrbit, SolvesTheProblemOfItsOwnScene) {
  const auto [scene, guess] = scene_of(GetParam());
  Shooting shooting(make_problem(scene, guess));
  shooting.set_flow_options({.tolerance = {1e-12, 1e-12}});
  // Some hundred steps of an integration at 1e-12, here and in the orbit's own.
  EXPECT_LE(shooting.residual(shooting.evaluate(unknowns(guess))).cwiseAbs().maxCoeff(), 1e-9);
}

TEST_P(EveryOrbit, JacobianAndParameterDerivativesAgreeWithDifferences) {
  const auto [scene, guess] = scene_of(GetParam());
  Shooting shooting(make_problem(scene, guess));
  shooting.set_flow_options({.tolerance = {1e-13, 1e-13}});
  const VectorXd y = unknowns(guess);
  const std::vector<double> p = parameters(scene);
  const Eigen::MatrixXd jacobian = shooting.jacobian(shooting.evaluate(y));
  // Central differences with h = 1e-5: truncation h² times third derivatives (up to some hundred), integration noise
  // 1e-12/h.
  constexpr double h = 1e-5, bound = 2e-6;
  const auto residual = [&](const VectorXd& at) { return shooting.residual(shooting.values(at)); };
  for (Eigen::Index j = 0; j < y.size(); ++j) {
    VectorXd up = y, down = y;
    const double step = h * std::max(1.0, std::abs(y[j]));
    up[j] += step;
    down[j] -= step;
    const VectorXd difference = (residual(up) - residual(down)) / (2.0 * step);
    EXPECT_LE((difference - jacobian.col(j)).cwiseAbs().maxCoeff(), bound * std::max(1.0, difference.cwiseAbs().maxCoeff()))
        << j;
  }
  for (std::size_t j = 0; j < p.size(); ++j) {
    std::vector<double> path(p.size(), 0.0), up = p, down = p;
    path[j] = 1.0;
    const VectorXd exact = shooting.path_derivative(shooting.evaluate(y, path));
    up[j] += h;
    down[j] -= h;
    shooting.set_parameters(up);
    const VectorXd above = residual(y);
    shooting.set_parameters(down);
    const VectorXd difference = (above - residual(y)) / (2.0 * h);
    shooting.set_parameters(p);
    EXPECT_LE((difference - exact).cwiseAbs().maxCoeff(), bound * std::max(1.0, difference.cwiseAbs().maxCoeff())) << j;
  }
}

INSTANTIATE_TEST_SUITE_P(Drag, EveryOrbit, testing::ValuesIn(cases),
                         [](const auto& test) { return std::string(test.param.name); });

TEST(FastestSlope, MaximisesTheHamiltonianWithTheSignOfLegendreAndClebsch) {
  const Bead bead;
  const Vec<double, 3> p{0.3, 0.004, 9.8};
  for (const Vec<double, 3>& costate :
       {Vec<double, 3>{0.2, 0.25, 0.15}, Vec<double, 3>{0.1, -0.3, 0.02}, Vec<double, 3>{0.2, 0.1, -0.1}}) {
    const Vec<double, 3> q{0.0, 0.0, 3.0};
    const auto best = FastestSlope().control(q, costate, p);
    const double maximum = hamiltonian(bead, q, costate, best, p);
    const auto at = [&](double slope) {
      return hamiltonian(bead, q, costate, Vec<double, 2>{std::cos(slope), std::sin(slope)}, p);
    };
    for (int i = 0; i < 360; ++i) EXPECT_LE(at(i * std::numbers::pi / 180), maximum + 1e-15);
    const double N = std::hypot(3.0 * costate[0], 3.0 * costate[1] - 9.8 * costate[2]);
    constexpr double h = 1e-4;  // truncation h²N/12, rounding 1e-16/h²
    const double slope = std::atan2(best[1], best[0]);
    const double second = (at(slope + h) - 2.0 * maximum + at(slope - h)) / (h * h);
    EXPECT_NEAR(second, -N, 1e-7);
  }
}

/// det ∂(x, y, v)/∂(v_f, θ_f, s) of the extremals that leave the end backward, by differences of independent integrations.
double family_determinant(const Scene& scene, double v_f, double theta_f, double s) {
  const test::DragEquations equations(scene);
  const auto back = [&](double v, double theta, double time) {
    const test::DragState end{0.0, 0.0, v, std::cos(theta) / v, std::sin(theta) / v, 0.0};
    const test::DragState start = test::runge_kutta(equations, time, 0.0, end, 1e-13);
    return Eigen::Vector3d(start[0], start[1], start[2]);
  };
  constexpr double h = 1e-5;
  Eigen::Matrix3d derivative;
  derivative.col(0) = (back(v_f * (1 + h), theta_f, s) - back(v_f * (1 - h), theta_f, s)) / (2 * h);
  derivative.col(1) = (back(v_f, theta_f + h, s) - back(v_f, theta_f - h, s)) / (2 * h);
  derivative.col(2) = (back(v_f, theta_f, s + h) - back(v_f, theta_f, s - h)) / (2 * h);
  return derivative.determinant();
}

// The extremals that dive have one focal point; the determinant of an independent integration in time changes its sign
// there, and nowhere else on the path. Where it is zero is known to the error of the differences, h² = 1e-10 times
// derivatives of order 1e3 to 1e4.
TEST(FocalTimes, AreThoseOfAnIndependentFamily) {
  for (const double speed : {2.0, 4.0, 6.0}) {
    Scene scene;
    scene.speed = speed;
    const tools::Outcome outcome = solve_scene(scene, {.accuracy = 1e-9});
    ASSERT_TRUE(outcome.solved());
    EXPECT_TRUE(focal_times(outcome.solution).empty());
    ASSERT_EQ(outcome.other_extremals.size(), 1U);
    const Solution& dive = outcome.other_extremals.front();
    const std::vector<double> focal = focal_times(dive);
    ASSERT_EQ(focal.size(), 1U);
    const double v_f = dive["v_f"].value, theta_f = dive["theta2"].value;
    const auto sign = [&](double s) { return family_determinant(scene, v_f, theta_f, s) > 0.0; };
    EXPECT_NE(sign(focal[0] - 1e-6), sign(focal[0] + 1e-6));
    for (int i = 1; i < 40; ++i) {
      const double s = dive.final_time() * i / 40;
      EXPECT_EQ(sign(s), s < focal[0] ? sign(focal[0] - 1e-6) : sign(focal[0] + 1e-6)) << s;
    }
    // The minimum's family has no such change.
    const double slow_v_f = outcome["v_f"].value, slow_theta_f = outcome["theta2"].value;
    const bool first = family_determinant(scene, slow_v_f, slow_theta_f, 0.05) > 0.0;
    for (int i = 2; i < 20; ++i) {
      EXPECT_EQ(family_determinant(scene, slow_v_f, slow_theta_f, outcome.solution.final_time() * i / 20) > 0.0, first);
    }
  }
}

}  // namespace
}  // namespace costate::drag
