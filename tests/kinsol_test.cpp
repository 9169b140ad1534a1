/// Newton's method by KINSOL: order of convergence, the border of the domain, and every honest way to fail.
#include <costate/error.hpp>
#include <costate/nonlinear.hpp>

#include <Eigen/LU>
#include <functional>
#include <gtest/gtest.h>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

namespace costate {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

VectorXd vector(std::initializer_list<double> values) {
  return Eigen::Map<const VectorXd>(values.begin(), static_cast<Eigen::Index>(values.size()));
}

/// A system of given functions that keeps a log of where it was evaluated.
class Logged : public NonlinearSystem {
 public:
  using Residual = std::function<VectorXd(const VectorXd&)>;
  using Jacobian = std::function<MatrixXd(const VectorXd&)>;
  Logged(Eigen::Index size, Residual residual, Jacobian jacobian)
      : size_(size), residual_(std::move(residual)), jacobian_(std::move(jacobian)) {}

  [[nodiscard]] Eigen::Index size() const override { return size_; }
  void residual(const VectorXd& y, VectorXd& r) override {
    residuals.push_back(y);
    r = residual_(y);
  }
  void jacobian(const VectorXd& y, MatrixXd& j) override {
    iterates.push_back(y);
    EXPECT_EQ(residuals.back(), y) << "the promise of NonlinearSystem: the point of the last residual";
    j = jacobian_(y);
  }

  std::vector<VectorXd> residuals, iterates;  ///< points of every residual, and of every Jacobian

