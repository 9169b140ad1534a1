#include "costate_estimate.hpp"

#include <costate/error.hpp>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <numeric>

namespace costate {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Weight with which all costates are drawn to 0.
constexpr double towards_zero = 1e-3;

/// The conditions on the coefficients c = (λ(0), σ, π, 1), collected arc by arc. A costate is a matrix that maps c to it.
class Estimator {
 public:
  Estimator(const ExtremalStatement& s, const GuessedMotion& motion, const std::vector<int>& constraint,
            const std::vector<std::size_t>& multipliers)
      : s_(s), motion_(motion), constraint_(constraint), multipliers_(multipliers), n_(motion.start.size()) {
    const auto jumps = std::accumulate(multipliers.begin(), multipliers.end(), std::size_t{0});
    first_jump_ = n_ + static_cast<Index>(s.end_conditions.size());
    columns_ = first_jump_ + static_cast<Index>(jumps) + 1;
    total_ = std::accumulate(motion.durations.begin(), motion.durations.end(), 0.0);
  }

  std::optional<CostateEstimate> run() {
    MatrixXd costate = MatrixXd::Zero(n_, columns_);
    costate.leftCols(n_).setIdentity();
    const MatrixXd at_start = costate;
    std::vector<std::vector<MatrixXd>> along;
    Index jump = first_jump_;
    double time = 0.0;
    for (std::size_t arc = 0; arc < s_.arcs.size(); ++arc) {
      along.push_back(carry(arc, time, costate));
      time += motion_.durations[arc];
      if (arc + 1 < s_.arcs.size()) junction(arc, time, costate, jump);
    }
    ends(at_start, costate);
    for (Index i = 0; i + 1 < columns_; ++i)
      condition(VectorXd::Unit(columns_, i), towards_zero * (i < n_ ? scale(i) : 1.0));
    const std::optional<VectorXd> c = solution();
    if (!c) return {};
    CostateEstimate estimate{at_start * *c, {}, c->segment(n_, first_jump_ - n_), {}};
    jump = first_jump_;
    for (const std::size_t count : multipliers_) {
      estimate.multipliers.emplace_back(c->segment(jump, static_cast<Index>(count)));
      jump += static_cast<Index>(count);
    }
    for (const auto& nodes : along) {
      MatrixXd values(n_, static_cast<Index>(nodes.size()));
      for (Index i = 0; i < values.cols(); ++i) values.col(i) = nodes[static_cast<std::size_t>(i)] * *c;
      estimate.along.push_back(std::move(values));
    }
    return estimate;
  }

 private:
  [[nodiscard]] double scale(Index state) const { return s_.states[static_cast<std::size_t>(state)].second.scale; }
  [[nodiscard]] VectorXd states(double time) const {
    return motion_.start + (time / total_) * (motion_.end - motion_.start);
  }

  /// x at a time, with costates 0: what holds a control does not depend on them.
  [[nodiscard]] std::vector<double> point(double time) const {
    const VectorXd q = states(time);
    std::vector<double> x(q.begin(), q.end());
    x.resize(2 * x.size());
    for (const Parameter& parameter : s_.parameters) x.push_back(parameter.value);
    for (const auto& [name, control] : s_.controls) {
      x.push_back(control.lower.value_or(-std::numeric_limits<double>::infinity()));
      x.push_back(control.upper.value_or(std::numeric_limits<double>::infinity()));
    }
    return x;
  }

  /// The control of an arc at a time.
  [[nodiscard]] VectorXd control(std::size_t arc, double time) const {
    const ExtremalArc& kind = *s_.arcs[arc].arc;
    const std::vector<double> x = point(time);
    if (kind.kind() != ArcKind::interior && kind.kind() != ArcKind::singular) {
      const std::vector<Jet> u = kind.control({x.begin(), x.end()});
      VectorXd held(static_cast<Index>(s_.controls.size()));
      for (Index i = 0; i < held.size(); ++i) held[i] = u[static_cast<std::size_t>(i)].value;
      return held;
    }
    // Gauss–Newton on |q' − f(q, u)|² in scales of the states; a control stays within its bounds.
    const VectorXd rate = (motion_.end - motion_.start) / total_;
    VectorXd weight(n_);
    for (Index i = 0; i < n_; ++i) weight[i] = 1.0 / scale(i);
    VectorXd u = s_.control_start;
    for (int iteration = 0; iteration < 10; ++iteration) {
      const Linearisation at = s_.linearise(x, u);
      u += (weight.asDiagonal() * at.f_u).completeOrthogonalDecomposition().solve(weight.cwiseProduct(rate - at.f));
      for (Index i = 0; i < u.size(); ++i) {
        const Control& bounds = s_.controls[static_cast<std::size_t>(i)].second;
        u[i] = std::min(std::max(u[i], bounds.lower.value_or(u[i])), bounds.upper.value_or(u[i]));
      }
    }
    return u;
  }

  [[nodiscard]] Linearisation linearise(std::size_t arc, double time) const {
    return s_.linearise(point(time), control(arc, time));
  }

  /// row·c = 0.
  void condition(const VectorXd& row, double weight) { rows_.push_back(weight * row); }

  /// H_u = 0 of every control, in scales of the controls.
  void stationary(const Linearisation& at, const MatrixXd& costate, double weight) {
    for (Index i = 0; i < at.f_u.cols(); ++i) {
      VectorXd row = costate.transpose() * at.f_u.col(i);
      row[columns_ - 1] -= at.cost_u[i];
      condition(row, weight * s_.control_scale[i]);
    }
  }

