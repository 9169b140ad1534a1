/// \file
/// A user's own optimal-control problem: the system stated once, on a generic scalar, and everything else derived.
///
///     struct DoubleIntegrator {  // x' = v, v' = u, L = u²/2
///       static constexpr int states = 2, controls = 1, parameters = 0;
///       template <class S>
///       Vec<S, 2> dynamics(const Vec<S, 2>& q, const Vec<S, 1>& u, const Vec<S, 0>&) const { return {q[1], u[0]}; }
///       template <class S>
///       S cost(const Vec<S, 2>&, const Vec<S, 1>& u, const Vec<S, 0>&) const { return 0.5 * u[0] * u[0]; }
///     };
///     ControlProblem problem(DoubleIntegrator{});
///     problem.state("x", {.start = 0.0, .end = 1.0}).state("v", {.start = 0.0, .end = 0.0}).control("u", {.lower = -5.0, .upper = 5.0});
///     problem.final_time(1.0).upper().interior().lower();  // the arcs, in order of time
///     const Solution s = solve(problem.shared());          // s["cost"], s["t1"], s["lambda_x"], …
///
/// What is derived, the rows and the names: see extremal_statement.hpp.
#pragma once

#include <costate/error.hpp>
#include <costate/extremal_statement.hpp>

namespace costate {

/// At a junction: what a user's own row there may depend on.
template <class S, int n, int k, int m>
struct JunctionPoint {
  Vec<S, n> state, costate;  ///< before a jump
  Vec<S, m> parameters;
  Vec<S, k> before, after;  ///< the controls
};

/// A state constraint c(q, p) ≤ 0; its order r is the first time derivative that the control enters.
struct ConstraintOptions {
  int order = 0;  ///< 1 or 2; 0: found at points around the ends stated for the states
};

/// A statement under construction. States, controls and parameters are described in the system's order, arcs in order of time.
/// Everything is checked in shared(). A user's functions are called on any scalar: write them as generic lambdas.
template <ControlledSystem M>
class ControlProblem {
  using W = MayerForm<M>;
  static constexpr int n = M::states, k = M::controls, m = M::parameters;
  static constexpr bool has_cost =
      requires(const M system, Vec<double, n> q, Vec<double, k> u, Vec<double, m> p) { system.cost(q, u, p); };

 public:
  explicit ControlProblem(M system = {}) : model_{system} {}

  ControlProblem& state(std::string name, const State& state) {
    s_.states.emplace_back(std::move(name), state);
    return *this;
  }
  ControlProblem& control(std::string name, const Control& control = {}) {
    s_.controls.emplace_back(std::move(name), control);
    return *this;
  }
  ControlProblem& parameter(std::string name, double value, std::string unit = "1") {
    s_.parameters.push_back({std::move(name), std::move(unit), value});
    return *this;
  }
  ControlProblem& final_time(double value) {
    s_.time = value;
    s_.free_time = false;
    return *this;
  }
  ControlProblem& free_final_time(double guess) {
    s_.time = guess;
    s_.free_time = true;
    return *this;
  }

