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
  double curvature = 0.0;                ///< largest eigenvalue of H_uu: ≤ 0 at a maximum
  double multiplier = 0.0;               ///< μ = H_u/C_u of the arc's constraint C ≤ 0, else 0: ≥ 0 at a maximum
  double kelley = 0.0;                   ///< {H₁, {H₀, H₁}} on a singular arc, else 0: ≥ 0 at a maximum
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

 public:
  ExtremalArcOf(ArcKind kind, W model, L law) : kind_(kind), model_(model), law_(law), field_(Flow(model, law)) {}

  [[nodiscard]] ArcKind kind() const override { return kind_; }
  [[nodiscard]] const Field& field() const override { return field_; }

  [[nodiscard]] ArcValues values(const std::vector<double>& x) const override {
    const Point<double> at(x);
    const auto u = law_.control(at.state, at.costate, at.parameter);
    ArcValues r;
    r.control.assign(u.begin(), u.end());
    const auto f = model_.dynamics(at.state, u, at.parameter);
    r.hamiltonian = dot(at.costate, f);
    for (std::size_t i = 0; i < f.size(); ++i) r.size += std::abs(at.costate[i] * f[i]);
    const auto g = control_gradient(model_, at.state, at.costate, u, at.parameter);
    r.control_gradient.assign(g.begin(), g.end());
    r.curvature = curvature(at, u);
    if constexpr (constrained) {
      using D = Dual<double, 1>;
      const Vec<D, 1> moving{D::variable(u[0], 0)};
      r.multiplier = g[0] / law_.constraint(lift<D>(at.state), moving, lift<D>(at.parameter)).gradient[0];
    }
    if constexpr (requires { law_.kelley(at.state, at.costate, at.parameter); }) {
      r.kelley = law_.kelley(at.state, at.costate, at.parameter);
    }
    return r;
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
    return on_jets<Point<double>::size>([&f]<class S, std::size_t N>(const std::array<S, N>& at) { return f(Point<S>(at)); },
                                        x);
  }

  double curvature(const Point<double>& at, const Vec<double, W::controls>& u) const {
    constexpr int k = W::controls;
    using D = Dual<double, k>;
    Vec<D, k> moving{};
    for (std::size_t i = 0; i < k; ++i) moving[i] = D::variable(u[i], static_cast<int>(i));
    const auto g = control_gradient<W, D>(model_, lift<D>(at.state), lift<D>(at.costate), moving, lift<D>(at.parameter));
    Eigen::Matrix<double, k, k> hessian;
    for (Eigen::Index i = 0; i < k; ++i) {
      for (Eigen::Index j = 0; j < k; ++j)
        hessian(i, j) = g[static_cast<std::size_t>(i)].gradient[static_cast<std::size_t>(j)];
    }
    return Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, k, k>>(hessian, Eigen::EigenvaluesOnly)
        .eigenvalues()
        .maxCoeff();
  }

  ArcKind kind_;
  W model_;
  L law_;
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
