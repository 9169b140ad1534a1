/// The structured factorisation against dense ones, where elimination with row interchanges fails, and on singular matrices.
#include "staircase.hpp"

#include "small_problems.hpp"

#include <costate/error.hpp>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/SVD>

#include <algorithm>
#include <cmath>
#include <functional>
#include <gtest/gtest.h>
#include <ostream>
#include <limits>
#include <numeric>
#include <random>

namespace costate {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using small::contains;
using small::thrown;
constexpr double epsilon = std::numeric_limits<double>::epsilon();

/// S, and A = D_r S D_c⁻¹ by rows.
struct System {
  Staircase::Layout layout;
  MatrixXd scaled;
  VectorXd row_scales, column_scales;

  System(Staircase::Layout sizes, MatrixXd s)
      : layout(std::move(sizes)),
        scaled(std::move(s)),
        row_scales(VectorXd::Ones(size())),
        column_scales(VectorXd::Ones(size())) {}

  [[nodiscard]] Index size() const { return scaled.rows(); }
  [[nodiscard]] MatrixXd matrix() const {
    return row_scales.asDiagonal() * scaled * column_scales.cwiseInverse().asDiagonal();
  }
  [[nodiscard]] std::vector<Jet::Gradient> rows() const {
    const MatrixXd a = matrix();
    std::vector<Jet::Gradient> rows(static_cast<std::size_t>(size()));
    for (Index i = 0; i < size(); ++i)
      for (Index j = 0; j < size(); ++j)
        if (a(i, j) != 0.0) rows[static_cast<std::size_t>(i)].push_back({static_cast<int>(j), a(i, j)});
    return rows;
  }
  [[nodiscard]] Staircase factorised() const { return {rows(), layout, row_scales, column_scales}; }
  [[nodiscard]] double condition() const {
    // The eigenvalues of (0 S; Sᵀ 0) are the singular values and their negatives, to the same rounding error as Eigen's SVDs, of
    // which one is slow to run and one to compile.
    MatrixXd twice = MatrixXd::Zero(2 * size(), 2 * size());
    twice.bottomLeftCorner(size(), size()) = scaled.transpose();
    const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(twice, Eigen::EigenvaluesOnly);
    return solver.eigenvalues()[2 * size() - 1] / solver.eigenvalues()[size()];
  }
};

struct Shape {
  const char* name;
  int border;
  std::vector<int> blocks;
  /// Blocks; none if every block's matching rows hold the block before.
  std::vector<int> arc_starts = {0};
  bool backward = false;  ///< matching rows hold the block after
  int border_only = 0;    ///< rows that hold no node
  int wide = 0;           ///< rows that hold every node
};

std::ostream& operator<<(std::ostream& out, const Shape& shape) { return out << shape.name; }

/// Entries of S uniform in (-1, 1), of the diagonal of matching rows -1; scales over six decades; rows in any order.
class Random {
 public:
  explicit Random(unsigned seed) : generator_(seed) {}
  double uniform(double from, double to) { return std::uniform_real_distribution<double>(from, to)(generator_); }
  VectorXd vector(Index n) {
    return VectorXd::NullaryExpr(n, [&] { return uniform(-1.0, 1.0); });
  }

  System system(const Shape& shape) {
    const auto blocks = static_cast<int>(shape.blocks.size());
    std::vector<int> first{shape.border};
    for (const int size : shape.blocks) first.push_back(first.back() + size);
    const int n = first.back();
    MatrixXd s = MatrixXd::Zero(n, n);
    const auto fill = [&](Index row, int from, int to) {
      for (int j = from; j < to; ++j) s(row, j) = uniform(-1.0, 1.0);
    };
    const auto fill_block = [&](Index row, int b) {
      if (b >= 0 && b < blocks) fill(row, first[static_cast<std::size_t>(b)], first[static_cast<std::size_t>(b) + 1]);
    };
    Index row = 0;
    for (int b = 0; b < blocks; ++b)
      for (int i = 0; i < shape.blocks[static_cast<std::size_t>(b)]; ++i, ++row) {
        fill(row, 0, shape.border);
        fill_block(row, shape.backward ? b + 1 : b - 1);
        s(row, first[static_cast<std::size_t>(b)] + i) = -1.0;
      }
    for (int i = 0; row < n; ++row, ++i) {
      fill(row, 0, shape.border);
      if (i < shape.border_only) continue;
      for (int b = 0; b < blocks; ++b)
        if (i - shape.border_only < shape.wide) fill_block(row, b);
      for (const int start : shape.arc_starts) fill_block(row, (start + blocks - 1) % std::max(blocks, 1));
    }
    System result(Staircase::Layout{shape.border, shape.blocks}, std::move(s));
    shuffle(result.scaled);
    for (Index i = 0; i < n; ++i) {
      result.row_scales[i] = std::pow(10.0, uniform(-3.0, 3.0));
      result.column_scales[i] = std::pow(10.0, uniform(-3.0, 3.0));
    }
    return result;
  }

