/// \file
/// One kind of arc of an extremal behind a virtual interface, so that the shooting function above it compiles once.
///
/// Throughout, a point is x = (q, λ, p): states (n) and costates (n) of the system, then the parameters of its Mayer form.
#pragma once

#include <costate/jet_function.hpp>
#include <costate/laws.hpp>

#include <Eigen/Eigenvalues>
#include <functional>
#include <string>
#include <tuple>

namespace costate {

/// What fixes the control of an arc.
enum class ArcKind {
  interior,  ///< H_u = 0
  bang,      ///< bounds or constants
  singular,  ///< d²/dt² H_u = 0 where H is affine in u
  boundary,  ///< c^(r)(q, u) = 0 along a state constraint
  mixed,     ///< C(q, u) = 0
};

/// Numbers at a point of an arc.
struct ArcValues {
  std::vector<double> control;           ///< u (k)
  double hamiltonian = 0.0;              ///< H
  double size = 0.0;                     ///< Σ |λᵢ fᵢ| + |L|: what cancels in H
  std::vector<double> control_gradient;  ///< H_u (k)
  std::vector<double> gradient_size;     ///< Σ |λᵢ ∂fᵢ/∂u| + |L_u| (k): what cancels in H_u
  double curvature = 0.0;                ///< largest eigenvalue of H_uu: ≤ 0 at a maximum
  double curvature_size = 0.0;           ///< the same sum over all second derivatives
  double multiplier = 0.0;               ///< μ = H_u/C_u of the arc's constraint C ≤ 0, else 0: ≥ 0 at a maximum
  double constraint_slope = 0.0;         ///< C_u of the same
  double kelley = 0.0;                   ///< {H₁, {H₀, H₁}} on a singular arc, else 0: ≥ 0 at a maximum
  double kelley_size = 0.0;              ///< what cancels in it
};

/// Along a state constraint of order r: the multiplier η of the constraint itself (direct adjoining), of which μ is the r-fold integral
/// from the exit, so that (−1)^r d^r μ/dt^r = η ≥ 0.
struct BoundaryLoad {
  double eta = 0.0;    ///< η
  double size = 0.0;   ///< what cancels in it
  double slope = 0.0;  ///< dμ/dt
};

/// A kind of arc of one system.
class ExtremalArc {
 public:
  ExtremalArc() = default;
  ExtremalArc(const ExtremalArc&) = delete;
  ExtremalArc& operator=(const ExtremalArc&) = delete;
  virtual ~ExtremalArc() = default;

  [[nodiscard]] virtual ArcKind kind() const = 0;
  [[nodiscard]] virtual const Field& field() const = 0;
  [[nodiscard]] virtual ArcValues values(const std::vector<double>& x) const = 0;
  /// Of an arc along a state constraint; zeros elsewhere.
  [[nodiscard]] virtual BoundaryLoad load(const std::vector<double>& x) const = 0;
  /// C(q, u, p) of the arc's constraint C ≤ 0 at any control u (k); 0 where it has none.
  [[nodiscard]] virtual double constraint(const std::vector<double>& x, const std::vector<double>& u) const = 0;
  /// u (k), H, and H_u of the first control, with the arc's own control.
  [[nodiscard]] virtual std::vector<Jet> control(const std::vector<Jet>& x) const = 0;
  [[nodiscard]] virtual Jet hamiltonian(const std::vector<Jet>& x) const = 0;
  [[nodiscard]] virtual Jet switching_function(const std::vector<Jet>& x) const = 0;
  /// d/dt H_u, of a singular arc.
  [[nodiscard]] virtual Jet switching_rate(const std::vector<Jet>& x) const = 0;
};

/// A state constraint c(q, p) ≤ 0 of order r.
class StateConstraint {
 public:
  StateConstraint() = default;
  StateConstraint(const StateConstraint&) = delete;
  StateConstraint& operator=(const StateConstraint&) = delete;
  virtual ~StateConstraint() = default;

