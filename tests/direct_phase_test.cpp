// The parts of the direct phase: derivatives, Riccati's recursion, the order of the discretisation, its multipliers.
#include "direct_phase.hpp"
#include "direct_problems.hpp"
#include "linear_quadratic.hpp"

#include <Eigen/LU>
#include <gtest/gtest.h>

namespace costate {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double rounding = 1e-12;

// F = (q₀² u, p sin(q₁)), weighted by (2, 3).
TEST(SmoothMap, GivesFirstAndSecondDerivatives) {
  const auto map = smooth_map<2, 1, 1, 2>([](const auto& q, const auto& u, const auto& p) {
    using S = typename std::decay_t<decltype(u)>::value_type;
    return Vec<S, 2>{q[0] * q[0] * u[0], p[0] * sin(q[1])};
  });
  const VectorXd z{{1.5, 0.4, -2.0}}, p{{0.7}}, weights{{2.0, 3.0}};
  const SmoothMap::Expansion at = map->expand(z, p, weights);
  EXPECT_EQ(map->value(z, p), at.value);
  const MatrixXd jacobian{{2.0 * 1.5 * -2.0, 0.0, 1.5 * 1.5}, {0.0, 0.7 * std::cos(0.4), 0.0}};
  const MatrixXd hessian{{2.0 * 2.0 * -2.0, 0.0, 2.0 * 2.0 * 1.5}, {0.0, -3.0 * 0.7 * std::sin(0.4), 0.0}, {6.0, 0.0, 0.0}};
  EXPECT_LT((at.jacobian - jacobian).norm(), rounding);
  EXPECT_LT((at.hessian - hessian).norm(), rounding);
}

/// Matrices without structure, the same every time.
MatrixXd sample(Index rows, Index columns, double seed) {
  MatrixXd m(rows, columns);
  for (Index i = 0; i < m.size(); ++i) m.data()[i] = std::sin(seed + 1.7 * static_cast<double>(i * i + 1));
  return m;
}
MatrixXd positive(Index size, double seed) {
  const MatrixXd m = sample(size, size, seed);
  return m * m.transpose() + MatrixXd::Identity(size, size);
}

LinearQuadratic two_stages() {
  LinearQuadratic problem;
  for (const double seed : {1.0, 2.0}) {
    problem.stages.push_back({sample(3, 3, seed), sample(3, 2, seed + 0.1), sample(3, 1, seed + 0.2),
                              4.0 * positive(3, seed + 0.3), 0.1 * sample(2, 3, seed + 0.4), positive(2, seed + 0.5),
                              sample(3, 1, seed + 0.6), sample(2, 1, seed + 0.7)});
  }
  problem.end_hessian = positive(3, 3.0);
  problem.end_gradient = sample(3, 1, 4.0);
  problem.freedom = sample(3, 1, 5.0);
  return problem;
}

// The same minimum by elimination of the states: a dense quadratic in (ξ, u₀, u₁).
TEST(LinearQuadratic, AgreesWithADenseSolution) {
  const LinearQuadratic problem = two_stages();
  LinearQuadraticSolution solution;
  ASSERT_TRUE(solve(problem, solution));
  // x = X y + x₀ with y = (ξ, u₀, u₁).
  MatrixXd x = MatrixXd::Zero(3, 5), hessian = MatrixXd::Zero(5, 5);
  VectorXd offset = VectorXd::Zero(3), gradient = VectorXd::Zero(5);
  x.col(0) = problem.freedom;
  for (Index i = 0; i < 2; ++i) {
    const auto& s = problem.stages[static_cast<std::size_t>(i)];
    MatrixXd u = MatrixXd::Zero(2, 5);
    u.middleCols(1 + 2 * i, 2).setIdentity();
    hessian += x.transpose() * s.q * x + u.transpose() * s.s * x + x.transpose() * s.s.transpose() * u +
               u.transpose() * s.r * u;
    gradient += x.transpose() * (s.q * offset + s.gradient_x) + u.transpose() * (s.s * offset + s.gradient_u);
    x = s.a * x + s.b * u;
    offset = s.a * offset + s.offset;
  }
  hessian += x.transpose() * problem.end_hessian * x;
  gradient += x.transpose() * (problem.end_hessian * offset + problem.end_gradient);
  const VectorXd y = -hessian.fullPivLu().solve(gradient);
  const double tolerance = 1e-10 * y.norm();  // conditions of some hundred
  EXPECT_LT((solution.x[0] - problem.freedom * y[0]).norm(), tolerance);
  EXPECT_LT((solution.u[0] - y.segment(1, 2)).norm(), tolerance);
  EXPECT_LT((solution.u[1] - y.segment(3, 2)).norm(), tolerance);
  EXPECT_LT((solution.x[2] - x * y - offset).norm(), tolerance);
  EXPECT_LT((solution.slope[2] - problem.end_hessian * solution.x[2] - problem.end_gradient).norm(), tolerance);
}

TEST(LinearQuadratic, SeesThatThereIsNoMinimum) {
  LinearQuadratic control = two_stages(), start = two_stages();
  control.stages[1].r -= 1e3 * MatrixXd::Identity(2, 2);
  start.stages[0].q -= 1e3 * MatrixXd::Identity(3, 3);
  LinearQuadraticSolution solution;
  EXPECT_FALSE(solve(control, solution));
  EXPECT_FALSE(solve(start, solution));
}

ExtremalStatement energy() {
  ExtremalStatement s;
  s.states = {{"x", {.start = 0.0, .end = 1.0}}, {"v", {.start = 0.0, .end = 0.0}}};
  s.controls = {{"u", {}}};
  s.time = 1.0;
  s.system = smooth_map<2, 1, 0, 3>([](const auto& q, const auto& u, const auto&) {
    using S = typename std::decay_t<decltype(u)>::value_type;
    return Vec<S, 3>{q[1], u[0], 0.5 * u[0] * u[0]};
  });
  return s;
}
DirectData data_of(const ExtremalStatement& s) {
  DirectData data{.parameters = VectorXd(0), .lower = {}, .upper = {}, .start = {}, .end = {}, .time = s.time};
  for (const auto& [name, state] : s.states) {
    data.start.push_back(state.start);
    data.end.push_back(state.end);
  }
  for (const auto& [name, control] : s.controls) {
    data.lower.push_back(control.lower);
    data.upper.push_back(control.upper);
  }
  return data;
}
DirectSolution solved(const ExtremalStatement& s, int steps) {
  auto solution = direct_solution(s, data_of(s), VectorXd::Zero(1), DirectBegin::straight, {.steps = steps});
  if (!solution) throw std::runtime_error("no direct solution");
  return *solution;
}

// J = 6, λ(0) = (12, 6), u(0) = 6.
TEST(DirectPhase, IsOfSecondOrder) {
  const DirectSolution coarse = solved(energy(), 20), fine = solved(energy(), 40);
  EXPECT_NEAR((coarse.cost - 6.0) / (fine.cost - 6.0), 4.0, 0.1);
  const Eigen::Vector2d costate(12.0, 6.0);
  EXPECT_NEAR((coarse.start_costate - costate).norm() / (fine.start_costate - costate).norm(), 4.0, 0.1);
  EXPECT_NEAR(fine.cost, 6.0, 0.01 * 6.0);
}

// H_u = λ_v − u = 0 at the middle of every step, to the tolerance of the last barrier, 10 μ per unit of T.
TEST(DirectPhase, DiscretisesTheMaximumPrinciple) {
  const DirectSolution s = solved(energy(), 40);
  EXPECT_LT((s.control.row(0) - s.costate.row(1)).cwiseAbs().maxCoeff(), 1e-5 * s.costate.norm());
}

// x ≤ 1/9 with the ends of Bryson & Denham: J = 4, and the multipliers add up to the jump of λ_x, 36.
TEST(DirectPhase, HasTheMultipliersOfAStateConstraint) {
  ExtremalStatement s = energy();
  s.states = {{"x", {.start = 0.0, .end = 0.0}}, {"v", {.start = 1.0, .end = -1.0}}};
  const auto map = smooth_map<2, 1, 0, 1>([](const auto& q, const auto&, const auto&) {
    using S = typename std::decay_t<decltype(q)>::value_type;
    return Vec<S, 1>{q[0] - 1.0 / 9.0};
  });
  s.constraints = {{"height", nullptr, 2, map}};
  const DirectSolution found = solved(s, 80);
  EXPECT_NEAR(found.cost, 4.0, 0.01 * 4.0);
  EXPECT_NEAR(found.multiplier.sum(), 36.0, 0.01 * 36.0);
  EXPECT_LE(found.state.row(0).maxCoeff(), 1.0 / 9.0 + 1e-5);
  EXPECT_GE(found.multiplier.minCoeff(), 0.0);
}

}  // namespace
}  // namespace costate
