/// The derivatives a field offers, against differences.
#include "closed_flows.hpp"

#include <gtest/gtest.h>

namespace costate {
namespace {

using namespace closed;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Six coupled states: more directions than fit into one pass over the model.
struct Chain {
  static constexpr int states = 6, parameters = 2, quadratures = 2;
  template <class S>
  Rates<S, 6, 2> rates(const S& t, const Vec<S, 6>& z, const Vec<S, 2>& p) const {
    Rates<S, 6, 2> r{};
    for (std::size_t i = 0; i < 6; ++i) r.state[i] = sin(z[i] * z[(i + 1) % 6]) + p[0] * z[(i + 5) % 6] * cos(t);
    r.quadrature = {z[0] * z[5] * p[1], exp(z[2])};
    return r;
  }
};

/// Rows of a number and its derivatives.
using Lifted = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
std::vector<double> lifted(const VectorXd& values, const MatrixXd& directions, int d) {
  Lifted rows(values.size(), 1 + d);
  rows << values, directions.leftCols(d);
  return {rows.data(), rows.data() + rows.size()};
}

// A central difference of a function with third derivatives below M errs by h²M/6 + ε/h, 1e-9 for h = 1e-5 and M = 50.
TEST(Field, DerivativesAreThoseOfDifferences) {
  const FieldOf<Chain> field;
  const VectorXd z = vector({0.3, -0.8, 0.5, 0.9, -0.4, 0.7}), p = vector({0.6, -1.1});
  const double t = 0.4, h = 1e-5;
  MatrixXd fz(6, 6);
  ASSERT_TRUE(field.jacobian(t, z, p, fz));
  const MatrixXd s = MatrixXd::NullaryExpr(6, 7, [](auto i, auto j) { return std::sin(1.0 + 2.0 * double(i) + double(j)); });
  const MatrixXd sigma = MatrixXd::NullaryExpr(2, 7,
                                               [](auto i, auto j) { return std::cos(1.0 + double(i) + 3.0 * double(j)); });
  const auto difference = [&](const VectorXd& dz, const VectorXd& dp) {
    VectorXd above = VectorXd::Zero(6), below = above, above_w = VectorXd::Zero(2), below_w = above_w;
    EXPECT_TRUE(field.rates(t, z + h * dz, p + h * dp, above, above_w));
    EXPECT_TRUE(field.rates(t, z - h * dz, p - h * dp, below, below_w));
    VectorXd both = VectorXd::Zero(8);
    both.head(6) = above - below;
    both.tail(2) = above_w - below_w;
    return VectorXd(both / (2.0 * h));
  };
  for (Eigen::Index j = 0; j < 6; ++j) {
    EXPECT_LE(largest(fz.col(j) - difference(VectorXd::Unit(6, j), VectorXd::Zero(2)).head(6)), 1e-9) << j;
  }
  // In any number of directions at once.
  for (int d = 0; d <= 7; ++d) {
    const std::vector<double> lifted_z = lifted(z, s, d), lifted_p = lifted(p, sigma, d);
    std::vector<double> rates(static_cast<std::size_t>(8 * (1 + d)));
    ASSERT_TRUE(field.variation(t, lifted_z, lifted_p, d, rates));
    const Eigen::Map<const Lifted> result(rates.data(), 8, 1 + d);
    VectorXd dz(6), dw(2);
    ASSERT_TRUE(field.rates(t, z, p, dz, dw));
    EXPECT_EQ(result.col(0).head(6), dz);
    EXPECT_EQ(result.col(0).tail(2), dw);
    for (Eigen::Index j = 0; j < d; ++j) {
      EXPECT_LE(largest(result.col(1 + j) - difference(s.col(j), sigma.col(j))), 1e-9) << j << " of " << d;
    }
  }
}

TEST(Field, SaysWhenAResultIsNotFinite) {
  const FieldOf<RootBorder> field;
  const VectorXd outside = vector({2.0, 0.0}), border = vector({1.0, 0.0});
  VectorXd dz(2), dw(0);
  MatrixXd fz(2, 2);
  EXPECT_FALSE(field.rates(0.0, outside, VectorXd(0), dz, dw));
  EXPECT_TRUE(field.rates(0.0, border, VectorXd(0), dz, dw));
  EXPECT_FALSE(field.jacobian(0.0, border, VectorXd(0), fz)) << "the root's slope";
}

}  // namespace
}  // namespace costate
