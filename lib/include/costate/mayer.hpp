/// \file
/// A controlled system as its user states it, and its Mayer form, on which everything derived from it is written.
///
/// A system is q' = f(q, u, p) with running cost L(q, u, p) (1 if it states none: minimum time), on a generic scalar. Its Mayer
/// form has one more state, the cost spent so far, J' = L, placed first, and no running cost. J enters neither f nor L, so it is
/// cyclic: Pontryagin<M, L> carries it as a quadrature and its costate as a constant, which is −1 in a normal problem. Then
/// H = λ·f − L is the plain product of costate and dynamics. The bounds of the controls follow the system's own parameters, so
/// that a solution can be continued in them too.
///
/// Reference: Bryson & Ho, Applied Optimal Control, 1975, §2.7 (Mayer, Lagrange and Bolza forms).
#pragma once

#include <costate/pontryagin.hpp>
#include <costate/smooth_map.hpp>

#include <algorithm>

namespace costate {

/// Sizes and `dynamics(q, u, p)` on a generic scalar; `cost(q, u, p)` and `cyclic` are optional. The first `cyclic` states enter
/// neither f nor L.
template <class M>
concept ControlledSystem = requires(const M model, Vec<double, M::states> q, Vec<double, M::controls> u,
                                    Vec<double, M::parameters> p) {
  { model.dynamics(q, u, p) } -> std::same_as<Vec<double, M::states>>;
};

/// Number of cyclic states; 0 where a system states none.
template <class M>
constexpr int cyclic_states() {
  if constexpr (requires { M::cyclic; }) {
    return M::cyclic;
  } else {
    return 0;
  }
}

/// (J, q)' = (L, f). Parameters: p, then lower and upper bound of each control in turn.
template <ControlledSystem M>
struct MayerForm {
  static constexpr int states = M::states + 1, cyclic = cyclic_states<M>() + 1, controls = M::controls;
  static constexpr int parameters = M::parameters + 2 * M::controls;

  M system{};

  /// The system's own part of states or parameters.
  template <class S>
  static Vec<S, M::states> own_states(const Vec<S, states>& q) {
    Vec<S, M::states> own{};
    for (std::size_t i = 0; i < own.size(); ++i) own[i] = q[i + 1];
    return own;
  }
  template <class S>
  static Vec<S, M::parameters> own_parameters(const Vec<S, parameters>& p) {
    Vec<S, M::parameters> own{};
    for (std::size_t i = 0; i < own.size(); ++i) own[i] = p[i];
    return own;
  }
  template <class S>
  static const S& lower(const Vec<S, parameters>& p, std::size_t control) {
    return p[static_cast<std::size_t>(M::parameters) + 2 * control];
  }
  template <class S>
  static const S& upper(const Vec<S, parameters>& p, std::size_t control) {
    return p[static_cast<std::size_t>(M::parameters) + 2 * control + 1];
  }

  template <class S>
  Vec<S, states> dynamics(const Vec<S, states>& q, const Vec<S, controls>& u, const Vec<S, parameters>& p) const {
    const auto own_q = own_states(q);
    const auto own_p = own_parameters(p);
    const auto f = system.dynamics(own_q, u, own_p);
    Vec<S, states> r{};
    r[0] = running_cost<M, S>(system, own_q, u, own_p);
    for (std::size_t i = 0; i < f.size(); ++i) r[i + 1] = f[i];
    return r;
  }
  template <class S>
  S cost(const Vec<S, states>&, const Vec<S, controls>&, const Vec<S, parameters>&) const {
    return S(0.0);
  }
};

/// H_u (k) of a model at (q, λ, u, p).
template <Model M, class S>
Vec<S, M::controls> control_gradient(const M& model, const Vec<S, M::states>& q, const Vec<S, M::states>& costate,
                                     const Vec<S, M::controls>& u, const Vec<S, M::parameters>& p) {
  using D = Dual<S, M::controls>;
  Vec<D, M::controls> moving{};
  for (int i = 0; i < M::controls; ++i) moving[static_cast<std::size_t>(i)] = D::variable(u[static_cast<std::size_t>(i)], i);
  return hamiltonian(model, lift<D>(q), lift<D>(costate), moving, lift<D>(p)).gradient;
}

/// (f, L) of a system (n + 1 rows).
template <ControlledSystem M>
std::shared_ptr<const SmoothMap> system_map(const M& system) {
  constexpr int n = M::states, k = M::controls, m = M::parameters;
  return smooth_map<n, k, m, n + 1>([system]<class S>(const Vec<S, n>& q, const Vec<S, k>& u, const Vec<S, m>& p) {
    const auto f = system.dynamics(q, u, p);
    Vec<S, n + 1> r{};
    std::copy(f.begin(), f.end(), r.begin());
    r[n] = running_cost<M, S>(system, q, u, p);
    return r;
  });
}

}  // namespace costate