  void shuffle(MatrixXd& s) {
    std::vector<Index> order(static_cast<std::size_t>(s.rows()));
    std::iota(order.begin(), order.end(), 0);
    std::shuffle(order.begin(), order.end(), generator_);
    s = s(order, Eigen::all).eval();
  }

 private:
  std::mt19937 generator_;
};

class Shapes : public testing::TestWithParam<Shape> {};
INSTANTIATE_TEST_SUITE_P(All, Shapes,
                         testing::Values(Shape{"one_arc", 4, {4, 4, 4, 4, 4, 4}},
                                         Shape{"three_arcs", 7, {2, 2, 2, 4, 4, 4, 6, 6, 6}, {0, 3, 6}},
                                         Shape{"backward", 4, {4, 4, 4, 4, 4}, {0}, true},
                                         Shape{"border_rows", 6, {3, 3, 3, 3}, {0}, false, 3},
                                         Shape{"wide_rows", 5, {4, 2, 4, 2, 4}, {0, 2}, false, 1, 3},
                                         Shape{"no_nodes", 9, {}}, Shape{"no_border", 0, {3, 3, 3}},
                                         Shape{"empty_block", 3, {4, 0, 4}}, Shape{"long", 3, std::vector<int>(40, 4)}),
                         [](const auto& tested) { return tested.param.name; });

// Householder's factorisation solves a nearby system, ‖Sz - b‖ ≤ c ‖S‖ ‖z‖ with c of the order of ε times the number of
// operations on one entry, at most N; so the error is below N ε κ. LU with complete pivoting is as good here; hence twice that.
TEST_P(Shapes, SolveAsDenseMatricesDo) {
  Random random(1);
  for (int trial = 0; trial < 20; ++trial) {
    const System system = random.system(GetParam());
    const Staircase staircase = system.factorised();
    ASSERT_FALSE(staircase.singular());
    const double n = static_cast<double>(system.size());
    const VectorXd b = random.vector(system.size());
    const double norm = system.scaled.norm();
    const VectorXd z = staircase.solve(system.row_scales.cwiseProduct(b)).cwiseQuotient(system.column_scales);
    EXPECT_LE((system.scaled * z - b).norm(), n * epsilon * norm * z.norm());
    const VectorXd w = staircase.solve_transposed(b.cwiseQuotient(system.column_scales)).cwiseProduct(system.row_scales);
    EXPECT_LE((system.scaled.transpose() * w - b).norm(), n * epsilon * norm * w.norm());

    const double error = 2.0 * n * epsilon * system.condition();
    const VectorXd dense = system.scaled.fullPivLu().solve(b);
    EXPECT_LE((z - dense).norm(), error * dense.norm());
    const VectorXd dense_transposed = system.scaled.transpose().fullPivLu().solve(b);
    EXPECT_LE((w - dense_transposed).norm(), error * dense_transposed.norm());
  }
}

// The iterations approach the singular values from inside, so the estimate is a lower bound up to the rounding of the smallest.
TEST_P(Shapes, ConditionIsThatOfTheDenseMatrix) {
  Random random(2);
  for (int trial = 0; trial < 20; ++trial) {
    const System system = random.system(GetParam());
    const double condition = system.condition();
    const double estimate = system.factorised().condition();
    EXPECT_LE(estimate, condition * (1.0 + static_cast<double>(system.size()) * epsilon * condition));
    EXPECT_GE(estimate, 0.9 * condition);
  }
}

// One unknown of the border is made almost a multiple of another, which keeps the structure. Rounding blurs the vectors of the smallest
// singular value by N ε κ, κ of the rest, and every iteration reduces what else there is by the square of the ratio to the next.
TEST(Staircase, WeakestCombinationsAreTheSingularVectors) {
  for (const Shape& shape : {Shape{"", 4, {4, 4, 4, 4, 4, 4}}, Shape{"", 7, {2, 2, 2, 4, 4, 4, 6, 6, 6}, {0, 3, 6}},
                             Shape{"", 4, {4, 4, 4, 4, 4}, {0}, true}, Shape{"", 9, {}}}) {
    System system = Random(3).system(shape);
    const Index last = system.size() - 1;
    system.scaled.col(1) = 0.5 * system.scaled.col(0) + 1e-9 * system.scaled.col(1);
    const Eigen::JacobiSVD<MatrixXd> svd(system.scaled, Eigen::ComputeFullU | Eigen::ComputeFullV);
    const VectorXd& values = svd.singularValues();
    ASSERT_LT(values[last], 1e-5 * values[last - 1]);
    const double blur = 10.0 * static_cast<double>(system.size()) * epsilon * values[0] / values[last - 1];
    const Staircase staircase = system.factorised();
    EXPECT_FALSE(staircase.singular());
    const VectorXd right = staircase.weakest(), left = staircase.weakest_rows();
    EXPECT_NEAR(right.norm(), 1.0, 10.0 * epsilon);
    EXPECT_NEAR(left.norm(), 1.0, 10.0 * epsilon);
    // The part across the singular vector, of which the cosine would only see the square.
    const VectorXd v = svd.matrixV().col(last), u = svd.matrixU().col(last);
    EXPECT_LT((right - v * v.dot(right)).norm(), blur);
    EXPECT_LT((left - u * u.dot(left)).norm(), blur);
  }
}

/// y' = M y in N steps of the transition matrix `step`, y(0) in the border: step y_{k-1} - y_k = …, and at last the given rows on
/// y_0 and y_N.
System chain(int steps, const MatrixXd& step, const MatrixXd& at_start, const MatrixXd& at_end,
             bool conditions_first = false) {
  const Index s = step.rows(), n = s * (steps + 1), first = conditions_first ? s : 0;
  MatrixXd matrix = MatrixXd::Zero(n, n);
  for (Index k = 0; k < steps; ++k) {
    matrix.block(first + k * s, k * s, s, s) = step;
    matrix.block(first + k * s, (k + 1) * s, s, s) = -MatrixXd::Identity(s, s);
  }
  matrix.block(conditions_first ? 0 : n - s, 0, s, s) = at_start;
  matrix.block(conditions_first ? 0 : n - s, n - s, s, s) = at_end;
  return {Staircase::Layout{static_cast<int>(s), std::vector<int>(static_cast<std::size_t>(steps), static_cast<int>(s))},
          std::move(matrix)};
}

// S. J. Wright, SIAM J. Sci. Comput. 14 (1993) 231–238: y' = M y, M = (-1/6, 1; 1, -1/6), y(0) + y(b) = c, steps of 0.3. All entries
// of exp(0.3 M) are below 1, so that rows are never interchanged, and elimination grows like exp(5b/6): for b = 60 by 5e21.
TEST(Staircase, KeepsAllDigitsWhereRowInterchangesLoseThemAll) {
  const double h = 0.3, decay = std::exp(-h / 6.0);
  const Eigen::Matrix2d step{{decay * std::cosh(h), decay * std::sinh(h)}, {decay * std::sinh(h), decay * std::cosh(h)}};
  const Eigen::Matrix2d one = Eigen::Matrix2d::Identity();
  for (const int steps : {200, 400}) {
    const System system = chain(steps, step, one, one, true);
    const VectorXd x = Random(4).vector(system.size());
    const VectorXd b = system.scaled * x;
    const Staircase staircase = system.factorised();
    EXPECT_LT(staircase.condition(), 100.0);
    // Rounding of b included; see above.
    EXPECT_LT((staircase.solve(b) - x).norm(), 2.0 * static_cast<double>(system.size()) * epsilon * 100.0 * x.norm());
    EXPECT_GT((system.scaled.partialPivLu().solve(b) - x).norm(), 0.1 * x.norm());
  }
}

// y'' = a² y, y(0) = y(1) = 1: y = cosh(a (t - 1/2)) / cosh(a / 2). In (y, y'/a) the fundamental solutions are exp(±a t): with
// a = 400 a single shot grows beyond all numbers' digits.
TEST(Staircase, KeepsGrowingAndDecayingSolutionsApart) {
  const double a = 400.0;
  const int steps = 200;
  const double h = 1.0 / steps;
  const Eigen::Matrix2d step{{std::cosh(a * h), std::sinh(a * h)}, {std::sinh(a * h), std::cosh(a * h)}};
  const System system = chain(steps, step, Eigen::Matrix2d{{1.0, 0.0}, {0.0, 0.0}}, Eigen::Matrix2d{{0.0, 0.0}, {1.0, 0.0}});
  VectorXd b = VectorXd::Zero(system.size());
  b.tail(2).setOnes();
  const Staircase staircase = system.factorised();
  const VectorXd y = staircase.solve(b);
  EXPECT_LT(staircase.condition(), 100.0);
  for (int k = 0; k <= steps; ++k) {
    // exp(-a/2) = 1e-87 is nothing beside 1.
    const double t = k * h, exact = std::exp(-a * t) + std::exp(-a * (1.0 - t));
    EXPECT_NEAR(y[2 * k], exact, 2.0 * static_cast<double>(system.size()) * epsilon * 100.0);
  }
}

// y'' = -y in short steps: the largest singular values of such a chain lie densely below 2, where power iteration is slowest.
TEST(Staircase, ConditionOfManySegmentsIsThatOfTheDenseMatrix) {
  const double c = std::cos(0.01), s = std::sin(0.01);
  const System system = chain(200, Eigen::Matrix2d{{c, s}, {-s, c}}, Eigen::Matrix2d{{1.0, 0.0}, {0.0, 0.0}},
                              Eigen::Matrix2d{{0.0, 0.0}, {1.0, 0.0}});
  EXPECT_NEAR(system.factorised().condition() / system.condition(), 1.0, 0.1);
}

TEST(Staircase, NamesAnEmptyColumnOrRow) {
  for (const int column : {1, 3, 9, 27}) {
    System system = Random(5).system({"", 4, {4, 4, 4, 4, 4, 4}});
    system.scaled.col(column).setZero();
    const Staircase staircase = system.factorised();
    EXPECT_TRUE(staircase.singular());
    EXPECT_EQ(staircase.condition(), std::numeric_limits<double>::infinity());
    EXPECT_EQ(staircase.empty_column(), column);
    EXPECT_FALSE(staircase.empty_row());
    EXPECT_FALSE(staircase.solve(VectorXd::Ones(system.size())).allFinite());
    EXPECT_FALSE(staircase.solve_transposed(VectorXd::Ones(system.size())).allFinite());
    EXPECT_NEAR(std::abs(staircase.weakest()[column]), 1.0, 1e-12);

    System flat = Random(6).system({"", 4, {4, 4, 4, 4, 4, 4}});
    flat.scaled.row(column).setZero();
    const Staircase rows = flat.factorised();
    EXPECT_TRUE(rows.singular());
    EXPECT_EQ(rows.empty_row(), column);
    EXPECT_FALSE(rows.empty_column());
    EXPECT_NEAR(std::abs(rows.weakest_rows()[column]), 1.0, 1e-12);
  }
}

TEST(Staircase, EntriesThatAreZeroAreNone) {
  const VectorXd ones = VectorXd::Ones(2);
  const Staircase staircase({{{0, 1.0}, {1, 0.0}}, {{0, 0.0}, {1, 0.0}}}, Staircase::Layout{1, {1}}, ones, ones);
  EXPECT_EQ(staircase.empty_row(), 1);
  EXPECT_EQ(staircase.empty_column(), 1);
}

// Two unknowns, or two rows, that say the same. The singular vectors are (1, -1)/√2 there; they are found as well as rounding lets
// the smallest singular value, ε, be told from the next, 1/κ of the rest: blurred by N ε κ.
TEST(Staircase, NamesWhatCannotBeToldApart) {
  for (const auto& [a, b] : {std::pair{0, 2}, {4, 5}, {18, 19}, {1, 26}}) {
    System columns = Random(7).system({"", 4, {4, 4, 4, 4, 4, 4}, {0}, false, 0, 4});
    columns.scaled.col(b) = columns.scaled.col(a);
    System rows = Random(8).system({"", 4, {4, 4, 4, 4, 4, 4}});
    rows.scaled.row(b) = rows.scaled.row(a);
    for (const bool transposed : {false, true}) {
      const System& system = transposed ? rows : columns;
      const VectorXd values = system.scaled.jacobiSvd().singularValues();
      const double blur = 10.0 * static_cast<double>(system.size()) * epsilon * values[0] / values[system.size() - 2];
      const Staircase staircase = system.factorised();
      EXPECT_GT(staircase.condition(), 1.0 / (10.0 * static_cast<double>(system.size()) * epsilon));
      const VectorXd weakest = transposed ? staircase.weakest_rows() : staircase.weakest();
      EXPECT_NEAR(weakest[a], -weakest[b], blur);
      EXPECT_NEAR(std::abs(weakest[a]), std::sqrt(0.5), blur);
      EXPECT_LT((transposed ? VectorXd(system.scaled.transpose() * weakest) : VectorXd(system.scaled * weakest)).norm(),
                blur * values[0]);
    }
  }
}

// No row is empty and no column is, but three rows hold five columns of a block: whatever is done, two pivots are 0.
TEST(Staircase, GoesOnBehindABlockWithTooFewRows) {
  System system = Random(9).system({"", 4, {5, 5, 5}});
  // The middle block is taken out of all rows but three.
  int kept = 0;
  for (Index i = 0; i < system.size(); ++i)
    if (!system.scaled.row(i).segment(9, 5).isZero(0.0) && kept++ >= 3) system.scaled.row(i).segment(9, 5).setZero();
  const Staircase staircase = system.factorised();
  EXPECT_TRUE(staircase.singular());
  EXPECT_FALSE(staircase.solve(VectorXd::Ones(system.size())).allFinite());
  const VectorXd right = staircase.weakest(), left = staircase.weakest_rows();
  const double rounding = 10.0 * static_cast<double>(system.size()) * epsilon * system.scaled.norm();
  EXPECT_LT((system.scaled * right).norm(), rounding);
  EXPECT_LT((system.scaled.transpose() * left).norm(), rounding);
  EXPECT_NEAR(right.segment(9, 5).norm(), 1.0, rounding);
}

TEST(Staircase, MatrixWithoutNumbersIsSingular) {
  System system = Random(10).system({"", 3, {4, 4, 4}});
  std::vector<Jet::Gradient> rows = system.rows();
  rows[5][0].derivative = std::nan("");
  const Staircase staircase(rows, system.layout, system.row_scales, system.column_scales);
  EXPECT_TRUE(staircase.singular());
  EXPECT_FALSE(staircase.solve(VectorXd::Ones(system.size())).allFinite());
  EXPECT_TRUE(staircase.weakest().allFinite());
}

TEST(Staircase, RefusesWhatIsNoSquareMatrix) {
  const std::vector<Jet::Gradient> rows{{{0, 1.0}}, {{1, 1.0}}, {{2, 1.0}}};
  const VectorXd ones = VectorXd::Ones(3);
  const auto refusal = [](auto&&... arguments) { return thrown<BadInput>([&] { Staircase{arguments...}; }); };
  EXPECT_TRUE(contains(refusal(rows, Staircase::Layout{2, {2}}, ones, ones), "number of rows = 3, but there are 4 columns"));
  EXPECT_TRUE(contains(refusal(rows, Staircase::Layout{4, {1, -2}}, ones, ones), "size of block 1 = -2 is not in [0, ∞)"));
  EXPECT_TRUE(contains(refusal(rows, Staircase::Layout{-1, {4}}, ones, ones), "size of the border = -1 is not in [0, ∞)"));
  const Staircase::Layout layout{1, {2}};
  EXPECT_TRUE(
      contains(refusal(rows, layout, VectorXd(ones.head(2)), ones), "number of row scales = 2, but there are 3 rows"));
  EXPECT_TRUE(contains(refusal(rows, layout, ones, VectorXd(-ones)), "scale of column 0 = -1 is not in (0, ∞)"));
  auto beyond = rows;
  beyond[1][0].column = 3;
  EXPECT_TRUE(contains(refusal(beyond, layout, ones, ones), "column of an entry in row 1 = 3 is not in [0, 3)"));
}

}  // namespace
}  // namespace costate
