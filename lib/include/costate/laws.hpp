/// \file
/// Control laws derived from a model: interior, bang, and along a constraint. Each is a Law on the MayerForm of a system.
///
/// Reference: Bryson & Ho, Applied Optimal Control, 1975, §§3.3, 3.9–3.11.
#pragma once

#include <costate/implicit.hpp>
#include <costate/mayer.hpp>

#include <Eigen/Cholesky>
#include <algorithm>
#include <memory>
#include <string>
#include <utility>

namespace costate {

/// Where a search for a control starts, and a typical magnitude of the control.
template <int k>
struct ControlSearch {
  Vec<double, k> start{};
  Vec<double, k> scale{};
  Vec<std::string, k> name{};
};

/// An interval from `start`, stepping in `direction` by `step` and then twice as far each time, at whose ends f differs in sign.
/// \throws LeftDomain if there is none within 2⁶⁰ steps, or f is not a number on the way, naming the control and `what` it should meet.
template <class F>
std::pair<double, double> expanding_bracket(const F& f, double start, double step, double direction,
                                            const std::string& control, const char* what) {
  const double first = f(start);
  double a = start, b = start;
  for (int i = 0; i < 60 && isfinite(first); ++i) {
    b += direction * step;
    const double value = f(b);
    if (!isfinite(value)) throw LeftDomain("no number on the way to a control " + control + " with " + what);
    if (first == 0.0 || value == 0.0 || (value < 0.0) != (first < 0.0)) return std::minmax({a, b});
    a = b;
    step *= 2.0;
  }
  throw LeftDomain("there is no control " + control + " with " + what);
}

/// The root of a function of one control, f(u; c), from a start. The side to search on is where f falls to zero (`falling`: f is a
/// gradient and its zero a maximum) or where Newton's method points; Newton's step, where it points there, sizes the first step.
template <class S, std::size_t n, class F>
S control_root(const F& f, const std::array<S, n>& c, double start, double scale, bool falling, const std::string& control,
               const char* what) {
  using D = Dual<double, 1>;
  const auto numbers = primal(c);
  const D at = f(D::variable(start, 0), lift<D>(numbers));
  const double newton = -at.value / at.gradient[0];
  const double direction = (falling ? at.value : newton) < 0.0 ? -1.0 : 1.0;
  const bool useful = newton * direction > 0.0 && 1.5 * std::abs(newton) < scale;
  const auto value = [&](double u) { return f(u, numbers); };
  const auto [lower, upper] = expanding_bracket(value, start, useful ? 1.5 * std::abs(newton) : scale, direction, control,
                                                what);
  return implicit_root(f, c, lower, upper);
}

/// (q, λ, p) in one vector, and back.
template <class W, class S>
auto packed(const Vec<S, W::states>& q, const Vec<S, W::states>& costate, const Vec<S, W::parameters>& p) {
  Vec<S, 2 * W::states + W::parameters> c{};
  std::copy(p.begin(), p.end(), std::copy(costate.begin(), costate.end(), std::copy(q.begin(), q.end(), c.begin())));
  return c;
}
template <class W, class S>
struct Unpacked {
  Vec<S, W::states> state{}, costate{};
  Vec<S, W::parameters> parameter{};
  explicit Unpacked(const Vec<S, 2 * W::states + W::parameters>& c) {
    std::copy_n(c.begin(), state.size(), state.begin());
    std::copy_n(c.begin() + state.size(), costate.size(), costate.begin());
    std::copy_n(c.begin() + 2 * state.size(), parameter.size(), parameter.begin());
  }
};

/// H_u = 0 at a maximum of H: for one control between sign changes of H_u, found uphill from the start; for several by Newton's
/// method, damped until H grows. The bounds are not imposed: a control beyond them is seen by the path checks.
template <class W>
struct InteriorLaw {
  W model{};
  ControlSearch<W::controls> search{};

  template <class S>
  Vec<S, W::controls> control(const Vec<S, W::states>& q, const Vec<S, W::states>& costate,
                              const Vec<S, W::parameters>& p) const {
    if constexpr (W::controls == 1) {
      const auto h_u = [this]<class T>(const T& u, const Vec<T, 2 * W::states + W::parameters>& c) {
        const Unpacked<W, T> at(c);
        return control_gradient<W, T>(model, at.state, at.costate, {u}, at.parameter)[0];
      };
      return {control_root(h_u, packed<W, S>(q, costate, p), search.start[0], search.scale[0], true, search.name[0],
                           "H_u = 0: H grows without bound: give it bounds")};
    } else {
      return climb(q, costate, p);
    }
  }