  /// Φ, a function of Ends, added to ∫ L dt.
  template <class F>
  ControlProblem& terminal_cost(F f) {
    static_assert(has_cost, "a system without cost() minimises the time: state cost() = 0 if all that counts is the end, 1 if the time does too");
    s_.terminal_cost = std::make_shared<EndFunctionOf<n, m, F>>(std::move(f));
    return *this;
  }
  /// Ψ = 0, a function of Ends.
  template <class F>
  ControlProblem& end_condition(std::string name, F f) {
    s_.end_conditions.emplace_back(std::move(name), std::make_shared<EndFunctionOf<n, m, F>>(std::move(f)));
    return *this;
  }
  /// c(q, p) ≤ 0 along the whole trajectory. Cyclic states must not enter it.
  template <class C>
  ControlProblem& constraint(std::string name, C c, ConstraintOptions options = {}) {
    static_assert(k == 1, "constraints are stated for systems with one control");
    auto limit = std::make_shared<const C>(std::move(c));
    auto alone = map<1>([limit](const auto& q, const auto&, const auto& p) {
      using S = typename std::decay_t<decltype(q)>::value_type;
      return Vec<S, 1>{(*limit)(q, p)};
    });
    constraints_.push_back({name, options.order, std::move(alone),
                            [limit](const ControlProblem& of) -> std::shared_ptr<const StateConstraint> {
                              return std::make_shared<StateConstraintOf<M, C>>(limit, of.model_, of.search().start[0]);
                            },
                            [limit](const ControlProblem& of, int order) {
                              return order == 1
                                         ? of.arc_of(ArcKind::boundary, BoundaryLaw<W, C, 1>{limit, of.model_, of.search()})
                                         : of.arc_of(ArcKind::boundary, BoundaryLaw<W, C, 2>{limit, of.model_, of.search()});
                            }});
    return *this;
  }
  /// C(q, u, p) ≤ 0 along the whole trajectory, with ∂C/∂u ≠ 0 where it holds with equality.
  template <class C>
  ControlProblem& mixed(std::string name, C c) {
    static_assert(k == 1, "constraints are stated for systems with one control");
    auto limit = std::make_shared<const C>(std::move(c));
    s_.mixed_maps.push_back(map<1>([limit](const auto& q, const auto& u, const auto& p) {
      using S = typename std::decay_t<decltype(u)>::value_type;
      return Vec<S, 1>{(*limit)(q, u, p)};
    }));
    s_.mixed.emplace_back(name, [limit](const std::vector<double>& x, const std::vector<double>& u) {
      const MayerPoint<M, double> at(x);
      return (*limit)(W::own_states(at.state), Vec<double, 1>{u[0]}, W::own_parameters(at.parameter));
    });
    mixed_.push_back(
        {std::move(name),
         [limit](const ControlProblem& of) {
           return of.arc_of(ArcKind::mixed, MixedLaw<W, C>{limit, of.model_, of.search()});
         },
         [limit](const ControlProblem& of) {
           using D = Dual<double, 1>;
           const MayerPoint<M, D> at(of.probe(probes[1]));
           const Vec<D, 1> u{D::variable(of.search().start[0], 0)};
           const double slope = MixedLaw<W, C>{limit, of.model_, {}}.constraint(at.state, u, at.parameter).gradient[0];
           return slope > 0.0 ? 1 : slope < 0.0 ? -1 : 0;
         }});
    return *this;
  }

  /// An arc on which H_u = 0 between the bounds.
  ControlProblem& interior(const Arc& known = {}) {
    return add("interior", known, [](const ControlProblem& of) {
      return of.arc_of(ArcKind::interior, InteriorLaw<W>{of.model_, of.search()});
    });
  }
  /// Arcs with every control at its upper or at its lower bound.
  ControlProblem& upper(const Arc& known = {}) { return bang(true, known); }
  ControlProblem& lower(const Arc& known = {}) { return bang(false, known); }
  /// An arc with constant controls.
  ControlProblem& constant(const Vec<double, k>& values, const Arc& known = {}) {
    return add("constant", known,
               [values](const ControlProblem& of) {
                 check_constant(of.s_.controls, values);
                 return of.arc_of(ArcKind::bang, ConstantLaw<W>{values});
               });
  }
  /// A singular arc of order 1.
  ControlProblem& singular(const Arc& known = {}) {
    static_assert(k == 1, "singular arcs are derived for systems with one control");
    return add("singular", known,
               [](const ControlProblem& of) { return of.arc_of(ArcKind::singular, SingularLaw<W>{of.model_}); });
  }
  /// An arc along a constraint stated by constraint() or mixed().
  ControlProblem& boundary(const std::string& constraint, const Arc& known = {}) {
    return add("along " + constraint, known, nullptr, constraint);
  }
  /// A junction at which a constraint is touched.
  ControlProblem& touch(const std::string& constraint, double multiplier = 0.0) {
    pending_junction().touch = constraint;
    pending_junction().stated.multiplier = multiplier;
    return *this;
  }
  /// An arc under a law of the user's own, `control(q, λ, p)`: H_u = 0 along it, or C = 0 if the law states a `constraint(q, u, p)`.
  template <class L>
  ControlProblem& arc(std::string name, L law, const Arc& known = {}) {
    return add(std::move(name), known, [law](const ControlProblem& of) {
      const bool constrained = requires(Vec<double, n> q, Vec<double, k> u, Vec<double, m> p) { law.constraint(q, u, p); };
      return of.arc_of(constrained ? ArcKind::mixed : ArcKind::interior, StatedLaw<W, L>{law});
    });
  }
  /// A row f(JunctionPoint) = 0 of the user's own at the next junction, instead of the derived one.
  template <class F>
  ControlProblem& junction(std::string name, F f) {
    pending_junction().stated.name = std::move(name);
    pending_junction().stated.row = [f](const std::vector<Jet>& x, const std::vector<Jet>& before,
                                        const std::vector<Jet>& after) {
      std::vector<Jet> inputs = x;
      inputs.insert(inputs.end(), before.begin(), before.end());
      inputs.insert(inputs.end(), after.begin(), after.end());
      constexpr int size = MayerPoint<M, double>::size;
      return on_jets<size + 2 * k>(
          [&f]<class S, std::size_t N>(const std::array<S, N>& y) {
            JunctionPoint<S, n, k, m> at{};
            const auto from = [&y](std::size_t place, auto& to) { std::copy_n(y.begin() + place, to.size(), to.begin()); };
            from(0, at.state);
            from(n, at.costate);
            from(2 * n, at.parameters);
            from(size, at.before);
            from(size + k, at.after);
            return Vec<S, 1>{f(at)};
          },
          inputs)[0];
    };
    return *this;
  }