  [[nodiscard]] virtual double value(const std::vector<double>& x) const = 0;
  /// c and c', which does not depend on the control if r > 1.
  [[nodiscard]] virtual std::vector<Jet> entry_conditions(const std::vector<Jet>& x) const = 0;
  /// λ + Σ πᵢ ∂c^(i)/∂q (n), for one or two multipliers πᵢ.
  [[nodiscard]] virtual std::vector<Jet> jump(const std::vector<Jet>& x, const std::vector<Jet>& multipliers) const = 0;
  /// |∂c^(j)/∂u| at a point, j = 1 or 2.
  [[nodiscard]] virtual double control_dependence(int j, const std::vector<double>& x) const = 0;
};

/// A mixed constraint C(q, u, p) ≤ 0.
using MixedConstraint = std::function<double(const std::vector<double>& x, const std::vector<double>& u)>;

/// (q, λ, p) of a system at a point of its Mayer form.
template <ControlledSystem M, class S>
struct MayerPoint {
  using W = MayerForm<M>;
  static constexpr int size = 2 * M::states + W::parameters;
  Vec<S, W::states> state{}, costate{};
  Vec<S, W::parameters> parameter{};

  template <class X>
  explicit MayerPoint(const X& x) {
    constexpr std::size_t n = M::states;
    costate[0] = S(-1.0);
    for (std::size_t i = 0; i < n; ++i) {
      state[i + 1] = x[i];
      costate[i + 1] = x[i + n];
    }
    for (std::size_t i = 0; i < parameter.size(); ++i) parameter[i] = x[i + 2 * n];
  }
};

/// The arc of a system under a law on its Mayer form.
template <ControlledSystem M, class L>
class ExtremalArcOf final : public ExtremalArc {
  using W = MayerForm<M>;
  using Flow = Pontryagin<W, L>;
  template <class S>
  using Point = MayerPoint<M, S>;
  static constexpr std::size_t size = Point<double>::size;

 public:
  ExtremalArcOf(ArcKind kind, W model, L law) : kind_(kind), model_(model), law_(law), flow_(model, law), field_(flow_) {}

  [[nodiscard]] ArcKind kind() const override { return kind_; }
  [[nodiscard]] const Field& field() const override { return field_; }

  [[nodiscard]] ArcValues values(const std::vector<double>& x) const override {
    const Point<double> at(x);
    const auto u = law_.control(at.state, at.costate, at.parameter);
    ArcValues r;
    r.control.assign(u.begin(), u.end());
    expand(at, u, r);
    if constexpr (constrained) {
      using D = Dual<double, 1>;
      const Vec<D, 1> moving{D::variable(u[0], 0)};
      r.constraint_slope = law_.constraint(lift<D>(at.state), moving, lift<D>(at.parameter)).gradient[0];
      r.multiplier = r.control_gradient[0] / r.constraint_slope;
    }
    if constexpr (requires { law_.kelley(at.state, at.costate, at.parameter); }) {
      std::tie(r.kelley, r.kelley_size) = law_.kelley(at.state, at.costate, at.parameter);
    }
    return r;
  }

  [[nodiscard]] BoundaryLoad load(const std::vector<double>& x) const override {
    BoundaryLoad r;
    if constexpr (requires { L::order; }) {
      using D = Dual<double, 2 * M::states>;
      std::array<double, size> at{};
      std::copy_n(x.begin(), size, at.begin());
      auto moving = lift<D>(at);
      for (int i = 0; i < 2 * M::states; ++i) {
        moving[static_cast<std::size_t>(i)] = D::variable(at[static_cast<std::size_t>(i)], i);
      }
      const auto gradient = multiplier_rate<L::order - 1>(moving).gradient;
      const auto rate = rates(at);
      for (std::size_t i = 0; i < gradient.size(); ++i) {
        const double term = gradient[i] * rate[i];
        r.eta += L::order % 2 == 0 ? term : -term;
        r.size += std::abs(term);
      }
      r.slope = multiplier_rate<1>(at);
    }
    return r;
  }

  [[nodiscard]] double constraint(const std::vector<double>& x, const std::vector<double>& u) const override {
    if constexpr (constrained) {
      const Point<double> at(x);
      return law_.constraint(at.state, Vec<double, 1>{u.at(0)}, at.parameter);
    } else {
      return 0.0;
    }
  }