 private:
  static constexpr int k = W::controls;
  using Vector = Eigen::Matrix<double, k, 1>;
  using Matrix = Eigen::Matrix<double, k, k>;
  struct Expansion {
    double value;
    Vector gradient;
    Matrix hessian;
  };

  Expansion expand(const Vec<double, W::states>& q, const Vec<double, W::states>& costate, const Vec<double, k>& u,
                   const Vec<double, W::parameters>& p) const {
    using D = Dual<double, k>;
    Vec<D, k> moving{};
    for (std::size_t i = 0; i < k; ++i) moving[i] = D::variable(u[i], static_cast<int>(i));
    const auto g = control_gradient<W, D>(model, lift<D>(q), lift<D>(costate), moving, lift<D>(p));
    Expansion r{hamiltonian<W, double>(model, q, costate, u, p), {}, {}};
    for (Eigen::Index i = 0; i < k; ++i) {
      r.gradient[i] = g[static_cast<std::size_t>(i)].value;
      for (Eigen::Index j = 0; j < k; ++j)
        r.hessian(i, j) = g[static_cast<std::size_t>(i)].gradient[static_cast<std::size_t>(j)];
    }
    return r;
  }

  /// One step uphill: Newton's where H is concave, else as much of the gradient as makes it so; halved until H grows.
  /// Returns its size in scales.
  double step(Expansion& at, const Vec<double, W::states>& q, const Vec<double, W::states>& costate, Vec<double, k>& u,
              const Vec<double, W::parameters>& p) const {
    double shift = 0.0;
    Eigen::LLT<Matrix> factor(-at.hessian);
    while (factor.info() != Eigen::Success && shift < 1e12 * (1.0 + at.hessian.norm())) {
      shift = std::max(2.0 * shift, 1e-3 * (at.hessian.norm() + at.gradient.norm()));
      factor.compute(shift * Matrix::Identity() - at.hessian);
    }
    const Vector along = factor.solve(at.gradient);
    double size = 0.0;
    for (std::size_t i = 0; i < k; ++i)
      size = std::max(size, std::abs(along[static_cast<Eigen::Index>(i)]) / search.scale[i]);
    if (!isfinite(size)) throw LeftDomain("the search for a maximum of H over the controls met a value that is no number");
    for (double part = std::min(1.0, 2.0 / size); part * size > 1e-15; part *= 0.5) {
      Vec<double, k> next = u;
      for (std::size_t i = 0; i < k; ++i) next[i] += part * along[static_cast<Eigen::Index>(i)];
      const Expansion there = expand(q, costate, next, p);
      // Close to the maximum H itself says nothing any more, and the whole step is right.
      if (there.value >= at.value || (size < 1e-5 && part == 1.0)) {
        u = next;
        at = there;
        return part * size;
      }
    }
    return 0.0;
  }

