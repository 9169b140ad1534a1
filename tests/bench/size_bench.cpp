/// Cost against size: a chain of n/2 masses between walls, held by springs and pushed one by one, comes to rest with least effort, n = 2 … 200
/// states. Prints medians of the thread's CPU time for an evaluation of the shooting function with all n directions, of which the
/// integration, Newton's linear system and the rest, then for a whole root, and the exponents of time in n.
#include "median.hpp"

#include <costate/shooting/locate.hpp>
#include <costate/shooting/solve.hpp>

#include <fmt/format.h>
#include <unsupported/Eigen/MatrixFunctions>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

namespace costate {
namespace {

/// Least ∫₀¹ ½(|q|² + |p|² + |u|²) dt with q' = p, p' = −K q + u, K = tridiag(−1, 2, −1): u = λ_p, and
///
///     q' = p,   p' = −K q + λ_p,   λ_q' = q + K λ_p,   λ_p' = p − λ_q.
class Chain final : public Field {
 public:
  explicit Chain(int masses) : masses_(masses) {}
  [[nodiscard]] int states() const override { return 4 * masses_; }
  [[nodiscard]] int parameters() const override { return 0; }
  [[nodiscard]] int quadratures() const override { return 0; }
  bool rates(double t, ConstVector z, ConstVector, Vector dz, Vector) const override {
    return variation(t, {z.data(), static_cast<std::size_t>(z.size())}, {}, 0,
                     {dz.data(), static_cast<std::size_t>(dz.size())});
  }
  /// The equations are linear: derivatives obey what the numbers do.
  void unchecked_variation(double, std::span<const double> z, std::span<const double>, int d,
                           std::span<double> rates) const override {
    const Eigen::Index width = 1 + d, m = masses_;
    const Rows block(z.data(), 4 * m, width);
    Eigen::Map<RowMajor> rate(rates.data(), 4 * m, width);
    for (Eigen::Index i = 0; i < m; ++i) {
      rate.row(i) = block.row(m + i);
      rate.row(m + i) = block.row(3 * m + i) - 2.0 * block.row(i);
      rate.row(2 * m + i) = block.row(i) + 2.0 * block.row(3 * m + i);
      rate.row(3 * m + i) = block.row(m + i) - block.row(2 * m + i);
      for (const Eigen::Index j : {i - 1, i + 1}) {
        if (j < 0 || j >= m) continue;
        rate.row(m + i) += block.row(j);
        rate.row(2 * m + i) -= block.row(3 * m + j);
      }
    }
  }
  bool jacobian(double, ConstVector, ConstVector, Matrix fz) const override {
    const Eigen::Index m = masses_;
    fz.setZero();
    for (Eigen::Index i = 0; i < m; ++i) {
      fz(i, m + i) = fz(m + i, 3 * m + i) = fz(2 * m + i, i) = fz(3 * m + i, m + i) = 1.0;
      fz(3 * m + i, 2 * m + i) = -1.0;
      fz(m + i, i) = -2.0;
      fz(2 * m + i, 3 * m + i) = 2.0;
      for (const Eigen::Index j : {i - 1, i + 1}) {
        if (j < 0 || j >= m) continue;
        fz(m + i, j) = 1.0;
        fz(2 * m + i, 3 * m + j) = -1.0;
      }
    }
    return true;
  }

 private:
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  using Rows = Eigen::Map<const RowMajor>;
  int masses_;
};

/// All masses begin at rest, displaced by 1/(1 + i). The unknowns are the costates at the start; they vanish at the end.
class Rest final : public Problem {
 public:
  explicit Rest(int masses) : masses_(masses), chain_(masses) {
    for (int i = 0; i < 2 * masses; ++i) {
      unknowns_.push_back({fmt::format("lambda_{}", i + 1)});
      rows_.push_back({fmt::format("end lambda_{}", i + 1)});
    }
    structure_ = {"pushed"};
  }
  [[nodiscard]] const Field& field() const { return chain_; }
  [[nodiscard]] static double displacement(int mass) { return 1.0 / (1.0 + mass); }
  void shoot(Shot& shot) const override {
    const auto n = static_cast<std::size_t>(2 * masses_);
    ArcStart start{.field = &chain_, .t0 = 0.0, .t1 = 1.0};
    for (int i = 0; i < masses_; ++i) start.state.push_back(displacement(i));
    for (int i = 0; i < masses_; ++i) start.state.push_back(0.0);
    for (std::size_t i = 0; i < n; ++i) start.state.push_back(shot.unknown(i));
    const ArcEnd end = shot.arc(start);
    for (std::size_t i = 0; i < n; ++i) shot.row(i, end.state[n + i]);
  }
  [[nodiscard]] std::vector<Column> columns() const override { return {}; }
  [[nodiscard]] std::vector<double> observe(const ArcPoint&, const std::vector<double>&) const override { return {}; }
  [[nodiscard]] std::vector<PathCheck> check(const ArcPoint&, const std::vector<double>&) const override { return {}; }

