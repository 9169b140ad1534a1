/// \file
/// The right-hand side of one kind of arc, and its derivatives.
///
/// An arc is governed by z' = f(t, z, p), z ∈ ℝⁿ, with constants p ∈ ℝᵐ that are not integrated, and quadratures
/// w' = q(t, z, p), w ∈ ℝᵏ, that enter no right-hand side. A VectorField states f and q once, on a generic scalar; Field is
/// the same thing behind a virtual interface with exact derivatives, so that everything above it compiles once.
#pragma once

#include <costate/dual.hpp>
#include <costate/vec.hpp>

#include <Eigen/Core>
#include <concepts>
#include <utility>

namespace costate {

/// Rates of an arc: z' (n) and w' (k).
template <class S, int n, int k>
struct Rates {
  Vec<S, n> state;
  Vec<S, k> quadrature;
};

/// A right-hand side on a generic scalar: sizes and `rates(t, z, p)`.
template <class F>
concept VectorField = requires(const F field, double t, Vec<double, F::states> z, Vec<double, F::parameters> p) {
  { field.rates(t, z, p) } -> std::same_as<Rates<double, F::states, F::quadratures>>;
};

/// Directions in which an arc is differentiated. Column j means: the initial state moves by state.col(j) and the constants
/// by parameter.col(j). Shapes n × d and m × d; d = 0 asks for no sensitivities.
struct Directions {
  Eigen::MatrixXd state;
  Eigen::MatrixXd parameter;
  [[nodiscard]] Eigen::Index count() const { return state.cols(); }
};

/// A VectorField behind a virtual interface. Each call returns false where a result is not a finite number.
class Field {
 public:
  using ConstVector = Eigen::Ref<const Eigen::VectorXd>;
  using Vector = Eigen::Ref<Eigen::VectorXd>;
  using ConstMatrix = Eigen::Ref<const Eigen::MatrixXd>;
  using Matrix = Eigen::Ref<Eigen::MatrixXd>;

  Field() = default;
  Field(const Field&) = delete;
  Field& operator=(const Field&) = delete;
  virtual ~Field() = default;

  [[nodiscard]] virtual int states() const = 0;
  [[nodiscard]] virtual int parameters() const = 0;
  [[nodiscard]] virtual int quadratures() const = 0;

  /// z' (n) and w' (k).
  virtual bool rates(double t, ConstVector z, ConstVector p, Vector dz, Vector dw) const = 0;
  /// s_j' = f_z s_j + f_p σ_j and its quadrature part q_z s_j + q_p σ_j, for the columns s_j of `s` (n × d), σ_j of `sigma` (m × d).
  virtual bool sensitivities(double t, ConstVector z, ConstVector p, ConstMatrix s, ConstMatrix sigma, Matrix ds,
                             Matrix dw) const = 0;
  /// f_z (n × n).
  virtual bool jacobian(double t, ConstVector z, ConstVector p, Matrix fz) const = 0;
};

/// Field of a VectorField: derivatives by dual numbers.
template <VectorField F>
class FieldOf final : public Field {
 public:
  FieldOf() = default;
  explicit FieldOf(F field) : field_(std::move(field)) {}

  [[nodiscard]] int states() const override { return F::states; }
  [[nodiscard]] int parameters() const override { return F::parameters; }
  [[nodiscard]] int quadratures() const override { return F::quadratures; }

  bool rates(double t, ConstVector z, ConstVector p, Vector dz, Vector dw) const override {
    const auto r = field_.rates(t, load<F::states>(z), load<F::parameters>(p));
    store(r.state, dz);
    store(r.quadrature, dw);
    return dz.allFinite() && dw.allFinite();
  }

  bool sensitivities(double t, ConstVector z, ConstVector p, ConstMatrix s, ConstMatrix sigma, Matrix ds,
                     Matrix dw) const override {
    // `width` directions share one evaluation of the model; the last pass may carry idle ones.
    constexpr int width = 4;
    using D = Dual<double, width>;
    for (Eigen::Index first = 0; first < s.cols(); first += width) {
      const Eigen::Index used = std::min<Eigen::Index>(width, s.cols() - first);
      const auto r = field_.rates(D(t), seed<F::states, D>(z, s.middleCols(first, used)),
                                  seed<F::parameters, D>(p, sigma.middleCols(first, used)));
      scatter(r.state, ds.middleCols(first, used));
      scatter(r.quadrature, dw.middleCols(first, used));
    }
    return ds.allFinite() && dw.allFinite();
  }

  bool jacobian(double t, ConstVector z, ConstVector p, Matrix fz) const override {
    using D = Dual<double, F::states>;
    const auto r = field_.rates(D(t), seed<F::states, D>(z, Eigen::MatrixXd::Identity(F::states, F::states)),
                                lift<D>(load<F::parameters>(p)));
    scatter(r.state, fz);
    return fz.allFinite();
  }

 private:
  template <int N>
  static Vec<double, N> load(const ConstVector& v) {
    Vec<double, N> a{};
    for (std::size_t i = 0; i < a.size(); ++i) a[i] = v[static_cast<Eigen::Index>(i)];
    return a;
  }
  template <std::size_t N>
  static void store(const std::array<double, N>& a, Vector v) {
    for (std::size_t i = 0; i < N; ++i) v[static_cast<Eigen::Index>(i)] = a[i];
  }
  template <int N, class D, class Columns>
  static Vec<D, N> seed(const ConstVector& v, const Columns& directions) {
    Vec<D, N> a{};
    for (std::size_t i = 0; i < a.size(); ++i) {
      a[i] = D(v[static_cast<Eigen::Index>(i)]);
      for (Eigen::Index j = 0; j < directions.cols(); ++j) {
        a[i].gradient[static_cast<std::size_t>(j)] = directions(static_cast<Eigen::Index>(i), j);
      }
    }
    return a;
  }
  template <class D, std::size_t N>
  static void scatter(const std::array<D, N>& a, Matrix columns) {
    for (std::size_t i = 0; i < N; ++i) {
      for (Eigen::Index j = 0; j < columns.cols(); ++j) {
        columns(static_cast<Eigen::Index>(i), j) = a[i].gradient[static_cast<std::size_t>(j)];
      }
    }
  }

  F field_{};
};

}  // namespace costate