 private:
  Eigen::Index size_;
  Residual residual_;
  Jacobian jacobian_;
};

NewtonResult solve(Logged& system, VectorXd& y, const NewtonOptions& options = {.max_step = 100.0}) {
  Kinsol kinsol(system.size());
  return kinsol.solve(system, y, VectorXd::Ones(system.size()), VectorXd::Ones(system.size()), options);
}

/// 10(y₂ − y₁²) = 0, 1 − y₁ = 0.
Logged rosenbrock_equations() {
  return {2,
          [](const VectorXd& y) {
            return vector({10.0 * (y[1] - y[0] * y[0]), 1.0 - y[0]});
          },
          [](const VectorXd& y) { return (MatrixXd(2, 2) << -20.0 * y[0], 10.0, -1.0, 0.0).finished(); }};
}

/// Powell's badly scaled equations: 10⁴y₁y₂ = 1, e^−y₁ + e^−y₂ = 1.0001.
Logged powell_equations() {
  return {2,
          [](const VectorXd& y) {
            return vector({1e4 * y[0] * y[1] - 1.0, std::exp(-y[0]) + std::exp(-y[1]) - 1.0001});
          },
          [](const VectorXd& y) {
            return (MatrixXd(2, 2) << 1e4 * y[1], 1e4 * y[0], -std::exp(-y[0]), -std::exp(-y[1])).finished();
          }};
}

/// One equation r(y) = 0.
Logged scalar(double (*r)(double), double (*slope)(double)) {
  return {1, [r](const VectorXd& y) { return vector({r(y[0])}); },
          [slope](const VectorXd& y) { return MatrixXd::Constant(1, 1, slope(y[0])); }};
}

/// log y, which exists for y > 0 only: the full Newton step y(1 − log y) from y > e leaves the domain.
double guarded_log(double y) {
  if (!(y > 0.0)) throw LeftDomain("logarithm of " + std::to_string(y));
  return std::log(y);
}
Logged logarithm() {
  return scalar(guarded_log, [](double y) { return 1.0 / y; });
}

TEST(Kinsol, SolvesRosenbrocksEquations) {
  for (const bool line_search : {true, false}) {
    Logged system = rosenbrock_equations();
    VectorXd y = vector({-1.2, 1.0});
    const NewtonResult result = solve(system, y, {.max_step = 100.0, .line_search = line_search});
    ASSERT_TRUE(result.converged()) << describe(result.termination);
    EXPECT_NEAR(y[0], 1.0, 1e-9);
    EXPECT_NEAR(y[1], 1.0, 1e-9);
    EXPECT_LE(result.residual_norm, std::sqrt(2.0) * 1e-9);
    EXPECT_EQ(system.iterates.size(), static_cast<std::size_t>(result.iterations)) << "an exact Jacobian at every iteration";
  }
}

TEST(Kinsol, SolvesPowellsBadlyScaledEquations) {
  Logged system = powell_equations();
  VectorXd y = vector({0.0, 1.0});
  Kinsol kinsol(2);
  const NewtonResult result = kinsol.solve(system, y, vector({1e-5, 10.0}), vector({1.0, 1e-4}),
                                           {.max_step = 1e3, .max_iterations = 200});
  ASSERT_TRUE(result.converged()) << describe(result.termination);
  EXPECT_NEAR(y[0], 1.098159e-5, 1e-10);  // Moré, Garbow & Hillstrom 1981, problem 3
  EXPECT_NEAR(y[1], 9.106146, 1e-5);
}

// For y² = 2 the error obeys e ← e²/(2y) exactly.
TEST(Kinsol, ConvergesQuadratically) {
  Logged system = scalar([](double y) { return y * y - 2.0; }, [](double y) { return 2.0 * y; });
  VectorXd y = vector({2.0});
  ASSERT_TRUE(solve(system, y, {.residual_tolerance = 1e-15 * 4, .max_step = 100.0}).converged());
  ASSERT_GE(system.iterates.size(), 4U);
  for (std::size_t i = 0; i + 1 < system.iterates.size(); ++i) {
    const double now = system.iterates[i][0], error = now - std::numbers::sqrt2;
    EXPECT_NEAR(system.iterates[i + 1][0] - std::numbers::sqrt2, error * error / (2.0 * now), 1e-15);
  }
}

TEST(Kinsol, ShortensAStepThatLeavesTheDomain) {
  for (const bool line_search : {true, false}) {
    Logged system = logarithm();
    VectorXd y = vector({8.0});
    const NewtonResult result = solve(system, y, {.max_step = 100.0, .line_search = line_search});
    ASSERT_TRUE(result.converged()) << describe(result.termination);
    EXPECT_NEAR(y[0], 1.0, 1e-8);
    EXPECT_LT(system.residuals[2][0], 0.0) << "the first full step must have left the domain";
    EXPECT_NE(result.message.find("logarithm of"), std::string::npos) << result.message;
  }
}

TEST(Kinsol, ResidualThatIsNotFiniteCountsAsOutside) {
  for (const bool line_search : {true, false}) {
    Logged system = scalar([](double y) { return std::log(y); }, [](double y) { return 1.0 / y; });
    VectorXd y = vector({8.0});
    EXPECT_TRUE(solve(system, y, {.max_step = 100.0, .line_search = line_search}).converged());
    EXPECT_NEAR(y[0], 1.0, 1e-8);
  }
}

TEST(Kinsol, StartOutsideTheDomainIsSaid) {
  Logged system = logarithm();
  VectorXd y = vector({-1.0});
  const NewtonResult result = solve(system, y);
  EXPECT_EQ(result.termination, Termination::left_domain) << describe(result.termination);
  EXPECT_NE(result.message.find("logarithm of -1"), std::string::npos) << result.message;
}

TEST(Kinsol, StartThatIsPartlyNotFiniteIsNoRoot) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const VectorXd& r : {vector({nan, 0.0}), vector({0.0, nan}), vector({nan, nan})}) {
    Logged system(
        2, [&](const VectorXd&) { return r; }, [](const VectorXd&) { return MatrixXd::Identity(2, 2); });
    VectorXd y = vector({0.0, 0.0});
    EXPECT_EQ(solve(system, y).termination, Termination::left_domain) << r.transpose();
  }
}

TEST(Kinsol, OtherExceptionsPassThrough) {
  Kinsol kinsol(1);
  const VectorXd one = vector({1.0});
  const auto failing = [&](std::size_t residuals, bool in_jacobian) {
    int calls = 0;
    Logged system(
        1,
        [&, residuals](const VectorXd& y) {
          if (!in_jacobian && static_cast<std::size_t>(++calls) > residuals) throw std::out_of_range("table ends at 3 km");
          return vector({y[0] * y[0] - 2.0});
        },
        [&](const VectorXd& y) {
          if (in_jacobian) throw std::out_of_range("table ends at 3 km");
          return MatrixXd::Constant(1, 1, 2.0 * y[0]);
        });
    VectorXd y = vector({2.0});
    kinsol.solve(system, y, one, one, {});
  };
  for (const auto& [residuals, in_jacobian] : {std::pair{0, false}, {2, false}, {3, false}, {0, true}}) {
    try {
      failing(static_cast<std::size_t>(residuals), in_jacobian);
      ADD_FAILURE() << "no exception";
    } catch (const std::out_of_range& failure) {
      EXPECT_STREQ(failure.what(), "table ends at 3 km");
    }
    Logged good = scalar([](double y) { return y * y - 2.0; }, [](double y) { return 2.0 * y; });
    VectorXd y = vector({2.0});
    EXPECT_TRUE(kinsol.solve(good, y, one, one, {}).converged()) << "usable afterwards";
  }
}

