/// The operations of SUNDIALS vectors of our own against Eigen, and the solvers that CVODES gets.
#include "corrector.hpp"

#include <Eigen/Dense>
#include <array>
#include <gtest/gtest.h>
#include <limits>

namespace costate::sundials {
namespace {

using Eigen::VectorXd;
using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Shapes with and without a remainder beyond whole SIMD words, and every specialised number of columns.
class EveryShape : public testing::TestWithParam<std::pair<int, int>> {
 protected:
  const int rows = GetParam().first, columns = GetParam().second;
  const Context context = make_context();

  [[nodiscard]] Vector filled(const VectorXd& values) const {
    Vector v = make_vector(rows, columns, context.get());
    view(v.get()) = values;
    return v;
  }
  [[nodiscard]] VectorXd random() const { return VectorXd::Random(rows * columns); }
};

// Products and sums of two numbers are rounded once or twice, in either order of evaluation the same.
TEST_P(EveryShape, ElementwiseOperationsAreThoseOfEigen) {
  const VectorXd a = random(), b = random().array() + 2.0;
  const Vector x = filled(a), y = filled(b), z = make_vector(rows, columns, context.get());
  const auto result = view(z.get());
  N_VLinearSum(0.3, x.get(), -1.7, y.get(), z.get());
  EXPECT_LE((result - (0.3 * a - 1.7 * b)).lpNorm<Eigen::Infinity>(), 1e-15);
  N_VLinearSum(1.0, x.get(), 1.0, y.get(), z.get());
  EXPECT_EQ(result, a + b);
  N_VScale(-2.5, x.get(), z.get());
  EXPECT_EQ(result, -2.5 * a);
  N_VAbs(x.get(), z.get());
  EXPECT_EQ(result, a.cwiseAbs());
  N_VProd(x.get(), y.get(), z.get());
  EXPECT_EQ(result, a.cwiseProduct(b));
  N_VDiv(x.get(), y.get(), z.get());
  EXPECT_EQ(result, a.cwiseQuotient(b));
  N_VInv(y.get(), z.get());
  EXPECT_EQ(result, b.cwiseInverse());
  N_VAddConst(x.get(), 0.7, z.get());
  EXPECT_EQ(result, VectorXd(a.array() + 0.7));
  N_VConst(3.0, z.get());
  EXPECT_EQ(result, VectorXd::Constant(rows * columns, 3.0));
  EXPECT_EQ(view(x.get()), a) << "operands are left alone";
  EXPECT_EQ(view(y.get()), b);
}

TEST_P(EveryShape, ResultsMayBeOperands) {
  const VectorXd a = random(), b = random();
  const Vector x = filled(a), y = filled(b);
  N_VLinearSum(1.0, x.get(), 1.0, y.get(), x.get());
  EXPECT_EQ(view(x.get()), a + b);
  N_VLinearSum(1.0, x.get(), -1.0, y.get(), y.get());
  EXPECT_EQ(view(y.get()), (a + b) - b);
  std::array<double, 2> factors{2.0, 4.0};
  std::array<N_Vector, 2> terms{x.get(), y.get()};
  const VectorXd combined = 2.0 * view(x.get()) + 4.0 * view(y.get());
  ASSERT_EQ(N_VLinearCombination(2, factors.data(), terms.data(), x.get()), 0);
  EXPECT_EQ(view(x.get()), combined);
}

TEST_P(EveryShape, FusedAndArrayOperationsAreThePlainOnesRepeated) {
  const VectorXd a = random(), b = random(), c = random();
  const Vector x = filled(a), y0 = filled(b), y1 = filled(c);
  std::array<double, 2> factors{0.5, -3.0};
  std::array<N_Vector, 2> y{y0.get(), y1.get()};
  ASSERT_EQ(N_VScaleAddMulti(2, factors.data(), x.get(), y.data(), y.data()), 0);
  EXPECT_EQ(view(y0.get()), 0.5 * a + b);
  EXPECT_LE((view(y1.get()) - (-3.0 * a + c)).lpNorm<Eigen::Infinity>(), 1e-15);
  ASSERT_EQ(N_VLinearSumVectorArray(2, 1.0, y.data(), -1.0, y.data(), y.data()), 0);
  EXPECT_TRUE(view(y0.get()).isZero(0.0) && view(y1.get()).isZero(0.0));
  ASSERT_EQ(N_VConstVectorArray(2, 4.0, y.data()), 0);
  ASSERT_EQ(N_VScaleVectorArray(2, factors.data(), y.data(), y.data()), 0);
  EXPECT_EQ(view(y0.get()), VectorXd::Constant(rows * columns, 2.0));
  EXPECT_EQ(view(y1.get()), VectorXd::Constant(rows * columns, -12.0));
  std::array<N_Vector, 2> shift{x.get(), x.get()};
  std::array<N_Vector*, 1> sums{y.data()};
  ASSERT_EQ(N_VScaleAddMultiVectorArray(2, 1, factors.data(), shift.data(), sums.data(), sums.data()), 0);
  EXPECT_EQ(view(y0.get()), VectorXd(0.5 * a.array() + 2.0));
}

// A sum of m squares is rounded m times, in an order that may differ.
TEST_P(EveryShape, NormsAreThoseOfTheColumns) {
  const VectorXd a = random(), w = random().cwiseAbs();
  const Vector x = filled(a), weights = filled(w);
  const VectorXd product = a.cwiseProduct(w);
  const Eigen::Map<const Rows> scaled(product.data(), rows, columns);
  const double rounding = 1e-15 * rows * columns;
  EXPECT_NEAR(N_VWrmsNorm(x.get(), weights.get()), scaled.colwise().norm().maxCoeff() / std::sqrt(rows), rounding);
  EXPECT_NEAR(N_VWL2Norm(x.get(), weights.get()), product.norm(), rounding);
  EXPECT_NEAR(N_VDotProd(x.get(), weights.get()), a.dot(w), rounding);
  EXPECT_EQ(N_VMaxNorm(x.get()), a.lpNorm<Eigen::Infinity>());
  EXPECT_EQ(N_VMin(x.get()), a.minCoeff());
  std::array<N_Vector, 2> vectors{x.get(), weights.get()}, same{weights.get(), weights.get()};
  std::array<double, 2> norms{};
  ASSERT_EQ(N_VWrmsNormVectorArray(2, vectors.data(), same.data(), norms.data()), 0);
  EXPECT_EQ(norms[0], N_VWrmsNorm(x.get(), weights.get()));
}

TEST_P(EveryShape, NormsDoNotLoseWhatIsNotANumber) {
  for (int i = 0; i < rows * columns; ++i) {
    VectorXd a = random();
    a[i] = std::numeric_limits<double>::quiet_NaN();
    const Vector x = filled(a), w = filled(VectorXd::Ones(rows * columns));
    EXPECT_FALSE(N_VWrmsNorm(x.get(), w.get()) <= 1.0) << i;
  }
}

TEST_P(EveryShape, WeightsAreInverseTolerances) {
  VectorXd a = random();
  const Vector x = filled(a), w = make_vector(rows, columns, context.get());
  const VectorXd absolute = VectorXd::LinSpaced(columns, 0.1, 0.4);
  EXPECT_TRUE(set_weights(x.get(), 1e-3, absolute.data(), w.get()));
  for (int i = 0; i < rows * columns; ++i) {
    EXPECT_DOUBLE_EQ(view(w.get())[i], 1.0 / (1e-3 * std::abs(a[i]) + absolute[i % columns])) << i;
  }
  view(x.get())[0] = 0.0;
  const VectorXd none = VectorXd::Zero(columns);
  EXPECT_FALSE(set_weights(x.get(), 1e-3, none.data(), w.get())) << "no error is allowed in a zero";
}

TEST_P(EveryShape, ClonesAreAlikeAndZero) {
  const Vector x = filled(random());
  const Vector y = owned(N_VClone(x.get()), "N_VClone");
  EXPECT_EQ(N_VGetLength(y.get()), rows * columns);
  EXPECT_TRUE(view(y.get()).isZero(0.0));
  EXPECT_EQ(reinterpret_cast<std::uintptr_t>(N_VGetArrayPointer(y.get())) % 64, 0U) << "aligned";
  N_VConst(1.0, y.get());
  EXPECT_EQ(N_VWrmsNorm(y.get(), y.get()), 1.0);
}

// (I − γJ) of the states applied to every column; the rows of the quadratures pass.
TEST_P(EveryShape, NewtonMatrixSolvesEveryColumn) {
  const int quadratures = rows > 1 ? 1 : 0, states = rows - quadratures;
  NewtonMatrix newton(states, rows, context.get());
  newton.jacobian() = 0.4 / rows * Eigen::MatrixXd::Random(states, states);
  ASSERT_TRUE(newton.factorise(0.9));
  const VectorXd right = random();
  const Vector b = filled(right), x = make_vector(rows, columns, context.get());
  ASSERT_EQ(SUNLinSolSolve(newton.solver(), newton.matrix(), x.get(), b.get(), 0.0), 0);
  const Eigen::Map<const Rows> solution(N_VGetArrayPointer(x.get()), rows, columns), given(right.data(), rows, columns);
  const Eigen::MatrixXd z = solution.topRows(states);
  // Diagonally dominant: the condition number is below 3.
  EXPECT_LE((z - 0.9 * newton.jacobian() * z - given.topRows(states)).lpNorm<Eigen::Infinity>(), 1e-14);
  EXPECT_EQ(solution.bottomRows(quadratures), given.bottomRows(quadratures));
}

INSTANTIATE_TEST_SUITE_P(Vector, EveryShape,
                         testing::Values(std::pair(1, 1), std::pair(3, 1), std::pair(4, 1), std::pair(7, 2), std::pair(4, 3),
                                         std::pair(5, 3), std::pair(1, 4), std::pair(6, 5), std::pair(3, 7)),
                         [](const auto& test) {
                           return std::to_string(test.param.first) + "x" + std::to_string(test.param.second);
                         });

TEST(NewtonMatrix, SaysWhenItIsSingular) {
  const Context context = make_context();
  NewtonMatrix newton(2, 2, context.get());
  newton.jacobian() << 2.0, 0.0, 0.0, 1.0;
  EXPECT_FALSE(newton.factorise(0.5));
  EXPECT_TRUE(newton.factorise(0.25));
}

}  // namespace
}  // namespace costate::sundials
