/// \file
/// A function of state and control with its first and second derivatives, behind a virtual interface.
#pragma once

#include <costate/dual.hpp>
#include <costate/vec.hpp>

#include <Eigen/Core>
#include <memory>

namespace costate {

/// y = F(q, u, p), F: ℝⁿ × ℝᵏ × ℝᵐ → ℝʳ. Derivatives are taken with respect to z = (q, u).
class SmoothMap {
 public:
  using ConstVector = Eigen::Ref<const Eigen::VectorXd>;
  struct Expansion {
    Eigen::VectorXd value;     ///< F (r)
    Eigen::MatrixXd jacobian;  ///< F_z (r × (n + k))
    Eigen::MatrixXd hessian;   ///< Σ wᵢ ∂²Fᵢ/∂z² ((n + k) × (n + k))
  };

  SmoothMap() = default;
  SmoothMap(const SmoothMap&) = delete;
  SmoothMap& operator=(const SmoothMap&) = delete;
  virtual ~SmoothMap() = default;

  [[nodiscard]] virtual Eigen::VectorXd value(ConstVector z, ConstVector p) const = 0;
  /// With weights w (r) for the second derivatives.
  [[nodiscard]] virtual Expansion expand(ConstVector z, ConstVector p, ConstVector weights) const = 0;
};

/// The map of an f(q, u, p) on a generic scalar that returns a Vec<S, r>.
template <int n, int k, int m, int r, class F>
class SmoothMapOf final : public SmoothMap {
 public:
  explicit SmoothMapOf(F f) : f_(std::move(f)) {}

  [[nodiscard]] Eigen::VectorXd value(ConstVector z, ConstVector p) const override {
    Vec<double, size> x{};
    for (int i = 0; i < size; ++i) x[static_cast<std::size_t>(i)] = z[i];
    const Vec<double, r> y = at(x, p);
    return Eigen::Map<const Eigen::VectorXd>(y.data(), r);
  }

  [[nodiscard]] Expansion expand(ConstVector z, ConstVector p, ConstVector weights) const override {
    using D = Dual<double, size>;
    using DD = Dual<D, size>;
    Vec<DD, size> x{};
    for (int i = 0; i < size; ++i) x[static_cast<std::size_t>(i)] = DD::variable(D::variable(z[i], i), i);
    const Vec<DD, r> y = at(x, p);
    Expansion e{Eigen::VectorXd(r), Eigen::MatrixXd(r, size), Eigen::MatrixXd::Zero(size, size)};
    for (int row = 0; row < r; ++row) {
      const DD& component = y[static_cast<std::size_t>(row)];
      e.value[row] = component.value.value;
      for (int i = 0; i < size; ++i) {
        const D& slope = component.gradient[static_cast<std::size_t>(i)];
        e.jacobian(row, i) = slope.value;
        for (int j = 0; j < size; ++j) e.hessian(i, j) += weights[row] * slope.gradient[static_cast<std::size_t>(j)];
      }
    }
    return e;
  }

 private:
  static constexpr int size = n + k;

  template <class S>
  Vec<S, r> at(const Vec<S, size>& x, ConstVector p) const {
    Vec<S, n> q{};
    Vec<S, k> u{};
    Vec<S, m> parameters{};
    for (std::size_t i = 0; i < q.size(); ++i) q[i] = x[i];
    for (std::size_t i = 0; i < u.size(); ++i) u[i] = x[i + q.size()];
    for (std::size_t i = 0; i < parameters.size(); ++i) parameters[i] = S(p[static_cast<Eigen::Index>(i)]);
    return f_(q, u, parameters);
  }

  F f_;
};

template <int n, int k, int m, int r, class F>
std::shared_ptr<const SmoothMap> smooth_map(F f) {
  return std::make_shared<SmoothMapOf<n, k, m, r, F>>(std::move(f));
}

}  // namespace costate
