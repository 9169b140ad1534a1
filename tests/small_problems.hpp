/// \file
/// Small shooting problems with known solutions, for tests of everything that solves.
#pragma once

#include "closed_flows.hpp"

#include <costate/pontryagin.hpp>
#include <costate/problem.hpp>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <vector>

namespace costate::small {

/// A mass on a rail, x'' = u, that pays ½u² per unit time.
struct Mass {
  static constexpr int states = 2, cyclic = 1, controls = 1, parameters = 0;
  template <class S>
  Vec<S, 2> dynamics(const Vec<S, 2>& q, const Vec<S, 1>& u, const Vec<S, 0>&) const {
    return {q[1], u[0]};
  }
  template <class S>
  S cost(const Vec<S, 2>&, const Vec<S, 1>& u, const Vec<S, 0>&) const {
    return 0.5 * u[0] * u[0];
  }
};

/// u = λ_v maximises −½u² + λ_x v + λ_v u.
struct LeastEffort {
  template <class S>
  Vec<S, 1> control(const Vec<S, 2>&, const Vec<S, 2>& costate, const Vec<S, 0>&) const {
    return {costate[1]};
  }
};

/// The mass goes from rest to rest over a distance D in unit time with least effort:
/// x = D(3t² − 2t³), v = D(6t − 6t²), λ_x = 12 D, λ_v = u = D(6 − 12t).
class LeastEffortTransfer final : public Problem {
 public:
  explicit LeastEffortTransfer(double distance = 1.0, double speed_limit = 10.0) {
    unknowns_ = {{"lambda_x", 10.0}, {"lambda_v0", 10.0}};
    rows_ = {{"end position"}, {"end velocity"}};
    parameters_ = {{"distance", "m", distance}, {"speed_limit", "m/s", speed_limit}};
    structure_ = {"thrust"};
  }
  void shoot(Shot& shot) const override {
    const ArcEnd end = shot.arc({.field = &field_,
                                 .t0 = 0.0,
                                 .t1 = 1.0,
                                 .state = {0.0, shot.unknown(1)},
                                 .quadrature = {0.0},
                                 .parameter = {shot.unknown(0)}});
    shot.row(0, end.quadrature[0] - shot.parameter(0));
    shot.row(1, end.state[0]);
    shot.report("final_time", "s", 1.0);
    shot.report("end_lambda_v", "m/s^2", end.state[1]);
  }
  [[nodiscard]] std::vector<Column> columns() const override { return {{"x", "m"}, {"v", "m/s"}, {"u", "m/s^2"}}; }
  [[nodiscard]] std::vector<double> observe(const ArcPoint& point, const std::vector<double>&) const override {
    return {point.quadrature[0], point.state[0], point.state[1]};
  }
  [[nodiscard]] std::vector<PathCheck> check(const ArcPoint& point, const std::vector<double>& parameters) const override {
    const Vec<double, 1> lambda_x{point.record->parameter[0]};
    const auto H = [&](const Eigen::VectorXd& z) { return flow_.hamiltonian({z[0], z[1]}, lambda_x); };
    return {{"speed below its limit", PathCheck::Kind::nonnegative, parameters[1] - point.state[0]},
            {"Hamiltonian - its start value", PathCheck::Kind::zero, H(point.state) - H(point.record->state)}};
  }

