/// \file
/// What every model with its control law must satisfy, whatever it models. A model joins by one line in conformance_test.cpp.
#pragma once

#include <costate/flow.hpp>
#include <costate/pontryagin.hpp>

#include <cmath>
#include <functional>
#include <gtest/gtest.h>
#include <numbers>
#include <string>
#include <vector>

namespace costate::test {

/// A point of an extremal, and what is needed to judge the law there. The model must be one of minimum time.
template <class M, class L>
struct Specimen {
  using State = Vec<double, M::states>;
  using Control = Vec<double, M::controls>;
  using Parameters = Vec<double, M::parameters>;

  State state, costate;  ///< the costate up to a factor, which H = 0 fixes
  Parameters parameter;
  double duration;  ///< of the arc that starts there
  /// Admissible controls near and far, among which the law must be the best.
  std::function<std::vector<Control>(const State&, const Parameters&)> controls;
  L law = {};
};

/// A grid over an interval of one control.
inline std::vector<Vec<double, 1>> grid(double from, double to, int cells = 720) {
  std::vector<Vec<double, 1>> controls;
  for (int i = 0; i <= cells; ++i) controls.push_back({std::lerp(from, to, static_cast<double>(i) / cells)});
  return controls;
}

/// Every direction of the plane, for laws whose control is an angle.
inline constexpr auto angles = [](const auto&, const auto&) { return grid(-std::numbers::pi, std::numbers::pi); };

template <class M, class L>
class Conformance {
 public:
  explicit Conformance(Specimen<M, L> specimen) : s_(std::move(specimen)), flow_(M{}, s_.law), field_(flow_) {
    // A law of a minimum-time problem depends on the direction of λ alone, so H + 1 is proportional to λ.
    const double power = H(s_.state, s_.costate, control(s_.state, s_.costate)) + 1.0;
    EXPECT_GT(power, 0.0) << "the costate of the specimen points the wrong way";
    for (double& component : s_.costate) component /= power;
  }

  void all() {
    costate_equations();
    law_is_stationary_and_best();
    hamiltonian_vanishes();
    sensitivities();
  }

 private:
  static constexpr auto n = static_cast<std::size_t>(M::states);
  static constexpr auto cyclic = static_cast<std::size_t>(M::cyclic);
  static constexpr std::size_t rest = n - cyclic;
  using State = typename Specimen<M, L>::State;
  using Control = typename Specimen<M, L>::Control;
  using Flow_ = Pontryagin<M, L>;
  static constexpr bool constrained =
      requires(const L law, State q, Control u, Vec<double, M::parameters> p) { law.constraint(q, u, p); };

  [[nodiscard]] double H(const State& q, const State& costate, const Control& u) const {
    return hamiltonian(M{}, q, costate, u, s_.parameter);
  }
  [[nodiscard]] Control control(const State& q, const State& costate) const { return s_.law.control(q, costate, s_.parameter); }

  [[nodiscard]] Vec<double, Flow_::states> start() const {
    Vec<double, Flow_::states> z{};
    for (std::size_t i = 0; i < rest; ++i) {
      z[i] = s_.state[i + cyclic];
      z[i + rest] = s_.costate[i + cyclic];
    }
    return z;
  }
  [[nodiscard]] Vec<double, Flow_::parameters> constants() const {
    Vec<double, Flow_::parameters> p{};
    for (std::size_t i = 0; i < cyclic; ++i) p[i] = s_.costate[i];
    for (std::size_t i = 0; i < s_.parameter.size(); ++i) p[i + cyclic] = s_.parameter[i];
    return p;
  }
  template <std::size_t N>
  static Eigen::VectorXd vector(const std::array<double, N>& a) {
    return Eigen::Map<const Eigen::VectorXd>(a.data(), static_cast<Eigen::Index>(N));
  }

  /// λ' = −∂H/∂q at frozen control, and on a constrained arc −ν ∂C/∂q more; ∂H/∂q = 0 for the cyclic states.
  void costate_equations() {
    const Control u = control(s_.state, s_.costate);
    const auto rates = flow_.template rates<double>(0.0, start(), constants());
    for (std::size_t i = 0; i < n; ++i) {
      const double h = 1e-5 * std::max(1.0, std::abs(s_.state[i]));
      const auto slope = [&](const auto& function) {
        State ahead = s_.state, behind = s_.state;
        ahead[i] += h;
        behind[i] -= h;
        return (function(ahead) - function(behind)) / (2.0 * h);
      };
      double wanted = -slope([&](const State& q) { return H(q, s_.costate, u); });
      if constexpr (constrained) {
        const auto along = [&](double du, const auto& function) { return function(Control{u[0] + du}); };
        const auto rate = [&](const auto& function) { return (along(h, function) - along(-h, function)) / (2.0 * h); };
        const double nu = -rate([&](const Control& v) { return H(s_.state, s_.costate, v); }) /
                          rate([&](const Control& v) { return s_.law.constraint(s_.state, v, s_.parameter); });
        wanted -= nu * slope([&](const State& q) { return s_.law.constraint(q, u, s_.parameter); });
      }
      // Central differences: h² times a third derivative, and rounding over h.
      const double got = i < cyclic ? 0.0 : rates.state[i - cyclic + rest];
      EXPECT_NEAR(got, wanted, 1e-7 * std::max(1.0, std::abs(wanted))) << "costate " << i;
    }
  }

