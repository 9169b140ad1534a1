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
#include <algorithm>
#include <concepts>
#include <cstring>
#include <span>
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

/// A VectorField behind a virtual interface. Each call that returns a bool is false where a result is not a finite number.
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
  /// The same with its derivatives in d directions, as the variational equations s_j' = f_z s_j + f_p σ_j need them. Every number
  /// is followed by its d derivatives: z has n (1 + d) entries z₁ s₁₁ … s₁d z₂ …, p has m (1 + d), and the result (n + k)(1 + d),
  /// those of w' behind those of z'. Fastest for d = 0, 2, 4.
  bool variation(double t, std::span<const double> z, std::span<const double> p, int d, std::span<double> rates) const {
    unchecked_variation(t, z, p, d, rates);
    // A product with zero is zero, or not a number.
    double sum = 0.0;
    for (const double rate : rates) sum += 0.0 * rate;
    return sum == 0.0;
  }
  /// The same, leaving it to the caller to look whether the result is finite: of a small field it is a fifth of the cost.
  virtual void unchecked_variation(double t, std::span<const double> z, std::span<const double> p, int d,
                                   std::span<double> rates) const = 0;
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

  void unchecked_variation(double t, std::span<const double> z, std::span<const double> p, int d,
                           std::span<double> rates) const override {
    switch (d) {
      case 0: whole<double>(t, z, p, rates); break;
      case 2: whole<Dual<double, 2>>(t, z, p, rates); break;
      case 4: whole<Dual<double, 4>>(t, z, p, rates); break;
      default: {
        // Some directions at a time share one evaluation of the model; the last pass may carry idle ones.
        int first = 0;
        for (; d - first > 2; first += 4) part<4>(t, z, p, d, first, rates);
        if (first < d) part<2>(t, z, p, d, first, rates);
      }
    }
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

  // Duals lie in memory as the entries do.
  template <class S>
  void whole(double t, std::span<const double> z, std::span<const double> p, std::span<double> rates) const {
    Vec<S, F::states> state;
    Vec<S, F::parameters> parameter;
    copy(z, state);
    copy(p, parameter);
    const auto r = field_.rates(S(t), state, parameter);
    copy(r.state, rates);
    copy(r.quadrature, rates.subspan(sizeof r.state / sizeof(double)));
  }
  template <class S, std::size_t N>
  static void copy(std::span<const double> from, std::array<S, N>& to) {
    if constexpr (N > 0) std::memcpy(static_cast<void*>(to.data()), from.data(), sizeof to);
  }

  template <class S, std::size_t N>
  static void copy(const std::array<S, N>& from, std::span<double> to) {
    if constexpr (N > 0) std::memcpy(to.data(), from.data(), sizeof from);
  }

  /// Directions first … first + width − 1 of d, as far as there are that many.
  template <int width>
  void part(double t, std::span<const double> z, std::span<const double> p, int d, int first,
            std::span<double> rates) const {
    using D = Dual<double, width>;
    const auto stride = static_cast<std::size_t>(1 + d), from = static_cast<std::size_t>(1 + first);
    const auto used = static_cast<std::size_t>(std::min(width, d - first));
    const auto gather = [&](std::span<const double> values, auto& duals) {
      for (std::size_t i = 0; i < duals.size(); ++i) {
        duals[i].value = values[i * stride];
        for (std::size_t j = 0; j < used; ++j) duals[i].gradient[j] = values[i * stride + from + j];
      }
    };
    Vec<D, F::states> state{};
    Vec<D, F::parameters> parameter{};
    gather(z, state);
    gather(p, parameter);
    const auto r = field_.rates(D(t), state, parameter);
    std::size_t place = 0;
    const auto scatter_entries = [&](const auto& duals) {
      for (const D& dual : duals) {
        rates[place] = dual.value;
        for (std::size_t j = 0; j < used; ++j) rates[place + from + j] = dual.gradient[j];
        place += stride;
      }
    };
    scatter_entries(r.state);
    scatter_entries(r.quadrature);
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