TEST(Kinsol, SingularJacobianIsSaid) {
  Logged system(
      2,
      [](const VectorXd& y) {
        return vector({y[0] + y[1] - 1.0, y[0] + y[1] - 2.0});
      },
      [](const VectorXd&) { return MatrixXd::Ones(2, 2); });
  VectorXd y = vector({0.0, 0.0});
  EXPECT_EQ(solve(system, y).termination, Termination::singular_jacobian);
}

TEST(Kinsol, SystemWithoutARootNeverConverges) {
  for (const double start : {0.5, 3.0, -1e-3}) {
    for (const bool line_search : {true, false}) {
      Logged system = scalar([](double y) { return y * y + 1.0; }, [](double y) { return 2.0 * y; });
      VectorXd y = vector({start});
      const NewtonResult result = solve(system, y, {.line_search = line_search});
      EXPECT_FALSE(result.converged());
      EXPECT_GE(result.residual_norm, 1.0) << "|y² + 1| is never below 1";
    }
  }
}

TEST(Kinsol, ScalesMakeUnitsIrrelevant) {
  // Rosenbrock's equations in other units: y = D u, rows multiplied by E.
  const auto D = vector({1e6, 1e-7}), E = vector({1e-8, 1e5});
  Logged plain = rosenbrock_equations();
  Logged scaled(
      2,
      [&](const VectorXd& u) {
        VectorXd r(2);
        plain.residual(u.cwiseQuotient(D), r);
        return VectorXd(r.cwiseProduct(E));
      },
      [&](const VectorXd& u) {
        MatrixXd j(2, 2);
        plain.jacobian(u.cwiseQuotient(D), j);
        return MatrixXd(E.asDiagonal() * j * D.cwiseInverse().asDiagonal());
      });
  Kinsol kinsol(2);
  VectorXd y = vector({-1.2, 1.0}), u = y.cwiseProduct(D);
  const NewtonResult a = solve(plain, y);
  const NewtonResult b = kinsol.solve(scaled, u, D, E, {.max_step = 100.0});
  EXPECT_TRUE(b.converged()) << describe(b.termination);
  EXPECT_EQ(a.iterations, b.iterations);
  EXPECT_LE((u.cwiseQuotient(D) - y).norm(), 1e-9);
}

TEST(Kinsol, NoStepIsLongerThanTheBound) {
  for (const bool line_search : {true, false}) {
    Logged system = scalar([](double y) { return std::atan(y - 40.0) + 0.1 * (y - 40.0); },
                           [](double y) { return 1.0 / (1.0 + (y - 40.0) * (y - 40.0)) + 0.1; });
    Kinsol kinsol(1);
    VectorXd y = vector({39.0 - 6.0});
    const NewtonResult result = kinsol.solve(system, y, vector({2.0}), vector({1.0}),
                                             {.max_step = 1.5, .line_search = line_search});
    EXPECT_TRUE(result.converged()) << describe(result.termination);
    double longest = 0.0;
    for (std::size_t i = 1; i < system.iterates.size(); ++i) {
      longest = std::max(longest, (system.iterates[i] - system.iterates[i - 1]).norm() / 2.0);
    }
    EXPECT_LE(longest, 1.5 * (1.0 + 1e-14));
    EXPECT_GT(longest, 1.4) << "the bound must have been active";
  }
}

TEST(Kinsol, FiveStepsAtTheBoundAreDivergence) {
  Logged system = scalar([](double y) { return std::exp(-y); }, [](double y) { return -std::exp(-y); });
  VectorXd y = vector({0.0});
  EXPECT_EQ(solve(system, y, {.max_step = 0.1}).termination, Termination::step_limit);
}