  /// The law maximises H over all admissible controls: nothing on the grid is better, and inside the admissible set H_u = 0 with
  /// H_uu < 0 (strict Legendre–Clebsch).
  void law_is_stationary_and_best() {
    const Control u = control(s_.state, s_.costate);
    const double best = H(s_.state, s_.costate, u);
    EXPECT_NEAR(best, 0.0, 1e-13);
    const auto others = s_.controls(s_.state, s_.parameter);
    ASSERT_GT(others.size(), 100u);
    double worst = -1e300;
    for (const Control& other : others) worst = std::max(worst, H(s_.state, s_.costate, other));
    EXPECT_LE(worst, 1e-12);
    EXPECT_GE(worst, -0.1) << "the grid does not come near the law's control: it tests nothing";
    if constexpr (!constrained && M::controls == 1) {
      using Inner = Dual<double, 1>;
      using D = Dual<Inner, 1>;
      const Vec<D, 1> seeded{D::variable(Inner::variable(u[0], 0), 0)};
      const D h = hamiltonian(M{}, lift<D>(lift<Inner>(s_.state)), lift<D>(lift<Inner>(s_.costate)), seeded,
                              lift<D>(lift<Inner>(s_.parameter)));
      EXPECT_NEAR(h.gradient[0].value, 0.0, 1e-12);
      EXPECT_LT(h.gradient[0].gradient[0], -1e-6);
    }
  }

  /// H ≡ 0 along the flow.
  void hamiltonian_vanishes() {
    const double tolerance = 1e-12;
    Flow flow(field_, {.tolerance = {.relative = tolerance, .absolute = tolerance}});
    const auto z0 = start();
    const auto p = constants();
    const Trajectory path = flow.record(0.0, s_.duration, vector(z0), Eigen::VectorXd::Zero(M::cyclic), vector(p));
    for (const Trajectory::Piece& piece : path.pieces()) {
      Vec<double, Flow_::states> z{};
      for (std::size_t i = 0; i < z.size(); ++i) z[i] = piece.taylor(static_cast<Eigen::Index>(i), 0);
      EXPECT_NEAR(flow_.hamiltonian(z, p), 0.0, 100.0 * tolerance) << "t = " << piece.node;
    }
  }

  /// ∂z(T)/∂(z₀, p) of the variational equations against central differences of the flow itself.
  void sensitivities() {
    const Eigen::VectorXd z0 = vector(start()), p0 = vector(constants());
    const Eigen::Index states = z0.size(), parameters = p0.size(), all = states + parameters;
    Directions unit{Eigen::MatrixXd::Zero(states, all), Eigen::MatrixXd::Zero(parameters, all)};
    unit.state.leftCols(states).setIdentity();
    unit.parameter.rightCols(parameters).setIdentity();
    Flow flow(field_, {.tolerance = {.relative = 1e-13, .absolute = 1e-14}});
    const FlowEnd exact = flow.run(0.0, s_.duration, z0, p0, unit);
    const Directions none{Eigen::MatrixXd(states, 0), Eigen::MatrixXd(parameters, 0)};
    for (Eigen::Index j = 0; j < all; ++j) {
      const double size = j < states ? std::abs(z0[j]) : std::abs(p0[j - states]);
      const double h = 1e-4 * std::max(size, 1e-2);
      const auto moved = [&](double by) {
        Eigen::VectorXd z = z0, p = p0;
        (j < states ? z[j] : p[j - states]) += by;
        const FlowEnd& end = flow.run(0.0, s_.duration, z, p, none);
        Eigen::VectorXd both(states + M::cyclic);
        both << end.state, end.quadrature;
        return both;
      };
      // Richardson's extrapolation of central differences: error h⁴, and the noise of the integration over h.
      const Eigen::VectorXd wide = (moved(2.0 * h) - moved(-2.0 * h)) / (4.0 * h);
      const Eigen::VectorXd narrow = (moved(h) - moved(-h)) / (2.0 * h);
      const Eigen::VectorXd difference = (4.0 * narrow - wide) / 3.0;
      Eigen::VectorXd got(states + M::cyclic);
      got << exact.state_directions.col(j), exact.quadrature_directions.col(j);
      const double scale = std::max(1.0, got.cwiseAbs().maxCoeff());
      EXPECT_LE((got - difference).cwiseAbs().maxCoeff(), 3e-7 * scale) << "direction " << j;
    }
  }

  Specimen<M, L> s_;
  Flow_ flow_;
  FieldOf<Flow_> field_;
};

template <class M, class L>
void conforms(Specimen<M, L> specimen) {
  Conformance<M, L>(std::move(specimen)).all();
}

}  // namespace costate::test