  template <class S>
  Vec<S, k> climb(const Vec<S, W::states>& q, const Vec<S, W::states>& costate, const Vec<S, W::parameters>& p) const {
    Vec<double, k> u = search.start;
    const auto numbers_q = primal(q);
    const auto numbers_costate = primal(costate);
    const auto numbers_p = primal(p);
    Expansion at = expand(numbers_q, numbers_costate, u, numbers_p);
    double before = std::numeric_limits<double>::infinity();
    for (int i = 0; i < 100; ++i) {
      const double size = step(at, numbers_q, numbers_costate, u, numbers_p);
      // Quadratic convergence ends in rounding: the steps no longer shrink.
      if (size == 0.0 || (size < 1e-8 && size >= 0.5 * before)) break;
      before = size;
      if (i == 99) throw LeftDomain("no maximum of H over the controls was found in 100 steps");
    }
    // Each step with the plain Hessian makes one more order of derivatives exact, as in implicit_root.
    Vec<S, k> result = lift<S>(u);
    if constexpr (nesting < S >> 0) {
      const Matrix inverse = at.hessian.inverse();
      for (int order = 0; order < nesting<S>; ++order) {
        const auto g = control_gradient<W, S>(model, q, costate, result, p);
        for (std::size_t i = 0; i < k; ++i) {
          for (std::size_t j = 0; j < k; ++j) {
            result[i] = result[i] - inverse(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) * g[j];
          }
        }
      }
    }
    return result;
  }
};

/// Every control at its upper or at its lower bound.
template <class W>
struct BoundLaw {
  bool upper = true;
  template <class S>
  Vec<S, W::controls> control(const Vec<S, W::states>&, const Vec<S, W::states>&, const Vec<S, W::parameters>& p) const {
    Vec<S, W::controls> u{};
    for (std::size_t i = 0; i < u.size(); ++i) u[i] = upper ? W::upper(p, i) : W::lower(p, i);
    return u;
  }
};

/// Constant controls.
template <class W>
struct ConstantLaw {
  Vec<double, W::controls> values{};
  template <class S>
  Vec<S, W::controls> control(const Vec<S, W::states>&, const Vec<S, W::states>&, const Vec<S, W::parameters>&) const {
    return lift<S>(values);
  }
};

/// A user's law, `control(q, λ, p)` on the system itself.
template <class W, class L>
struct StatedLaw {
  L law{};
  template <class S>
  Vec<S, W::controls> control(const Vec<S, W::states>& q, const Vec<S, W::states>& costate,
                              const Vec<S, W::parameters>& p) const {
    return law.control(W::own_states(q), W::own_states(costate), W::own_parameters(p));
  }
  /// The constraint C(q, u, p) = 0 the law follows, if it states one.
  template <class S>
  S constraint(const Vec<S, W::states>& q, const Vec<S, W::controls>& u, const Vec<S, W::parameters>& p) const requires
      requires(const L l) {
    l.constraint(W::own_states(q), u, W::own_parameters(p));
  }
  { return law.constraint(W::own_states(q), u, W::own_parameters(p)); }
};

/// c^(j), the j-th time derivative of a state constraint c(q, p) along q' = f(q, u, p) at frozen u.
template <int j, class W, class C, class S>
S lie_derivative(const W& model, const C& c, const Vec<S, W::states>& q, const Vec<S, W::controls>& u,
                 const Vec<S, W::parameters>& p) {
  if constexpr (j == 0) {
    return c(W::own_states(q), W::own_parameters(p));
  } else {
    using D = Dual<S, 1>;
    const auto f = model.dynamics(q, u, p);
    auto moving = lift<D>(q);
    for (std::size_t i = 0; i < f.size(); ++i) moving[i].gradient[0] = f[i];
    return lie_derivative<j - 1, W, C, D>(model, c, moving, lift<D>(u), lift<D>(p)).gradient[0];
  }
}

/// Along a state constraint c(q, p) = 0 of order r: u from c^(r)(q, u, p) = 0, which is also the law's constraint.
template <class W, class C, int r>
struct BoundaryLaw {
  static constexpr int order = r;
  std::shared_ptr<const C> limit;
  W model{};
  ControlSearch<1> search{};

  template <class S>
  S constraint(const Vec<S, W::states>& q, const Vec<S, 1>& u, const Vec<S, W::parameters>& p) const {
    return lie_derivative<r>(model, *limit, q, u, p);
  }
  template <class S>
  Vec<S, 1> control(const Vec<S, W::states>& q, const Vec<S, W::states>& costate, const Vec<S, W::parameters>& p) const {
    const auto f = [this]<class T>(const T& u, const Vec<T, 2 * W::states + W::parameters>& c) {
      const Unpacked<W, T> at(c);
      return constraint<T>(at.state, {u}, at.parameter);
    };
    return {control_root(f, packed<W, S>(q, costate, p), search.start[0], search.scale[0], false, search.name[0],
                         "c^(r) = 0 along the constraint")};
  }
};

/// Along a mixed constraint C(q, u, p) = 0.
template <class W, class C>
struct MixedLaw {
  std::shared_ptr<const C> limit;
  W model{};
  ControlSearch<1> search{};

