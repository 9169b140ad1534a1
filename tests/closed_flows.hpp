/// \file
/// Vector fields whose flow is known in closed form, for tests of everything that integrates.
///
/// Each has `solution(t0, t1, z0, p)`: the state at t1 of the orbit through z0 at t0, and the quadratures from t0 to t1. It is
/// a generic function, so that dual numbers give exact sensitivities with respect to everything, both end times included.
#pragma once

#include <costate/field.hpp>
#include <costate/flow.hpp>

#include <initializer_list>
#include <stdexcept>
#include <string>

namespace costate::closed {

/// x'' = −ω²x and ∫x dt. For ω = 1 the flow is a rotation.
struct Oscillator {
  static constexpr int states = 2, parameters = 1, quadratures = 1;
  template <class S>
  Rates<S, 2, 1> rates(const S&, const Vec<S, 2>& z, const Vec<S, 1>& p) const {
    const auto& [x, v] = z;
    return {{v, -p[0] * p[0] * x}, {x}};
  }
  template <class S>
  static Rates<S, 2, 1> solution(const S& t0, const S& t1, const Vec<S, 2>& z0, const Vec<S, 1>& p) {
    const auto& [x, v] = z0;
    const S& omega = p[0];
    const S c = cos(omega * (t1 - t0)), s = sin(omega * (t1 - t0));
    return {{x * c + v * s / omega, v * c - omega * x * s}, {x * s / omega + v * (1.0 - c) / (omega * omega)}};
  }
};

/// Rotation at the rate a cos t: time enters the right-hand side, and that of the quadrature.
struct ModulatedRotation {
  static constexpr int states = 2, parameters = 1, quadratures = 1;
  template <class S>
  Rates<S, 2, 1> rates(const S& t, const Vec<S, 2>& z, const Vec<S, 1>& p) const {
    const S rate = p[0] * cos(t);
    return {{-rate * z[1], rate * z[0]}, {rate * z[0]}};
  }
  template <class S>
  static Rates<S, 2, 1> solution(const S& t0, const S& t1, const Vec<S, 2>& z0, const Vec<S, 1>& p) {
    const S angle = p[0] * (sin(t1) - sin(t0));
    const S c = cos(angle), s = sin(angle);
    const Vec<S, 2> z1{z0[0] * c - z0[1] * s, z0[0] * s + z0[1] * c};
    return {z1, {z1[1] - z0[1]}};
  }
};

/// z' = −λ(z − cos t) − sin t of Prothero and Robinson: stiff for large λ, the solution cos t is smooth.
struct StiffRelaxation {
  static constexpr int states = 1, parameters = 1, quadratures = 1;
  template <class S>
  Rates<S, 1, 1> rates(const S& t, const Vec<S, 1>& z, const Vec<S, 1>& p) const {
    return {{-p[0] * (z[0] - cos(t)) - sin(t)}, {z[0]}};
  }
  template <class S>
  static Rates<S, 1, 1> solution(const S& t0, const S& t1, const Vec<S, 1>& z0, const Vec<S, 1>& p) {
    const S offset = z0[0] - cos(t0);
    const S decay = exp(-p[0] * (t1 - t0));
    return {{cos(t1) + offset * decay}, {sin(t1) - sin(t0) + offset * (1.0 - decay) / p[0]}};
  }
};

/// z' = z², which is infinite at t = t0 + 1/z0.
struct FiniteEscape {
  static constexpr int states = 1, parameters = 0, quadratures = 0;
  template <class S>
  Rates<S, 1, 0> rates(const S&, const Vec<S, 1>& z, const Vec<S, 0>&) const {
    return {{z[0] * z[0]}, {}};
  }
  template <class S>
  static Rates<S, 1, 0> solution(const S& t0, const S& t1, const Vec<S, 1>& z0, const Vec<S, 0>&) {
    return {{z0[0] / (1.0 - z0[0] * (t1 - t0))}, {}};
  }
};

/// z' = 1 with ∫cos pt dt: nothing but the quadrature limits the step.
struct FastQuadrature {
  static constexpr int states = 1, parameters = 1, quadratures = 1;
  template <class S>
  Rates<S, 1, 1> rates(const S& t, const Vec<S, 1>&, const Vec<S, 1>& p) const {
    return {{S(1.0)}, {cos(p[0] * t)}};
  }
  template <class S>
  static Rates<S, 1, 1> solution(const S& t0, const S& t1, const Vec<S, 1>& z0, const Vec<S, 1>& p) {
    return {{z0[0] + t1 - t0}, {(sin(p[0] * t1) - sin(p[0] * t0)) / p[0]}};
  }
};

/// x' = 1, y' = √(1 − x), which is real up to x = 1 only.
struct RootBorder {
  static constexpr int states = 2, parameters = 0, quadratures = 0;
  template <class S>
  Rates<S, 2, 0> rates(const S&, const Vec<S, 2>& z, const Vec<S, 0>&) const {
    return {{S(1.0), sqrt(1.0 - z[0])}, {}};
  }
};

/// z' = z, but a table ends at t = p. It says so once: a second attempt of the integrator would succeed.
struct EndingTable {
  static constexpr int states = 1, parameters = 1, quadratures = 1;
  int* complaints = nullptr;
  template <class S>
  Rates<S, 1, 1> rates(const S& t, const Vec<S, 1>& z, const Vec<S, 1>& p) const {
    if (t > p[0] && ++*complaints == 1) throw std::out_of_range("the table ends here");
    return {{z[0]}, {z[0]}};
  }
};

inline Eigen::VectorXd vector(std::initializer_list<double> values) {
  return Eigen::Map<const Eigen::VectorXd>(values.begin(), static_cast<Eigen::Index>(values.size()));
}
inline double largest(const Eigen::MatrixXd& m) { return m.size() == 0 ? 0.0 : m.cwiseAbs().maxCoeff(); }
inline FlowOptions options(Method method, double tolerance) {
  return {.tolerance = {tolerance, tolerance}, .method = method, .max_steps = 200000};
}

inline std::string name(Method method) {
  return method == Method::adams ? "adams" : method == Method::bdf ? "bdf" : "runge_kutta";
}

/// A flow's end and its derivatives in all directions (z0, p, t0, t1), in this order, from the closed form.
template <class F>
struct Exact {
  static constexpr int n = F::states, m = F::parameters, k = F::quadratures;
  static constexpr int t0_column = n + m, t1_column = n + m + 1;
  Eigen::VectorXd state{n}, quadrature{k};
  Eigen::MatrixXd state_derivative{n, n + m + 2}, quadrature_derivative{k, n + m + 2};

