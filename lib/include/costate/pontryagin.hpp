/// \file
/// From a model and a control law to the state–costate flow of Pontryagin's maximum principle.
///
/// A model states the dynamics q' = f(q, u, p) and the running cost L(q, u, p) (default 1: minimum time), once, on a generic
/// scalar. With the convention of this project, H = −L + λ·f is maximised over u, and H ≡ 0 if the final time is free.
/// A law gives the control of one kind of arc, u = u(q, λ, p), and, where that arc moves along a mixed constraint
/// C(q, u, p) = 0, the constraint. The flow is
///
///     q' = f(q, u, p),   λ' = −H_q(q, λ, u, p) − ν C_q(q, u, p),   ν = −H_u / C_u,
///
/// differentiated **at frozen control**, into which the law is inserted afterwards: right also where H_u ≠ 0, as on constrained
/// and singular arcs. Costate equations and Jacobians are never written by hand.
///
/// The first `cyclic` states enter neither f nor L (a position in a homogeneous field): their costates are constants of the
/// motion and become parameters, and they themselves become quadratures. The integrated state is z = (q_rest, λ_rest), the
/// parameters are (λ_cyclic, p).
///
/// Reference: Bryson & Ho, Applied Optimal Control, 1975, §§2.3, 3.2–3.3.
#pragma once

#include <costate/field.hpp>

namespace costate {

/// A controlled system: sizes and `dynamics(q, u, p)` on a generic scalar.
template <class M>
concept Model = requires(const M model, Vec<double, M::states> q, Vec<double, M::controls> u, Vec<double, M::parameters> p) {
  { M::cyclic } -> std::convertible_to<int>;
  { model.dynamics(q, u, p) } -> std::same_as<Vec<double, M::states>>;
};

/// The control of one kind of arc: `control(q, λ, p)` on a generic scalar.
template <class L, class M>
concept Law = Model<M> && requires(const L law, Vec<double, M::states> q, Vec<double, M::parameters> p) {
  { law.control(q, q, p) } -> std::same_as<Vec<double, M::controls>>;
};

/// Running cost of a model that states none: 1, the cost of time.
template <class M, class S, class Q, class U, class P>
S running_cost(const M& model, const Q& q, const U& u, const P& p) {
  if constexpr (requires { model.cost(q, u, p); }) {
    return model.cost(q, u, p);
  } else {
    return S(1.0);
  }
}

/// H = −L + λ·f.
template <Model M, class S>
S hamiltonian(const M& model, const Vec<S, M::states>& q, const Vec<S, M::states>& costate, const Vec<S, M::controls>& u,
              const Vec<S, M::parameters>& p) {
  return dot(costate, model.dynamics(q, u, p)) - running_cost<M, S>(model, q, u, p);
}

/// The state–costate vector field of a model under a law.
template <Model M, Law<M> L>
class Pontryagin {
 public:
  static constexpr int free_states = M::states - M::cyclic;
  static constexpr int states = 2 * free_states;
  static constexpr int parameters = M::cyclic + M::parameters;
  static constexpr int quadratures = M::cyclic;

  constexpr Pontryagin() = default;
  explicit constexpr Pontryagin(M model, L law = {}) : model_(model), law_(law) {}

  /// A point of the flow in the model's own terms. The cyclic states are reported as 0: nothing depends on them.
  template <class S>
  struct Point {
    Vec<S, M::states> state{};
    Vec<S, M::states> costate{};
    Vec<S, M::parameters> parameter{};
    Vec<S, M::controls> control{};
  };

  template <class S>
  Point<S> point(const Vec<S, states>& z, const Vec<S, parameters>& p) const {
    Point<S> at;
    for (std::size_t i = 0; i < M::cyclic; ++i) at.costate[i] = p[i];
    for (std::size_t i = 0; i < free_states; ++i) {
      at.state[i + M::cyclic] = z[i];
      at.costate[i + M::cyclic] = z[i + free_states];
    }
    for (std::size_t i = 0; i < M::parameters; ++i) at.parameter[i] = p[i + M::cyclic];
    at.control = law_.control(at.state, at.costate, at.parameter);
    return at;
  }

  template <class S>
  Rates<S, states, quadratures> rates(const S&, const Vec<S, states>& z, const Vec<S, parameters>& p) const {
    const Point<S> at = point(z, p);
    using D = Dual<S, free_states>;
    auto q = lift<D>(at.state);
    for (int i = 0; i < free_states; ++i) {
      const auto k = static_cast<std::size_t>(i + M::cyclic);
      q[k] = D::variable(at.state[k], i);
    }
    const auto u = lift<D>(at.control);
    const auto parameter = lift<D>(at.parameter);
    const auto f = model_.dynamics(q, u, parameter);
    D h = dot(f, lift<D>(at.costate)) - running_cost<M, D>(model_, q, u, parameter);
    if constexpr (constrained) h += D(constraint_multiplier(at)) * law_.constraint(q, u, parameter);

    Rates<S, states, quadratures> r{};
    for (std::size_t i = 0; i < M::cyclic; ++i) r.quadrature[i] = f[i].value;
    for (std::size_t i = 0; i < free_states; ++i) {
      r.state[i] = f[i + M::cyclic].value;
      r.state[i + free_states] = -h.gradient[i];
    }
    return r;
  }

  /// H along the flow.
  double hamiltonian(const Vec<double, states>& z, const Vec<double, parameters>& p) const {
    const auto at = point(z, p);
    return costate::hamiltonian(model_, at.state, at.costate, at.control, at.parameter);
  }

 private:
  static constexpr bool constrained =
      requires(const L law, Vec<double, M::states> q, Vec<double, M::controls> u, Vec<double, M::parameters> p) {
        { law.constraint(q, u, p) } -> std::same_as<double>;
      };

  /// ν from H_u + ν C_u = 0.
  template <class S>
  S constraint_multiplier(const Point<S>& at) const
    requires(M::controls == 1)
  {
    using D = Dual<S, 1>;
    const auto q = lift<D>(at.state);
    const Vec<D, 1> u{D::variable(at.control[0], 0)};
    const auto parameter = lift<D>(at.parameter);
    const D h = costate::hamiltonian(model_, q, lift<D>(at.costate), u, parameter);
    return -(h.gradient[0] / law_.constraint(q, u, parameter).gradient[0]);
  }

  M model_{};
  L law_{};
};

}  // namespace costate