  [[nodiscard]] std::vector<Jet> control(const std::vector<Jet>& x) const override {
    return map(x, [this]<class S>(const Point<S>& at) { return law_.control(at.state, at.costate, at.parameter); });
  }
  [[nodiscard]] Jet hamiltonian(const std::vector<Jet>& x) const override {
    return map(x, [this]<class S>(const Point<S>& at) {
      const auto u = law_.control(at.state, at.costate, at.parameter);
      return Vec<S, 1>{costate::hamiltonian<W, S>(model_, at.state, at.costate, u, at.parameter)};
    })[0];
  }
  [[nodiscard]] Jet switching_function(const std::vector<Jet>& x) const override {
    return map(x, [this]<class S>(const Point<S>& at) {
      const auto u = law_.control(at.state, at.costate, at.parameter);
      return control_gradient<W, S>(model_, at.state, at.costate, u, at.parameter);
    })[0];
  }
  [[nodiscard]] Jet switching_rate(const std::vector<Jet>& x) const override {
    if constexpr (requires(Point<double> at) { law_.rate(at.state, at.costate, at.parameter); }) {
      return map(x, [this]<class S>(const Point<S>& at) {
        return Vec<S, 1>{law_.rate(at.state, at.costate, at.parameter)};
      })[0];
    } else {
      throw InternalError("only a singular arc has a row for the rate of the switching function");
    }
  }

 private:
  static constexpr bool constrained = requires(const L law, Vec<double, W::states> q, Vec<double, W::controls> u,
                                               Vec<double, W::parameters> p) {
    law.constraint(q, u, p);
  };

  template <class F>
  static std::vector<Jet> map(const std::vector<Jet>& x, const F& f) {
    return on_jets<static_cast<int>(size)>([&f]<class S, std::size_t N>(
                                               const std::array<S, N>& at) { return f(Point<S>(at)); },
                                           x);
  }

  /// H and its first two derivatives by u, each with the sum of its terms' magnitudes.
  void expand(const Point<double>& at, const Vec<double, W::controls>& u, ArcValues& r) const {
    constexpr int k = W::controls;
    using D = Dual<double, k>;
    using DD = Dual<D, k>;
    Vec<DD, k> moving{};
    for (int i = 0; i < k; ++i) {
      const auto place = static_cast<std::size_t>(i);
      moving[place] = DD::variable(D::variable(u[place], i), i);
    }
    const auto f = model_.dynamics(lift<DD>(at.state), moving, lift<DD>(at.parameter));
    r.control_gradient.assign(k, 0.0);
    r.gradient_size.assign(k, 0.0);
    Eigen::Matrix<double, k, k> hessian = Eigen::Matrix<double, k, k>::Zero();
    for (std::size_t term = 0; term < f.size(); ++term) {
      const double weight = at.costate[term];
      r.hamiltonian += weight * f[term].value.value;
      r.size += std::abs(weight * f[term].value.value);
      for (std::size_t i = 0; i < k; ++i) {
        const D& slope = f[term].gradient[i];
        r.control_gradient[i] += weight * slope.value;
        r.gradient_size[i] += std::abs(weight * slope.value);
        for (std::size_t j = 0; j < k; ++j) {
          hessian(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) += weight * slope.gradient[j];
          r.curvature_size += std::abs(weight * slope.gradient[j]);
        }
      }
    }
    r.curvature =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, k, k>>(hessian, Eigen::EigenvaluesOnly).eigenvalues().maxCoeff();
  }