  template <class S>
  S constraint(const Vec<S, W::states>& q, const Vec<S, 1>& u, const Vec<S, W::parameters>& p) const {
    return (*limit)(W::own_states(q), u, W::own_parameters(p));
  }
  template <class S>
  Vec<S, 1> control(const Vec<S, W::states>& q, const Vec<S, W::states>& costate, const Vec<S, W::parameters>& p) const {
    const auto f = [this]<class T>(const T& u, const Vec<T, 2 * W::states + W::parameters>& c) {
      const Unpacked<W, T> at(c);
      return constraint<T>(at.state, {u}, at.parameter);
    };
    return {control_root(f, packed<W, S>(q, costate, p), search.start[0], search.scale[0], false, search.name[0],
                         "C = 0 along the constraint")};
  }
};

/// Along a singular arc of order 1, for H = H₀ + u H₁ affine in one control: H₁ = 0 and its derivative {H₀, H₁} = 0 hold along it,
/// and u follows from the second one, {H₀, {H₀, H₁}} + u {H₁, {H₀, H₁}} = 0. With {A, B} the derivative of B along the Hamiltonian
/// flow of A. Kelley's condition (for a maximum of H): {H₁, {H₀, H₁}} ≥ 0.
///
/// Reference: Kelley, Kopp & Moyer, Singular extremals, in: Topics in Optimization, 1967.
template <class W>
struct SingularLaw {
  W model{};

  template <class S>
  using State = Vec<S, W::states>;
  template <class S>
  using Parameter = Vec<S, W::parameters>;

  template <class S>
  Vec<S, 1> control(const State<S>& q, const State<S>& costate, const Parameter<S>& p) const {
    const S drift = second(q, costate, p, S(0.0));
    return {drift / (drift - second(q, costate, p, S(1.0)))};
  }
  /// d/dt H_u = {H₀, H₁}.
  template <class S>
  S rate(const State<S>& q, const State<S>& costate, const Parameter<S>& p) const {
    const auto [dq, dcostate] = hamiltonian_field(q, costate, S(0.0), p);
    return along(q, costate, dq, dcostate, p, [this]<class T>(const State<T>& x, const State<T>& y, const Parameter<T>& z) {
      return affine_part(x, y, z);
    });
  }
  /// {H₁, {H₀, H₁}}: what u is multiplied by in d²/dt² H_u; and the magnitude of what cancels in it.
  template <class S>
  std::pair<S, S> kelley(const State<S>& q, const State<S>& costate, const Parameter<S>& p) const {
    const S one = second(q, costate, p, S(1.0)), none = second(q, costate, p, S(0.0));
    return {one - none, abs(one) + abs(none)};
  }

 private:
  /// H₁ = H_u.
  template <class S>
  S affine_part(const State<S>& q, const State<S>& costate, const Parameter<S>& p) const {
    return control_gradient<W, S>(model, q, costate, {S(0.0)}, p)[0];
  }
  /// (H_λ, −H_q) at a given control.
  template <class S>
  std::pair<State<S>, State<S>> hamiltonian_field(const State<S>& q, const State<S>& costate, const S& u,
                                                  const Parameter<S>& p) const {
    using D = Dual<S, W::states>;
    State<D> moving{};
    for (int i = 0; i < W::states; ++i) moving[static_cast<std::size_t>(i)] = D::variable(q[static_cast<std::size_t>(i)], i);
    const auto f = model.dynamics(moving, Vec<D, 1>{D(u)}, lift<D>(p));
    std::pair<State<S>, State<S>> r{};
    for (std::size_t i = 0; i < f.size(); ++i) {
      r.first[i] = f[i].value;
      for (std::size_t j = 0; j < f.size(); ++j) r.second[j] = r.second[j] - costate[i] * f[i].gradient[j];
    }
    return r;
  }
  /// d²/dt² H_u at a given control.
  template <class S>
  S second(const State<S>& q, const State<S>& costate, const Parameter<S>& p, const S& u) const {
    const auto [dq, dcostate] = hamiltonian_field(q, costate, u, p);
    return along(q, costate, dq, dcostate, p,
                 [this]<class T>(const State<T>& x, const State<T>& y, const Parameter<T>& z) { return rate(x, y, z); });
  }
  /// The derivative of g(q, λ, p) in a direction.
  template <class S, class G>
  static S along(const State<S>& q, const State<S>& costate, const State<S>& dq, const State<S>& dcostate,
                 const Parameter<S>& p, const G& g) {
    using D = Dual<S, 1>;
    auto moving_q = lift<D>(q);
    auto moving_costate = lift<D>(costate);
    for (std::size_t i = 0; i < q.size(); ++i) {
      moving_q[i].gradient[0] = dq[i];
      moving_costate[i].gradient[0] = dcostate[i];
    }
    return g.template operator()<D>(moving_q, moving_costate, lift<D>(p)).gradient[0];
  }
};

}  // namespace costate