  /// The root, without integration: in the sine modes of K, of eigenvalue 4 sin²(kπ/(2m + 2)), the equations are m systems of four, whose
  /// exponential gives λ(0) = −Φ₂₂⁻¹Φ₂₁ x(0).
  [[nodiscard]] Eigen::VectorXd root() const {
    Eigen::VectorXd y = Eigen::VectorXd::Zero(2 * masses_);
    for (int k = 1; k <= masses_; ++k) {
      const double angle = k * std::numbers::pi / (masses_ + 1);
      const double stiffness = 4.0 * std::pow(std::sin(0.5 * angle), 2);
      Eigen::Matrix4d system;
      system << 0, 1, 0, 0, -stiffness, 0, 0, 1, 1, 0, 0, stiffness, 0, 1, -1, 0;
      const Eigen::Matrix4d flow = system.exp();
      const Eigen::Matrix2d gain = -flow.bottomRightCorner<2, 2>().inverse() * flow.bottomLeftCorner<2, 2>();
      double amplitude = 0.0;
      for (int i = 0; i < masses_; ++i) amplitude += displacement(i) * std::sin((i + 1) * angle) * 2.0 / (masses_ + 1);
      const Eigen::Vector2d costate = gain * Eigen::Vector2d(amplitude, 0.0);
      for (int i = 0; i < masses_; ++i) {
        y[i] += costate[0] * std::sin((i + 1) * angle);
        y[masses_ + i] += costate[1] * std::sin((i + 1) * angle);
      }
    }
    return y;
  }

 private:
  int masses_;
  Chain chain_;
};

struct Times {
  double integration = 0.0, algebra = 0.0, evaluation = 0.0, root = 0.0;
  long steps = 0;
  double error = 0.0;  ///< of the root
};

Times measure(int n, Method method) {
  constexpr double accuracy = 1e-9;
  const auto problem = std::make_shared<Rest>(n / 2);
  const FlowOptions options{.tolerance = {accuracy, accuracy}, .method = method};
  const Eigen::VectorXd reference = problem->root();
  Times t;

  const auto size = static_cast<std::size_t>(2 * n), width = static_cast<std::size_t>(1 + n);
  std::vector<double> start(size * width, 0.0);
  for (int i = 0; i < n; ++i) {
    const std::size_t row = static_cast<std::size_t>(n + i) * width;
    start[row] = reference[i];
    start[row + static_cast<std::size_t>(1 + i)] = 1.0;
    if (i < n / 2) start[static_cast<std::size_t>(i) * width] = Rest::displacement(i);
  }
  Flow flow(problem->field(), options);
  t.integration = bench::median_seconds([&] { flow.advance(0.0, 1.0, start, {}, n); }, 0.1);
  t.steps = flow.statistics().steps / flow.statistics().integrations;

  Shooting shooting(problem);
  shooting.set_flow_options(options);
  Eigen::VectorXd y = reference, residual(n), x(n);
  t.evaluation = bench::median_seconds(
      [&] {
        y[0] += 1e-12;  // a point that is not remembered
        shooting.evaluate(y);
      },
      0.1);
  t.algebra = bench::median_seconds(
      [&] {
        shooting.factorise(y);
        shooting.residual(y, residual);
        shooting.solve(residual, x);
      },
      0.1);
  Locator locator(shooting, {.accuracy = accuracy, .method = method});
  Located located;
  t.root = bench::median_seconds([&] { located = locator.find(Eigen::VectorXd::Zero(n)); }, 0.1);
  t.error = located.converged() ? (located.y - reference).lpNorm<Eigen::Infinity>() : std::nan("");
  return t;
}

/// False if a root is not what it should be.
bool table(const char* engine, Method method) {
  fmt::print("{}\n{:>4} {:>6} {:>12} {:>12} {:>12} {:>12} {:>9}   exponents\n", engine, "n", "steps", "integration",
             "evaluation", "algebra", "root", "error");
  bool right = true;
  std::optional<Times> before;
  int smaller = 0;
  for (const int n : {2, 4, 10, 20, 50, 100, 200}) {
    const Times t = measure(n, method);
    right = right && t.error < 1e-7;
    fmt::print("{:4} {:6} {:9.1f} us {:9.1f} us {:9.1f} us {:9.1f} us {:9.1e}", n, t.steps, 1e6 * t.integration,
               1e6 * t.evaluation, 1e6 * t.algebra, 1e6 * t.root, t.error);
    if (before) {
      const auto exponent = [&](double Times::*part) {
        return std::log(t.*part / (*before).*part) / std::log(double(n) / smaller);
      };
      fmt::print("   {:.1f} {:.1f} {:.1f} {:.1f}", exponent(&Times::integration), exponent(&Times::evaluation),
                 exponent(&Times::algebra), exponent(&Times::root));
    }
    fmt::print("\n");
    std::fflush(stdout);
    before = t;
    smaller = n;
  }
  return right;
}

}  // namespace
}  // namespace costate

int main() {
  const bool cvodes = costate::table("CVODES", costate::Method::adams);
  const bool runge_kutta = costate::table("Runge-Kutta", costate::Method::runge_kutta);
  return cvodes && runge_kutta ? 0 : 1;
}
