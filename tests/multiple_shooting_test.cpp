/// Multiple shooting: cuts change nothing but how well a problem is conditioned, and are made where an arc grows.
#include "closed_flows.hpp"
#include "small_problems.hpp"

#include <costate/error.hpp>
#include <costate/shooting/solve.hpp>

#include <Eigen/LU>
#include <cmath>
#include <gtest/gtest.h>

namespace costate {
namespace {

using closed::vector;
using Eigen::VectorXd;
using small::thrown;

void expect_named(const std::string& text, std::initializer_list<const char*> parts) {
  for (const char* part : parts) EXPECT_TRUE(small::contains(text, part)) << part << " is missing in: " << text;
}

/// y'' = k² y, y(0) = 1, y(1) = e^(−k): y = e^(−kx). The other mode grows like e^(kx).
struct Layer {
  static constexpr int states = 2, parameters = 1, quadratures = 1;
  template <class S>
  Rates<S, 2, 1> rates(const S&, const Vec<S, 2>& y, const Vec<S, 1>& k) const {
    return {{y[1], k[0] * k[0] * y[0]}, {y[0]}};
  }
};
/// y'' = μ sinh(μy), y(0) = 0, y(1) = 1.
struct Troesch {
  static constexpr int states = 2, parameters = 1, quadratures = 1;
  template <class S>
  Rates<S, 2, 1> rates(const S&, const Vec<S, 2>& y, const Vec<S, 1>& mu) const {
    return {{y[1], mu[0] * sinh(mu[0] * y[0])}, {y[0]}};
  }
};
/// x' = −x³ + λ, λ' = x + 3x²λ: least ∫ (x² + u²)/2 dt with u = λ, x(0) = 1, x(T) = 3/2.
struct Hypersensitive {
  static constexpr int states = 2, parameters = 1, quadratures = 1;
  template <class S>
  Rates<S, 2, 1> rates(const S&, const Vec<S, 2>& z, const Vec<S, 1>&) const {
    const auto& [x, lambda] = z;
    return {{lambda - x * x * x, x + 3.0 * x * x * lambda}, {0.5 * (x * x + lambda * lambda)}};
  }
};

/// One arc from the first state `start` to `end` after a time `length`, the second state unknown at the start, where it is named
/// "slope". Guessed is a straight line with no slope.
template <class F>
class Line final : public Problem {
 public:
  Line(double start, double end, double length, double parameter) : start_(start), end_(end), length_(length) {
    unknowns_ = {{"slope"}};
    rows_ = {{"end"}};
    parameters_ = {{"parameter", "1", parameter}};
    structure_ = {"arc"};
  }
  void shoot(Shot& shot) const override {
    const ArcEnd end = shot.arc({.field = &field_,
                                 .t0 = 0.0,
                                 .t1 = length_,
                                 .state = {start_, shot.unknown(0)},
                                 .quadrature = {0.0},
                                 .parameter = {shot.parameter(0)}});
    shot.row(0, end.state[0] - end_);
    shot.report("integral", "1", end.quadrature[0]);
    shot.report("end slope", "1", end.state[1]);
    shot.report("final_time", "1", length_);
  }
  [[nodiscard]] std::optional<VectorXd> state_guess(int, double fraction) const override {
    return vector({std::lerp(start_, end_, fraction), 0.0});
  }
  [[nodiscard]] std::vector<Column> columns() const override { return {{"y", "1"}}; }
  [[nodiscard]] std::vector<double> observe(const ArcPoint& point, const std::vector<double>&) const override {
    return {point.state[0]};
  }
  [[nodiscard]] std::vector<PathCheck> check(const ArcPoint&, const std::vector<double>&) const override { return {}; }

