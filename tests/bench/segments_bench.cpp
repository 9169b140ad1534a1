/// Cost of multiple shooting for one arc cut into more and more segments: per segment it should not depend on their number.
/// Prints medians of the thread's CPU time, in microseconds per segment; first of the linear algebra alone, then of Newton steps of a
/// whole problem, whose arc is as many units long as it has segments, and the memory that the problem has taken.
#include "median.hpp"
#include "staircase.hpp"

#include <costate/shooting/solve.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <malloc.h>
#include <random>

namespace costate {
namespace {

/// An arc of `segments` segments of `size` states that starts at the first unknowns; all rows depend on the border too.
std::vector<Jet::Gradient> chain(int border, int segments, int size) {
  std::mt19937 generator;
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  std::vector<Jet::Gradient> rows;
  const auto fill = [&](Jet::Gradient& row, int first, int count) {
    for (int j = 0; j < count; ++j) row.push_back({first + j, uniform(generator)});
  };
  for (int k = 0; k < segments; ++k)
    for (int i = 0; i < size; ++i) {
      auto& row = rows.emplace_back();
      fill(row, 0, border);
      if (k > 0) fill(row, border + (k - 1) * size, size);
      row.push_back({border + k * size + i, -1.0});
    }
  for (int i = 0; i < border; ++i) {
    auto& row = rows.emplace_back();
    fill(row, 0, border);
    fill(row, border + (segments - 1) * size, size);
  }
  return rows;
}

/// x' = −x³ + λ, λ' = x + 3x²λ: least ∫ (x² + u²)/2 dt.
struct Hypersensitive {
  static constexpr int states = 2, parameters = 0, quadratures = 1;
  template <class S>
  Rates<S, 2, 1> rates(const S&, const Vec<S, 2>& z, const Vec<S, 0>&) const {
    const auto& [x, lambda] = z;
    return {{lambda - x * x * x, x + 3.0 * x * x * lambda}, {0.5 * (x * x + lambda * lambda)}};
  }
};

class Rest final : public Problem {
 public:
  explicit Rest(double length) : length_(length) {
    unknowns_ = {{"lambda"}};
    rows_ = {{"end"}};
    structure_ = {"arc"};
  }
  void shoot(Shot& shot) const override {
    const std::vector<Jet> start{0.1, shot.unknown(0)};
    shot.row(0, shot.arc({.field = &field_, .t0 = 0.0, .t1 = length_, .state = start, .quadrature = {0.0}}).state[0] - 0.1);
  }
  [[nodiscard]] std::vector<Column> columns() const override { return {}; }
  [[nodiscard]] std::vector<double> observe(const ArcPoint&, const std::vector<double>&) const override { return {}; }
  [[nodiscard]] std::vector<PathCheck> check(const ArcPoint&, const std::vector<double>&) const override { return {}; }

 private:
  FieldOf<Hypersensitive> field_;
  double length_;
};

/// Integrations with sensitivities, factorisation and solution, at a point near the root.
void newton_steps(int segments) {
  const std::size_t before = mallinfo2().uordblks;
  Shooting shooting(std::make_shared<Rest>(segments));
  Mesh mesh{.cuts = {{}}, .sizes = std::vector<int>(static_cast<std::size_t>(segments - 1), 3), .nodes = {}};
  for (int k = 1; k < segments; ++k) mesh.cuts[0].push_back(static_cast<double>(k) / segments);
  mesh.nodes = Eigen::VectorXd::Zero(3 * (segments - 1));
  shooting.set_mesh(mesh);
  shooting.set_flow_options({.tolerance = {1e-8, 1e-8}});
  Eigen::VectorXd y = Eigen::VectorXd::Zero(shooting.size());
  y[0] = -0.1;
  double moved = 0.0;
  Eigen::VectorXd step;
  const auto newton = [&] {
    y[0] = -0.1 - (moved += 1e-9);  // a point not met before
    shooting.factorise(y);
    shooting.solve(shooting.residual(shooting.evaluate(y)), step);
  };
  const double each = bench::median_seconds(newton, 0.2) * 1e6 / segments;
  const double bytes = static_cast<double>(mallinfo2().uordblks - before) / segments;
  fmt::print("{:>9} {:>16.2f} {:>16.0f}\n", segments, each, bytes);
}

}  // namespace
}  // namespace costate

int main() {
  using namespace costate;
  fmt::print("{:>6} {:>9} {:>12} {:>12} {:>12}\n", "size", "segments", "factor, us", "solve, us", "condition");
  for (const int size : {2, 4, 6})
    for (int segments = 10; segments <= 640; segments *= 2) {
      const Staircase::Layout layout{size, std::vector<int>(static_cast<std::size_t>(segments), size)};
      const auto rows = chain(size, segments, size);
      const Eigen::VectorXd ones = Eigen::VectorXd::Ones(std::ssize(rows));
      const Staircase staircase(rows, layout, ones, ones);
      const double each = 1e6 / segments;
      fmt::print("{:>6} {:>9} {:>12.3f} {:>12.3f} {:>12.3f}\n", size, segments,
                 each * bench::median_seconds([&] { Staircase(rows, layout, ones, ones); }, 0.2),
                 each * bench::median_seconds([&] { return staircase.solve(ones); }, 0.2),
                 each * bench::median_seconds([&] { return staircase.condition(); }, 0.2));
    }
  fmt::print("\n{:>9} {:>16} {:>16}\n", "segments", "Newton step, us", "memory, bytes");
  for (int segments = 10; segments <= 640; segments *= 2) newton_steps(segments);
}