TEST(Kinsol, IterationLimitIsSaid) {
  Logged system = rosenbrock_equations();
  VectorXd y = vector({-1.2, 1.0});
  const NewtonResult result = solve(system, y, {.max_step = 100.0, .max_iterations = 1});
  EXPECT_EQ(result.termination, Termination::iteration_limit);
  EXPECT_EQ(result.iterations, 1);
}

TEST(Kinsol, StartAtARootTakesNoIterations) {
  Logged system = rosenbrock_equations();
  VectorXd y = vector({1.0, 1.0 + 1e-11});
  const NewtonResult result = solve(system, y);
  EXPECT_TRUE(result.converged());
  EXPECT_EQ(result.iterations, 0);
  EXPECT_TRUE(system.iterates.empty());
  EXPECT_EQ(y, vector({1.0, 1.0 + 1e-11}));
  EXPECT_NEAR(result.residual_norm, 1e-10, 1e-14);
}

// KINSOL's own bound on steps is a multiple of the first guess it ever saw.
TEST(Kinsol, ReuseGivesTheSameAnswersAsAFreshSolver) {
  Kinsol used(2);
  const VectorXd one = vector({1.0, 1.0});
  for (const VectorXd& start : {vector({1e-9, -1e-9}), vector({-1.2, 1.0}), vector({500.0, -300.0}), vector({-1.2, 1.0})}) {
    Logged system = rosenbrock_equations(), again = rosenbrock_equations();
    VectorXd y = start, fresh = start;
    const NewtonOptions options{.max_step = 1e6};
    const NewtonResult a = used.solve(system, y, one, one, options);
    const NewtonResult b = solve(again, fresh, options);
    EXPECT_TRUE(a.converged());
    EXPECT_EQ(y, fresh);
    EXPECT_EQ(a.iterations, b.iterations);
    EXPECT_EQ(a.residual_evaluations, b.residual_evaluations);
  }
}

TEST(Kinsol, StartNearZeroIsNotThrottled) {
  Logged system = scalar([](double y) { return y - 5000.0; }, [](double) { return 1.0; });
  VectorXd y = vector({1e-12});
  const NewtonResult result = solve(system, y, {.max_step = 1e6});
  EXPECT_TRUE(result.converged());
  EXPECT_EQ(result.iterations, 1);
}

/// Shooting for the extremal of ∫ ½u² dt, x'' = u − sin x (a pendulum swung up in time 3): unknowns are the costates at the
/// start, rows the end state, the flow is 300 steps of the classic Runge–Kutta method with its derivative by differences.
VectorXd swing_up(const VectorXd& costate) {
  Eigen::Vector4d z(0.0, 0.0, costate[0], costate[1]);
  const auto rate = [](const Eigen::Vector4d& s) {
    return Eigen::Vector4d(s[1], s[3] - std::sin(s[0]), s[3] * std::cos(s[0]), -s[2]);
  };
  constexpr double h = 3.0 / 300;
  for (int i = 0; i < 300; ++i) {
    const Eigen::Vector4d a = rate(z), b = rate(z + h / 2 * a), c = rate(z + h / 2 * b), d = rate(z + h * c);
    z += h / 6 * (a + 2 * b + 2 * c + d);
  }
  return vector({z[0] - std::numbers::pi, z[1]});
}

TEST(Kinsol, ShootingReachesTheRootOrSaysThatItDidNot) {
  for (const bool line_search : {true, false}) {
    for (const VectorXd& start : {vector({1.0, 1.0}), vector({0.01, 0.01}), vector({4.0, -4.0}), vector({-3.0, 6.0})}) {
      Logged system(2, swing_up, [](const VectorXd& y) {
        MatrixXd j(2, 2);
        for (Eigen::Index i = 0; i < 2; ++i) {
          const VectorXd step = 1e-5 * VectorXd::Unit(2, i);
          j.col(i) = (swing_up(y + step) - swing_up(y - step)) / 2e-5;
        }
        return j;
      });
      VectorXd y = start;
      const NewtonResult result = solve(system, y, {.max_step = 1e3, .line_search = line_search});
      EXPECT_EQ(result.converged(), swing_up(y).cwiseAbs().maxCoeff() <= 1e-9);
      if (start[0] == 1.0) {
        EXPECT_TRUE(result.converged()) << describe(result.termination);
      }
    }
  }
}

}  // namespace
}  // namespace costate