 private:
  FieldOf<F> field_;
  double start_, end_, length_;
};

std::shared_ptr<const Problem> layer(double k) { return std::make_shared<Line<Layer>>(1.0, std::exp(-k), 1.0, k); }
std::shared_ptr<const Problem> troesch(double mu) { return std::make_shared<Line<Troesch>>(0.0, 1.0, 1.0, mu); }
std::shared_ptr<const Problem> hypersensitive(double T) { return std::make_shared<Line<Hypersensitive>>(1.0, 1.5, T, 0.0); }

/// A result is within its own error bound of a value, and the bound within the accuracy.
void expect_known(const Solution& solution, const std::string& name, double value, double accuracy) {
  const Quantity& quantity = solution[name];
  EXPECT_LE(std::abs(quantity.value - value), quantity.error_bound + 1e-15 * std::abs(value)) << name;
  EXPECT_LE(quantity.error_bound, accuracy * std::max(1.0, std::abs(value))) << name;
}

// With the nodes on the solution the whole system has the solution of the uncut one, and eliminating the nodes from its Jacobian
// leaves the uncut Jacobian: what an arc does to its start does not depend on where it is cut.
TEST(MultipleShooting, CutsChangeNothing) {
  Shooting whole(layer(3.0)), cut(layer(3.0));
  for (Shooting* s : {&whole, &cut}) s->set_flow_options({.tolerance = {1e-12, 1e-12}});
  const double k = 3.0, slope = -k;
  Mesh mesh{.cuts = {{0.25, 0.7}}, .sizes = {3, 3}, .nodes = VectorXd(6)};
  for (int i = 0; i < 2; ++i) {
    const double t = mesh.cuts[0][static_cast<std::size_t>(i)];
    mesh.nodes.segment(3 * i, 3) << std::exp(-k * t), -k * std::exp(-k * t), (1.0 - std::exp(-k * t)) / k;
  }
  cut.set_mesh(mesh);
  ASSERT_EQ(cut.size(), 7);
  VectorXd y(7);
  y << slope, mesh.nodes;
  const Shot& shot = cut.evaluate(y);
  EXPECT_LE(cut.residual(shot).cwiseAbs().maxCoeff(), 1e-10);
  EXPECT_NEAR(shot.reports()[0].value.value, (1.0 - std::exp(-k)) / k, 1e-10);
  const Eigen::MatrixXd J = cut.jacobian(shot);
  const Eigen::MatrixXd schur = J.topLeftCorner(1, 1) -
                                J.topRightCorner(1, 6) * J.bottomRightCorner(6, 6).lu().solve(J.bottomLeftCorner(6, 1));
  EXPECT_NEAR(schur(0, 0), std::sinh(k) / k, 1e-9);
  EXPECT_NEAR(whole.jacobian(whole.evaluate(vector({slope})))(0, 0), schur(0, 0), 1e-9);
  EXPECT_EQ(cut.row_name(0), "end");
  EXPECT_EQ(cut.row_name(4), "continuity of component 1 at 0.7 of arc 1");
  EXPECT_EQ(cut.unknown_name(3), "component 3 at 0.25 of arc 1");
}

// e^k is beyond what double precision can carry through one arc: for k = 200 it is 10⁸⁶.
TEST(MultipleShooting, LayersOfAnyStrength) {
  for (const double k : {1.0, 10.0, 50.0, 200.0}) {
    const Solution s = solve(layer(k), {.accuracy = 1e-9});
    ASSERT_TRUE(s.solved()) << k << ": " << s.message;
    expect_known(s, "slope", -k, 1e-9);
    expect_known(s, "integral", (1.0 - std::exp(-k)) / k, 1e-9);
    EXPECT_EQ(s.nodes > 0, k > std::log(1e3)) << "an arc that does not grow is not cut";
    // Over a length l the state grows by e^(kl) and the slope by k/2 times that, a thousandfold at most; the nodes are chosen among those of a
    // finer mesh, whose segments may be half as long as those.
    EXPECT_LE(s.nodes, 2.0 * k / std::log(2e3 / k) + 1.0);
  }
}

// The first integral decides: the slope s = y'(0) fulfils 1 = ∫₀¹ dy/√(s² + 2cosh(μy) − 2), and y'(1)² = s² + 2cosh μ − 2.
TEST(MultipleShooting, TroeschWhereSingleShootingFails) {
  const double mu = 10.0;
  const Solution single = solve(troesch(mu), {.accuracy = 1e-8, .multiple = false});
  EXPECT_FALSE(single.solved());
  const Solution s = solve(troesch(mu), {.accuracy = 1e-8});
  ASSERT_TRUE(s.solved()) << s.message;
  EXPECT_GT(s.nodes, 0);
  const double slope = s["slope"].value;
  // y = (s/μ) sinh w spreads the layer over the range of w.
  const double end = std::asinh(mu / slope);
  const int n = 20000;
  double sum = 0.0;
  for (int i = 0; i < n; ++i) {
    const double w = end * (i + 0.5) / n;
    const double y = slope / mu * std::sinh(w), rest = std::sinh(0.5 * mu * y);
    sum += slope / mu * std::cosh(w) / std::sqrt(slope * slope + 4.0 * rest * rest) * end / n;
  }
  // The midpoint rule leaves O(n⁻²) = 1e-8 of the length; the slope moves it by ds/(μ s) or so.
  EXPECT_NEAR(sum, 1.0, 1e-8);
  expect_known(s, "end slope", std::sqrt(slope * slope + 4.0 * std::pow(std::sinh(0.5 * mu), 2)), 1e-8);
}

// For T = 50 the middle is at rest to all digits: the ends are those of T = ∞, on the manifolds of the saddle at 0, where H = 0:
// λ = x³ − √(x⁶ + x²) leaving x(0) = 1, λ = x³ + √(x⁶ + x²) arriving at 3/2.
TEST(MultipleShooting, HypersensitiveFromTheDefaultStart) {
  const Solution single = solve(hypersensitive(50.0), {.accuracy = 1e-8, .multiple = false});
  EXPECT_FALSE(single.solved());
  const Solution s = solve(hypersensitive(50.0), {.accuracy = 1e-9});
  ASSERT_TRUE(s.solved()) << s.message;
  const auto manifold = [](double x, double sign) { return x * x * x + sign * std::sqrt(std::pow(x, 6) + x * x); };
  expect_known(s, "slope", manifold(1.0, -1.0), 1e-9);
  expect_known(s, "end slope", manifold(1.5, 1.0), 1e-9);
  // J = ∫ (x² + λ²)/2 dt = ∫ λ dx along both manifolds, as H = λ² /2 − λx³ − x²/2 = 0; ∫ x√(x⁴ + 1) dx is elementary.
  const auto potential = [](double x) {
    const double q = x * x;
    return 0.25 * (q * std::sqrt(q * q + 1.0) + std::asinh(q));
  };
  const double J = (std::pow(1.5, 4) / 4.0 + potential(1.5)) + (-0.25 + potential(1.0));
  expect_known(s, "integral", J, 1e-9);
}

TEST(MultipleShooting, HomotopyGoesWhereTheGuessDoesNot) {
  const Solution s = solve(troesch(20.0), {.accuracy = 1e-8, .homotopy = Homotopy{"parameter", 1.0}});
  ASSERT_TRUE(s.solved()) << s.message;
  EXPECT_EQ(s.parameters[0], 20.0);
  // Away from 0 the solution is on the separatrix tanh(μy/4) = C e^(μx), near 0 it is (s/μ) sinh μx: both agree for C = s/8, so that
  // s = 8 e^(−μ) tanh(μ/4) up to a relative O(e^(−2μ)).
  const double slope = 8.0 * std::exp(-20.0) * std::tanh(5.0);
  EXPECT_NEAR(s["slope"].value, slope, s["slope"].error_bound);
  expect_named(thrown<BadInput>([] {
                 (void)solve(troesch(2.0), {.homotopy = Homotopy{"mu", 1.0}});
               }),
               {"'mu'", "parameter"});
}

/// y'' = −10 on the part of the arc between 0.7 and 0.8, else 0: a load that long steps would pass over.
struct ShortLoad {
  static constexpr int states = 2, parameters = 1, quadratures = 1;
  template <class S>
  Rates<S, 2, 1> rates(const S& t, const Vec<S, 2>& y, const Vec<S, 1>&) const {
    return {{y[1], t > S(0.7) && t < S(0.8) ? S(-10.0) : S(0.0)}, {y[0]}};
  }
};

TEST(Solve, AShortLoadIsNotPassedOver) {
  for (const double accuracy : {1e-4, 1e-8}) {
    const Solution s = solve(std::make_shared<Line<ShortLoad>>(0.0, 0.0, 1.0, 0.0), {.accuracy = accuracy});
    // y'(0) = ∫ (1 − t) 10 dt and y'(1) = y'(0) − 1.
    ASSERT_TRUE(s.solved()) << s.message;
    expect_known(s, "slope", 0.25, accuracy);
    expect_known(s, "end slope", -0.75, accuracy);
  }
}

TEST(Solve, LeavesAShootingAsItWas) {
  Shooting shooting(troesch(9.0));
  const Solution s = solve(shooting, vector({0.0}), {.accuracy = 1e-8});
  ASSERT_TRUE(s.solved()) << s.message;
  EXPECT_GT(s.nodes, 0);
  EXPECT_EQ(shooting.size(), 1);
  EXPECT_THROW((void)solve(shooting, vector({0.0}), {.max_total_steps = 100, .homotopy = Homotopy{"nope"}}), BadInput);
  EXPECT_NO_THROW((void)shooting.evaluate(vector({0.0})));
  expect_named(thrown<BadInput>([&] { (void)shooting.evaluate(vector({0.0, 1.0})); }), {"2 values", "1 unknowns"});
}

std::shared_ptr<const Problem> equations(std::vector<Unknown> unknowns, std::vector<Row> rows,
                                         small::Equations::RowsOf rows_of) {
  return std::make_shared<small::Equations>(std::move(unknowns), std::move(rows), std::move(rows_of));
}

TEST(IllPosed, IsRefusedByName) {
  expect_named(
      thrown<BadInput>([] {
        (void)solve(equations({{"a"}, {"b"}}, {{"only row"}}, [](Shot& shot) { return std::vector{shot.unknown(0)}; }));
      }),
      {"a, b", "only row"});
  expect_named(thrown<BadInput>([] {
                 (void)solve(equations({{"a"}, {"b"}}, {{"good"}, {"fixed end"}}, [](Shot& shot) {
                   return std::vector{shot.unknown(0) + shot.unknown(1), Jet(0.25)};
                 }));
               }),
               {"'fixed end'", "0.25", "no unknown"});
  expect_named(thrown<BadInput>([] {
                 (void)solve(equations({{"a"}, {"idle"}}, {{"r"}, {"s"}}, [](Shot& shot) {
                   return std::vector{shot.unknown(0) + 1.0, shot.unknown(0) * 2.0};
                 }));
               }),
               {"'idle'"});
}

// Both rows say the same: a line of solutions, or none.
TEST(IllPosed, RowsThatRepeatEachOtherLeaveACombinationUndetermined) {
  const Solution s = solve(equations({{"a"}, {"b"}}, {{"r"}, {"s"}}, [](Shot& shot) {
    const Jet sum = shot.unknown(0) - 2.0 * shot.unknown(1);
    return std::vector{sum, 3.0 * sum};
  }));
  EXPECT_FALSE(s.solved());
  expect_named(s.message, {"0.89 a", "0.45 b"});
}

// A derivative that vanishes at the start by chance is no reason to refuse.
TEST(IllPosed, AVanishingSlopeAtTheStartIsNone) {
  const Solution s = solve(equations({{"a"}}, {{"parabola"}},
                                     [](Shot& shot) { return std::vector{shot.unknown(0) * shot.unknown(0) - 4.0}; }),
                           vector({0.0}));
  EXPECT_EQ(s.message.find("depends on no unknown"), std::string::npos);
}

}  // namespace
}  // namespace costate