  /// dx/dt along the arc; 0 for what is constant and for cyclic states, on which nothing depends.
  template <class S>
  std::array<S, size> rates(const std::array<S, size>& x) const {
    constexpr std::size_t cyclic = W::cyclic, free = Flow::free_states, n = M::states;
    const Point<S> at(x);
    Vec<S, Flow::states> z{};
    Vec<S, Flow::parameters> p{};
    std::copy(at.parameter.begin(), at.parameter.end(), std::copy_n(at.costate.begin(), cyclic, p.begin()));
    std::copy_n(at.costate.begin() + cyclic, free, std::copy_n(at.state.begin() + cyclic, free, z.begin()));
    const auto rate = flow_.rates(S(0.0), z, p).state;
    std::array<S, size> r{};
    std::copy_n(rate.begin(), free, r.begin() + (cyclic - 1));
    std::copy_n(rate.begin() + free, free, r.begin() + (n + cyclic - 1));
    return r;
  }
  /// d^j μ/dt^j along the arc.
  template <int j, class S>
  S multiplier_rate(const std::array<S, size>& x) const {
    using D = Dual<S, 1>;
    if constexpr (j == 0) {
      const Point<S> at(x);
      const auto u = law_.control(at.state, at.costate, at.parameter);
      const Vec<D, 1> moving{D::variable(u[0], 0)};
      return control_gradient<W, S>(model_, at.state, at.costate, u, at.parameter)[0] /
             law_.constraint(lift<D>(at.state), moving, lift<D>(at.parameter)).gradient[0];
    } else {
      const auto rate = rates(x);
      auto moving = lift<D>(x);
      for (std::size_t i = 0; i < size; ++i) moving[i].gradient[0] = rate[i];
      return multiplier_rate<j - 1>(moving).gradient[0];
    }
  }

  ArcKind kind_;
  W model_;
  L law_;
  Flow flow_;
  FieldOf<Flow> field_;
};

/// The state constraint of a `c(q, p)` on a generic scalar.
template <ControlledSystem M, class C>
class StateConstraintOf final : public StateConstraint {
  using W = MayerForm<M>;
  template <class S>
  using Point = MayerPoint<M, S>;
  static constexpr int size = Point<double>::size;

 public:
  StateConstraintOf(std::shared_ptr<const C> c, W model, double nominal_control)
      : c_(std::move(c)), model_(model), nominal_{nominal_control} {}

  [[nodiscard]] double value(const std::vector<double>& x) const override { return lie<0>(Point<double>(x)); }

  [[nodiscard]] std::vector<Jet> entry_conditions(const std::vector<Jet>& x) const override {
    return on_jets<size>(
        [this]<class S, std::size_t N>(const std::array<S, N>& x_) {
          const Point<S> at(x_);
          return Vec<S, 2>{lie<0>(at), lie<1>(at)};
        },
        x);
  }

  [[nodiscard]] std::vector<Jet> jump(const std::vector<Jet>& x, const std::vector<Jet>& multipliers) const override {
    std::vector<Jet> inputs = x;
    inputs.insert(inputs.end(), multipliers.begin(), multipliers.end());
    inputs.resize(size + 2);
    const bool second = multipliers.size() > 1;
    return on_jets<size + 2>(
        [this, second]<class S, std::size_t N>(const std::array<S, N>& x_) {
          using D = Dual<S, M::states>;
          Point<D> at(lift<D>(x_));
          for (int i = 0; i < M::states; ++i)
            at.state[static_cast<std::size_t>(i) + 1].gradient[static_cast<std::size_t>(i)] = S(1.0);
          Vec<S, M::states> after{};
          const D c = lie<0>(at);
          for (std::size_t i = 0; i < after.size(); ++i) after[i] = x_[i + after.size()] + x_[size] * c.gradient[i];
          if (second) {
            const D rate = lie<1>(at);
            for (std::size_t i = 0; i < after.size(); ++i) after[i] = after[i] + x_[size + 1] * rate.gradient[i];
          }
          return after;
        },
        inputs);
  }

  [[nodiscard]] double control_dependence(int j, const std::vector<double>& x) const override {
    return j == 1 ? dependence<1>(x) : dependence<2>(x);
  }

 private:
  template <int j, class S>
  S lie(const Point<S>& at) const {
    return lie_derivative<j>(model_, *c_, at.state, lift<S>(nominal_), at.parameter);
  }
  template <int j>
  double dependence(const std::vector<double>& x) const {
    using D = Dual<double, 1>;
    const Point<D> at(x);
    return std::abs(
        lie_derivative<j>(model_, *c_, at.state, Vec<D, 1>{D::variable(nominal_[0], 0)}, at.parameter).gradient[0]);
  }

  std::shared_ptr<const C> c_;
  W model_;
  Vec<double, 1> nominal_;
};

}  // namespace costate