  /// The shooting problem. \throws BadInput for an ill-posed statement, naming what is wrong
  [[nodiscard]] std::shared_ptr<const Problem> shared() const {
    check_sizes();
    ExtremalStatement s = s_;
    s.minimum_time = !has_cost;
    s.cyclic = cyclic_states<M>();
    s.system = system_map(model_.system);
    s.linearise = [model = model_](const std::vector<double>& x, const Eigen::VectorXd& u) {
      return linearised(model, x, u);
    };
    const ControlSearch<k> searched = search();
    s.control_start = Eigen::Map<const Eigen::VectorXd>(searched.start.data(), k);
    s.control_scale = Eigen::Map<const Eigen::VectorXd>(searched.scale.data(), k);
    for (const StatedConstraint& c : constraints_) {
      auto constraint = c.make(*this);
      const int order = order_of(c, *constraint);
      s.constraints.push_back({c.name, std::move(constraint), order, c.map});
    }
    for (const PendingArc& arc : arcs_) {
      if (arc.constraint.empty()) {
        s.arcs.push_back({.name = arc.name, .arc = arc.make(*this), .known = arc.known, .side = arc.side});
      } else {
        s.arcs.push_back(boundary_arc(arc, s));
      }
    }
    if (junctions_.size() > arcs_.size()) throw BadInput("the last touch() or junction() is followed by no arc");
    for (std::size_t j = 1; j < arcs_.size(); ++j) {
      const PendingJunction at = j < junctions_.size() ? junctions_[j] : PendingJunction{};
      s.junctions.push_back(at.stated);
      if (!at.touch.empty()) s.junctions.back().touched = place_of(at.touch, s);
    }
    return extremal_problem(std::move(s));
  }

 private:
  using MakeArc = std::function<std::shared_ptr<const ExtremalArc>(const ControlProblem&)>;
  struct StatedConstraint {
    std::string name;
    int order;
    std::shared_ptr<const SmoothMap> map;
    std::function<std::shared_ptr<const StateConstraint>(const ControlProblem&)> make;
    std::function<std::shared_ptr<const ExtremalArc>(const ControlProblem&, int order)> arc;
  };
  struct StatedMixed {
    std::string name;
    MakeArc arc;
    std::function<int(const ControlProblem&)> side;
  };
  struct PendingArc {
    std::string name;
    Arc known;
    MakeArc make;
    std::string constraint;
    int side;
  };
  struct PendingJunction {
    std::string touch;
    ExtremalStatement::Junction stated;
  };

  template <int rows, class F>
  static std::shared_ptr<const SmoothMap> map(F f) {
    return smooth_map<n, k, m, rows>(std::move(f));
  }
  ControlProblem& add(std::string name, const Arc& known, MakeArc make, std::string constraint = {}, int side = 0) {
    arcs_.push_back({std::move(name), known, std::move(make), std::move(constraint), side});
    return *this;
  }
  ControlProblem& bang(bool upper, const Arc& known) {
    const auto make = [upper](const ControlProblem& of) {
      for (const auto& [name, control] : of.s_.controls) {
        if (!(upper ? control.upper : control.lower)) {
          throw BadInput("an arc is at the " + std::string(upper ? "upper" : "lower") + " bound of " + name +
                         ", which has none");
        }
      }
      return of.arc_of(ArcKind::bang, BoundLaw<W>{upper});
    };
    return add(upper ? "upper" : "lower", known, make, {}, upper ? 1 : -1);
  }
  PendingJunction& pending_junction() {
    if (arcs_.empty()) throw BadInput("touch() and junction() stand between two arcs, not before the first");
    junctions_.resize(arcs_.size() + 1);
    return junctions_.back();
  }

  template <class L>
  std::shared_ptr<const ExtremalArc> arc_of(ArcKind kind, const L& law) const {
    return std::make_shared<ExtremalArcOf<M, L>>(kind, model_, law);
  }
  /// Where controls are searched: from the guess or the middle of the bounds.
  [[nodiscard]] ControlSearch<k> search() const {
    ControlSearch<k> search;
    for (std::size_t i = 0; i < k; ++i) {
      const Control& c = s_.controls[i].second;
      const bool both = c.lower && c.upper;
      search.name[i] = s_.controls[i].first;
      search.start[i] = c.guess ? *c.guess : both ? 0.5 * (*c.lower + *c.upper) : c.lower.value_or(c.upper.value_or(0.0));
      search.scale[i] = c.scale > 0.0 ? c.scale : both ? 0.5 * (*c.upper - *c.lower) : 1.0;
    }
    return search;
  }