 private:
  using Flow = Pontryagin<Mass, LeastEffort>;
  Flow flow_;
  FieldOf<Flow> field_;
};

/// x'' = u with a constant u.
struct ConstantThrust {
  static constexpr int states = 2, parameters = 1, quadratures = 0;
  template <class S>
  Rates<S, 2, 0> rates(const S&, const Vec<S, 2>& z, const Vec<S, 1>& p) const {
    return {{z[1], p[0]}, {}};
  }
};

/// The mass with |u| ≤ 1 goes from rest at 0 to rest at 1 in minimum time: u = 1 for a time 1, then u = −1 for a time 1.
/// The equations have a second root, both durations −1. The last arc is integrated forward from the first, or backward from
/// the end point to meet it.
class TimeOptimalTransfer final : public Problem {
 public:
  explicit TimeOptimalTransfer(bool backward = false) : backward_(backward) {
    const double infinity = std::numeric_limits<double>::infinity();
    unknowns_ = {{"first duration", 1.0, 0.0, infinity}, {"second duration", 1.0, 0.0, infinity}};
    rows_ = {{"position"}, {"velocity"}};
    structure_ = {"accelerate", "brake"};
  }
  void shoot(Shot& shot) const override {
    const Jet& first = shot.unknown(0);
    const Jet& second = shot.unknown(1);
    const ArcEnd middle = shot.arc({.arc = 0, .field = &field_, .t0 = 0.0, .t1 = first, .state = {0.0, 0.0}, .parameter = {1.0}});
    const double clock = first.value + (backward_ ? second.value : 0.0);
    const ArcEnd end = shot.arc({.arc = 1,
                                 .field = &field_,
                                 .t0 = 0.0,
                                 .t1 = backward_ ? -second : second,
                                 .clock = clock,
                                 .state = backward_ ? Jets{1.0, 0.0} : middle.state,
                                 .parameter = {-1.0}});
    shot.row(0, end.state[0] - (backward_ ? middle.state[0] : Jet(1.0)));
    shot.row(1, end.state[1] - (backward_ ? middle.state[1] : Jet(0.0)));
    shot.report("t1", "s", first);
    shot.report("final_time", "s", first + second);
  }
  [[nodiscard]] std::vector<Column> columns() const override { return {{"x", "m"}, {"v", "m/s"}, {"u", "m/s^2"}}; }
  [[nodiscard]] std::vector<double> observe(const ArcPoint& point, const std::vector<double>&) const override {
    return {point.state[0], point.state[1], point.record->parameter[0]};
  }
  [[nodiscard]] std::vector<PathCheck> check(const ArcPoint&, const std::vector<double>&) const override { return {}; }

 private:
  bool backward_;
  FieldOf<ConstantThrust> field_;
};

/// Rotation at the rate a cos t from (1, y₀) at t = 0.3 to x = 0.2 at t = 1.8: with θ = a(sin 1.8 − sin 0.3),
/// y₀ = (cos θ − 0.2)/sin θ. The right-hand side depends on time, and the problem's clock starts where the arc does.
class RotationTransfer final : public Problem {
 public:
  static constexpr double begin = 0.3, end = 1.8, rate = 2.0;
  RotationTransfer() {
    unknowns_ = {{"y0"}};
    rows_ = {{"end x"}};
    parameters_ = {{"rate", "rad/s", rate}};
    structure_ = {"rotation"};
  }
  static double angle(double t) { return rate * (std::sin(t) - std::sin(begin)); }
  static double y0() { return (std::cos(angle(end)) - 0.2) / std::sin(angle(end)); }

  void shoot(Shot& shot) const override {
    const ArcEnd at = shot.arc({.field = &field_,
                                .t0 = begin,
                                .t1 = end,
                                .state = {1.0, shot.unknown(0)},
                                .quadrature = {shot.unknown(0)},
                                .parameter = {shot.parameter(0)}});
    shot.row(0, at.state[0] - 0.2);
    shot.report("final_time", "s", end - begin);
    shot.report("end_y", "m", at.state[1]);
    shot.report("end_y_by_quadrature", "m", at.quadrature[0]);
  }
  [[nodiscard]] std::vector<Column> columns() const override { return {{"x", "m"}, {"y", "m"}, {"w", "m"}}; }
  [[nodiscard]] std::vector<double> observe(const ArcPoint& point, const std::vector<double>&) const override {
    return {point.state[0], point.state[1], point.quadrature[0]};
  }
  [[nodiscard]] std::vector<PathCheck> check(const ArcPoint& point, const std::vector<double>&) const override {
    const double radius = point.record->state.squaredNorm();
    return {{"radius", PathCheck::Kind::zero, point.state.squaredNorm() - radius}};
  }

 private:
  FieldOf<closed::ModulatedRotation> field_;
};

/// x'' = −ω²x from x = 1 to a given x: v₀ = ω(x₁ − cos ωT)/sin ωT. Near ωT = π, a conjugate point, the root is ill-conditioned.
class OscillatorTransfer final : public Problem {
 public:
  /// `multiplier`(t) is to be nonnegative along the path.
  OscillatorTransfer(double omega, double time, double end, std::function<double(double)> multiplier = {})
      : omega_(omega), time_(time), end_(end), multiplier_(std::move(multiplier)) {
    unknowns_ = {{"v0", std::max(1.0, std::abs(v0()))}};
    rows_ = {{"end x"}};
    structure_ = {"oscillation"};
  }
  [[nodiscard]] double v0() const { return omega_ * (end_ - std::cos(omega_ * time_)) / std::sin(omega_ * time_); }
  [[nodiscard]] double end_v() const { return v0() * std::cos(omega_ * time_) - omega_ * std::sin(omega_ * time_); }