  [[nodiscard]] VectorXd hamiltonian(const Linearisation& at, const MatrixXd& costate) const {
    VectorXd row = costate.transpose() * at.f;
    row[columns_ - 1] -= at.cost;
    return row;
  }

  /// Carries the costate over an arc by the midpoint rule.
  std::vector<MatrixXd> carry(std::size_t arc, double begin, MatrixXd& costate) {
    const ArcKind kind = s_.arcs[arc].arc->kind();
    const bool free = kind == ArcKind::interior || kind == ArcKind::singular;
    const double step = motion_.durations[arc] / CostateEstimate::cells;
    std::vector<MatrixXd> nodes{costate};
    for (int cell = 0; cell < CostateEstimate::cells; ++cell) {
      const Linearisation at = linearise(arc, begin + (cell + 0.5) * step);
      const auto rate = [&](const MatrixXd& y) {
        MatrixXd r = -at.f_q.transpose() * y;
        r.col(columns_ - 1) += at.cost_q;
        return r;
      };
      const MatrixXd middle = costate + 0.5 * step * rate(costate);
      if (free) stationary(at, middle, 1.0 / std::sqrt(CostateEstimate::cells));
      costate += step * rate(middle);
      nodes.push_back(costate);
    }
    return nodes;
  }

  void junction(std::size_t j, double time, MatrixXd& costate, Index& jump) {
    const ArcKind before = s_.arcs[j].arc->kind(), after = s_.arcs[j + 1].arc->kind();
    if (before == ArcKind::boundary) stationary(linearise(j, time), costate, 1.0);
    if (before == ArcKind::bang && after == ArcKind::bang) {
      condition(hamiltonian(linearise(j, time), costate) - hamiltonian(linearise(j + 1, time), costate), 1.0);
    }
    if (before == ArcKind::interior && after != ArcKind::interior) stationary(linearise(j + 1, time), costate, 1.0);
    if (after == ArcKind::interior && before != ArcKind::interior) stationary(linearise(j, time), costate, 1.0);
    const std::vector<double> x = point(time);
    for (std::size_t i = 0; i < multipliers_[j]; ++i) {
      std::vector<Jet> unit(multipliers_[j]);
      unit[i] = 1.0;
      const std::vector<Jet> gradient = s_.constraints[static_cast<std::size_t>(constraint_[j])].constraint->jump({x.begin(),
                                                                                                                   x.end()},
                                                                                                                  unit);
      for (Index k = 0; k < n_; ++k) costate(k, jump) += gradient[static_cast<std::size_t>(k)].value;
      ++jump;
    }
  }

  void ends(const MatrixXd& at_start, const MatrixXd& at_end) {
    std::vector<Jet> x(motion_.start.begin(), motion_.start.end());
    x.insert(x.end(), motion_.end.begin(), motion_.end.end());
    x.emplace_back(total_);
    for (const Parameter& parameter : s_.parameters) x.emplace_back(parameter.value);
    // Derivatives of Φ + σ·Ψ as rows on c.
    MatrixXd start = MatrixXd::Zero(n_, columns_), end = start;
    VectorXd time = VectorXd::Zero(columns_);
    const auto add = [&](const EndFunction& f, Index column) {
      const EndFunction::Expansion at = f.at(x);
      for (Index i = 0; i < n_; ++i) {
        start(i, column) += at.start[static_cast<std::size_t>(i)].value;
        end(i, column) += at.end[static_cast<std::size_t>(i)].value;
      }
      time[column] += at.time.value;
    };
    if (s_.terminal_cost) add(*s_.terminal_cost, columns_ - 1);
    for (std::size_t j = 0; j < s_.end_conditions.size(); ++j) add(*s_.end_conditions[j].second, n_ + static_cast<Index>(j));
    for (Index i = 0; i < n_; ++i) {
      const State& state = s_.states[static_cast<std::size_t>(i)].second;
      if (!state.start) condition((at_start.row(i) - start.row(i)).transpose(), state.scale);
      if (!state.end) condition((at_end.row(i) + end.row(i)).transpose(), state.scale);
    }
    if (s_.free_time) condition(hamiltonian(linearise(s_.arcs.size() - 1, total_), at_end) - time, total_);
  }

  /// The least-squares solution, with its last entry 1.
  [[nodiscard]] std::optional<VectorXd> solution() const {
    MatrixXd a(static_cast<Index>(rows_.size()), columns_);
    for (std::size_t i = 0; i < rows_.size(); ++i) a.row(static_cast<Index>(i)) = rows_[i].transpose();
    if (!a.allFinite()) return {};
    VectorXd c = VectorXd::Ones(columns_);
    c.head(columns_ - 1) = a.leftCols(columns_ - 1).colPivHouseholderQr().solve(-a.col(columns_ - 1));
    if (!c.allFinite()) return {};
    return c;
  }

  const ExtremalStatement& s_;
  const GuessedMotion& motion_;
  const std::vector<int>& constraint_;
  const std::vector<std::size_t>& multipliers_;
  Index n_, first_jump_ = 0, columns_ = 0;
  double total_ = 0.0;
  std::vector<VectorXd> rows_;
};

}  // namespace

std::optional<CostateEstimate> estimate_costates(const ExtremalStatement& statement, const GuessedMotion& motion,
                                                 const std::vector<int>& constraint,
                                                 const std::vector<std::size_t>& multipliers) {
  try {
    return Estimator(statement, motion, constraint, multipliers).run();
  } catch (const LeftDomain&) {
    return {};  // the guessed motion leaves the model's domain
  }
}

}  // namespace costate