  Exact(double t0, double t1, const Eigen::VectorXd& z0, const Eigen::VectorXd& p) {
    using D = Dual<double, n + m + 2>;
    Vec<D, n> z{};
    Vec<D, m> q{};
    for (int i = 0; i < n; ++i) z[static_cast<std::size_t>(i)] = D::variable(z0[i], i);
    for (int i = 0; i < m; ++i) q[static_cast<std::size_t>(i)] = D::variable(p[i], n + i);
    const auto end = F::solution(D::variable(t0, t0_column), D::variable(t1, t1_column), z, q);
    store(end.state, state, state_derivative);
    store(end.quadrature, quadrature, quadrature_derivative);
  }

 private:
  template <class D, std::size_t N>
  static void store(const std::array<D, N>& from, Eigen::VectorXd& value, Eigen::MatrixXd& derivative) {
    for (std::size_t i = 0; i < N; ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      value[row] = from[i].value;
      for (Eigen::Index j = 0; j < n + m + 2; ++j) derivative(row, j) = from[i].gradient[static_cast<std::size_t>(j)];
    }
  }
};

/// All initial states and all parameters as directions: unit matrices.
inline Directions all_directions(const Field& field) {
  const int n = field.states(), m = field.parameters();
  Directions all{Eigen::MatrixXd::Zero(n, n + m), Eigen::MatrixXd::Zero(m, n + m)};
  all.state.leftCols(n).setIdentity();
  all.parameter.rightCols(m).setIdentity();
  return all;
}

inline Directions no_directions(const Field& field) {
  return {Eigen::MatrixXd(field.states(), 0), Eigen::MatrixXd(field.parameters(), 0)};
}

}  // namespace costate::closed