  void shoot(Shot& shot) const override {
    const ArcEnd at = shot.arc({.field = &field_,
                                .t0 = 0.0,
                                .t1 = time_,
                                .state = {1.0, shot.unknown(0)},
                                .quadrature = {0.0},
                                .parameter = {omega_}});
    shot.row(0, at.state[0] - end_);
    shot.report("end_v", "m/s", at.state[1]);
  }
  [[nodiscard]] std::vector<Column> columns() const override { return {{"x", "m"}, {"v", "m/s"}}; }
  [[nodiscard]] std::vector<double> observe(const ArcPoint& point, const std::vector<double>&) const override {
    return {point.state[0], point.state[1]};
  }
  [[nodiscard]] std::vector<PathCheck> check(const ArcPoint& point, const std::vector<double>&) const override {
    if (!multiplier_) return {};
    return {{"multiplier", PathCheck::Kind::nonnegative, multiplier_(point.t)}};
  }

 private:
  double omega_, time_, end_;
  std::function<double(double)> multiplier_;
  FieldOf<closed::Oscillator> field_;
};

/// θ'' = −sin θ + u cos t.
struct ShakenPendulum {
  static constexpr int states = 2, parameters = 1, quadratures = 0;
  template <class S>
  Rates<S, 2, 0> rates(const S& t, const Vec<S, 2>& z, const Vec<S, 1>& p) const {
    return {{z[1], p[0] * cos(t) - sin(z[0])}, {}};
  }
};

/// The pendulum shaken with u = a and then u = −a: two durations reach an angle at rest. No closed form, but every way in which
/// an unknown or a parameter enters an arc: start state, constants, and both times of an arc that depends on time.
class PendulumTransfer final : public Problem {
 public:
  PendulumTransfer() {
    unknowns_ = {{"first duration"}, {"second duration"}};
    rows_ = {{"end angle"}, {"end rate"}};
    parameters_ = {{"push", "1", 1.5}, {"start_rate", "1/s", 0.4}};
    structure_ = {"push", "pull"};
  }
  void shoot(Shot& shot) const override {
    const Jet& push = shot.parameter(0);
    const Jet& first = shot.unknown(0);
    const ArcEnd middle =
        shot.arc({.arc = 0, .field = &field_, .t0 = 0.0, .t1 = first, .state = {0.0, shot.parameter(1)}, .parameter = {push}});
    const ArcEnd end = shot.arc({.arc = 1,
                                 .field = &field_,
                                 .t0 = first,
                                 .t1 = first + shot.unknown(1),
                                 .state = middle.state,
                                 .parameter = {-push}});
    shot.row(0, end.state[0] - 1.0);
    shot.row(1, end.state[1]);
  }
  [[nodiscard]] std::vector<Column> columns() const override { return {{"theta", "rad"}}; }
  [[nodiscard]] std::vector<double> observe(const ArcPoint& point, const std::vector<double>&) const override {
    return {point.state[0]};
  }
  [[nodiscard]] std::vector<PathCheck> check(const ArcPoint&, const std::vector<double>&) const override { return {}; }

 private:
  FieldOf<ShakenPendulum> field_;
};

/// Equations without arcs. `rows` gives the value of every row; it may report.
class Equations final : public Problem {
 public:
  using RowsOf = std::function<std::vector<Jet>(Shot&)>;
  Equations(std::vector<Unknown> unknowns, std::vector<Row> rows, RowsOf rows_of, std::vector<Parameter> parameters = {})
      : rows_of_(std::move(rows_of)) {
    unknowns_ = std::move(unknowns);
    rows_ = std::move(rows);
    parameters_ = std::move(parameters);
  }
  void shoot(Shot& shot) const override {
    const std::vector<Jet> values = rows_of_(shot);
    for (std::size_t i = 0; i < values.size(); ++i) shot.row(i, values[i]);
  }
  [[nodiscard]] std::vector<Column> columns() const override { return {}; }
  [[nodiscard]] std::vector<double> observe(const ArcPoint&, const std::vector<double>&) const override { return {}; }
  [[nodiscard]] std::vector<PathCheck> check(const ArcPoint&, const std::vector<double>&) const override { return {}; }

 private:
  RowsOf rows_of_;
};

/// What a call throws, as text; empty if it throws no E.
template <class E, class Call>
std::string thrown(Call call) {
  try {
    call();
  } catch (const E& error) {
    return error.what();
  }
  return {};
}

inline bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

}  // namespace costate::small