  static Linearisation linearised(const W& model, const std::vector<double>& x, const Eigen::VectorXd& u) {
    using D = Dual<double, n + k>;
    MayerPoint<M, D> at(x);
    Vec<D, k> controls{};
    for (int i = 0; i < n; ++i) at.state[static_cast<std::size_t>(i) + 1].gradient[static_cast<std::size_t>(i)] = 1.0;
    for (int i = 0; i < k; ++i) controls[static_cast<std::size_t>(i)] = D::variable(u[i], n + i);
    const auto f = model.dynamics(at.state, controls, at.parameter);
    Eigen::MatrixXd gradient(n + 1, n + k);
    Linearisation r{.f = Eigen::VectorXd(n), .f_q = {}, .f_u = {}, .cost = f[0].value, .cost_q = {}, .cost_u = {}};
    for (int i = 0; i <= n; ++i) {
      const D& rate = f[static_cast<std::size_t>(i)];
      gradient.row(i) = Eigen::Map<const Eigen::RowVectorXd>(rate.gradient.data(), n + k);
      if (i > 0) r.f[i - 1] = rate.value;
    }
    r.cost_q = gradient.row(0).head(n).transpose();
    r.cost_u = gradient.row(0).tail(k).transpose();
    r.f_q = gradient.bottomLeftCorner(n, n);
    r.f_u = gradient.bottomRightCorner(n, k);
    return r;
  }

  void check_sizes() const {
    const auto check = [](const char* what, std::size_t described, int has) {
      if (described != static_cast<std::size_t>(has)) {
        throw BadInput("the system has " + std::to_string(has) + " " + what + ", but " + std::to_string(described) +
                       " are described: describe each, in the system's order");
      }
    };
    check("states", s_.states.size(), n);
    check("controls", s_.controls.size(), k);
    check("parameters", s_.parameters.size(), m);
  }

  /// A point near the ends stated for the states, moved a little differently in each of them.
  [[nodiscard]] std::vector<double> probe(double way) const {
    std::vector<double> x;
    for (const auto& [name, state] : s_.states) {
      const double start = state.start.value_or(state.guess.value_or(state.end.value_or(0.0)));
      const double end = state.end.value_or(state.guess.value_or(start));
      x.push_back(start + way * (end - start) + state.scale * 0.01 * way * (1.0 + static_cast<double>(x.size())));
    }
    x.resize(2 * n);
    for (const Parameter& parameter : s_.parameters) x.push_back(parameter.value);
    x.resize(MayerPoint<M, double>::size);
    return x;
  }
  static constexpr std::array<double, 3> probes{0.31, 0.53, 0.84};

  [[nodiscard]] int order_of(const StatedConstraint& c, const StateConstraint& constraint) const {
    for (const double way : probes) {
      const std::vector<double> x = probe(way);
      const std::vector<Jet> after = constraint.jump({x.begin(), x.end()}, {1.0});
      for (std::size_t i = 0; i < static_cast<std::size_t>(cyclic_states<M>()); ++i) {
        if (after[i].value != 0.0) {
          throw BadInput("the constraint " + c.name + " depends on " + s_.states[i].first +
                         ", which the system calls cyclic");
        }
      }
    }
    std::vector<std::vector<double>> points;
    for (const double way : probes) points.push_back(probe(way));
    return constraint_order(c.name, c.order, constraint, points);
  }

  static int place_of(const std::string& name, const ExtremalStatement& s) {
    for (std::size_t i = 0; i < s.constraints.size(); ++i) {
      if (s.constraints[i].name == name) return static_cast<int>(i);
    }
    throw BadInput("no constraint '" + name + "' is stated that can be touched or followed there");
  }
  [[nodiscard]] ExtremalStatement::PlacedArc boundary_arc(const PendingArc& arc, const ExtremalStatement& s) const {
    for (const StatedMixed& c : mixed_) {
      if (c.name == arc.constraint)
        return {.name = arc.name, .arc = c.arc(*this), .known = arc.known, .side = c.side(*this)};
    }
    const int place = place_of(arc.constraint, s);
    const auto i = static_cast<std::size_t>(place);
    return {.name = arc.name,
            .arc = constraints_[i].arc(*this, s.constraints[i].order),
            .known = arc.known,
            .constraint = place};
  }

  W model_;
  ExtremalStatement s_;
  std::vector<StatedConstraint> constraints_;
  std::vector<StatedMixed> mixed_;
  std::vector<PendingArc> arcs_;
  std::vector<PendingJunction> junctions_;
};

}  // namespace costate
