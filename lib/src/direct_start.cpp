#include "direct_start.hpp"

#include "extremal_problem.hpp"

#include <costate/error.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace costate {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

std::size_t place(Index i) { return static_cast<std::size_t>(i); }

class Splitter {
 public:
  Splitter(const ExtremalStatement& s, const DirectData& data, const DirectSolution& solution)
      : s_(s),
        solution_(solution),
        n_(solution.state.rows()),
        steps_(solution.control.cols()),
        h_(solution.time / static_cast<double>(steps_)),
        control_scale_(solution.control.rows()) {
    const double infinity = std::numeric_limits<double>::infinity();
    for (Index i = 0; i < steps_; ++i) {
      std::vector<double> x;
      for (Index j = 0; j < n_; ++j) x.push_back(0.5 * (solution.state(j, i) + solution.state(j, i + 1)));
      for (Index j = 0; j < n_; ++j) x.push_back(solution.costate(j, i));
      x.insert(x.end(), data.parameters.begin(), data.parameters.end());
      for (std::size_t j = 0; j < data.lower.size(); ++j) {
        x.push_back(data.lower[j].value_or(-infinity));
        x.push_back(data.upper[j].value_or(infinity));
      }
      points_.push_back(std::move(x));
    }
    for (Index j = 0; j < control_scale_.size(); ++j) {
      const auto &lower = data.lower[place(j)], &upper = data.upper[place(j)];
      const auto u = solution.control.row(j);
      constexpr double least = 1e-3;
      control_scale_[j] = 0.5 * (lower && upper ? *upper - *lower : u.maxCoeff() - u.minCoeff());
      control_scale_[j] = std::max(control_scale_[j], least * std::max(1.0, u.cwiseAbs().maxCoeff()));
    }
  }

  DirectArcs run() {
    mismatch_.resize(static_cast<Index>(s_.arcs.size()), steps_);
    for (std::size_t a = 0; a < s_.arcs.size(); ++a) match(a);
    DirectArcs result;
    result.cost = place_junctions() / static_cast<double>(steps_);
    result.pieces.resize(s_.arcs.size());
    for (std::size_t a = 0; a < s_.arcs.size(); ++a) result.pieces[a] = piece(a);
    return result;
  }

 private:
  /// How badly an arc's law agrees with each step.
  void match(std::size_t a) {
    const ExtremalStatement::PlacedArc& arc = s_.arcs[a];
    VectorXd distance = VectorXd::Zero(steps_);
    const auto row = static_cast<Index>(a);
    for (Index i = 0; i < steps_; ++i) {
      mismatch_(row, i) = 1.0;
      try {
        const ArcValues values = arc.arc->values(points_[place(i)]);
        double sum = 0.0;
        for (Index j = 0; j < control_scale_.size(); ++j) {
          const double off = (solution_.control(j, i) - values.control[place(j)]) / control_scale_[j];
          sum += off * off;
        }
        if (std::isfinite(sum)) mismatch_(row, i) = sum;
        if (arc.arc->kind() == ArcKind::singular) distance[i] = values.control_gradient[0];
      } catch (const LeftDomain&) {
        continue;
      }
      if (arc.constraint >= 0) distance[i] = constraint(arc.constraint).value(points_[place(i)]);
    }
    // Where a constraint of order 2 holds with equality the costates of direct adjoining follow the law of an interior arc too. A
    // small price leaves such steps to the arc along the constraint.
    constexpr double held = 0.01, price = 0.01;
    for (std::size_t c = 0; c < s_.constraints.size(); ++c) {
      if (arc.constraint == static_cast<int>(c) || !followed(static_cast<int>(c))) continue;
      VectorXd value(steps_);
      for (Index i = 0; i < steps_; ++i) value[i] = constraint(static_cast<int>(c)).value(points_[place(i)]);
      const double far = held * value.cwiseAbs().maxCoeff();
      for (Index i = 0; far > 0.0 && i < steps_; ++i)
        mismatch_(row, i) += price * std::max(0.0, 1.0 - std::abs(value[i]) / far);
    }
    constexpr double near = 0.1;  // of the largest distance there is
    const double far = distance.cwiseAbs().maxCoeff();
    for (Index i = 0; i < steps_; ++i) {
      if (far > 0.0) mismatch_(row, i) += std::pow(distance[i] / (near * far), 2);
      mismatch_(row, i) = std::isfinite(mismatch_(row, i)) ? std::min(1.0, mismatch_(row, i)) : 1.0;
    }
  }

  [[nodiscard]] bool followed(int constraint) const {
    return std::any_of(s_.arcs.begin(), s_.arcs.end(), [&](const auto& arc) { return arc.constraint == constraint; });
  }

  /// The price of the junction before arc a at a node: where a constraint is touched its multiplier is large.
  [[nodiscard]] double price(std::size_t a, Index node) const {
    const int touched = s_.junctions[a - 1].touched;
    if (touched < 0) return 0.0;
    const auto eta = solution_.multiplier.row(touched);
    const Index first = std::max<Index>(node - 1, 0), last = std::min<Index>(node + 1, steps_);
    return 1.0 - eta.segment(first, last - first + 1).sum() / eta.sum();
  }

  double place_junctions() {
    const auto arcs = static_cast<Index>(s_.arcs.size());
    const double infinity = std::numeric_limits<double>::infinity();
    // best(a, i): the first i steps are given to arcs 0 … a.
    MatrixXd best = MatrixXd::Constant(arcs, steps_ + 1, infinity);
    Eigen::MatrixXi begin = Eigen::MatrixXi::Zero(arcs, steps_ + 1);
    for (Index a = 0; a < arcs; ++a) {
      double so_far = infinity;
      int from = 0;
      for (Index i = 1; i <= steps_; ++i) {
        const double entry = a == 0 ? (i == 1 ? 0.0 : infinity) : best(a - 1, i - 1) + price(place(a), i - 1);
        if (entry < so_far) {
          so_far = entry;
          from = static_cast<int>(i - 1);
        }
        so_far += mismatch_(a, i - 1);
        best(a, i) = so_far;
        begin(a, i) = from;
      }
    }
    junction_.assign(s_.arcs.size() + 1, steps_);
    for (Index a = arcs; a-- > 0;) junction_[place(a)] = begin(a, junction_[place(a + 1)]);
    return best(arcs - 1, steps_);
  }

  /// The nodes whose multipliers belong to arc a, or to the junction before it: up to the middle of the neighbours.
  [[nodiscard]] std::pair<Index, Index> claim(std::size_t first_arc, std::size_t last_arc) const {
    const Index from = first_arc == 0 ? 0 : (junction_[first_arc - 1] + junction_[first_arc] + 1) / 2;
    const Index to = last_arc + 1 >= s_.arcs.size() ? steps_ : (junction_[last_arc + 1] + junction_[last_arc + 2]) / 2;
    return {from, to};
  }

  DirectArcs::Piece piece(std::size_t a) const {
    DirectArcs::Piece r;
    const Index first = junction_[a], count = junction_[a + 1] - first;
    r.duration = h_ * static_cast<double>(count);
    r.points.resize(2 * n_, count);
    for (Index i = 0; i < count; ++i) {
      r.points.col(i) = Eigen::Map<const VectorXd>(points_[place(first + i)].data(), 2 * n_);
    }
    if (s_.arcs[a].constraint >= 0) {
      adjoin(a, r);
    } else if (a > 0 && s_.junctions[a - 1].touched >= 0) {
      const Index from = claim(a - 1, a - 1).first + (junction_[a] - junction_[a - 1]) / 2,
                  to = (junction_[a] + junction_[a + 1]) / 2;
      r.multipliers = {solution_.multiplier.row(s_.junctions[a - 1].touched).segment(from, to - from + 1).sum()};
    }
    return r;
  }

  /// From the costates of direct adjoining to those of indirect adjoining, along arc a.
  void adjoin(std::size_t a, DirectArcs::Piece& r) const {
    const int c = s_.arcs[a].constraint;
    const bool second = s_.constraints[place(c)].order > 1;
    const auto eta = solution_.multiplier.row(c);
    const auto [from, to] = claim(a, a);
    double sum = 0.0, integral = 0.0;
    Index i = to;
    const auto back_over_node = [&] { sum += eta[i]; };
    const auto converted = [&](Index step) {
      const std::vector<double>& x = points_[place(step)];
      std::vector<Jet> multipliers{sum};
      if (second) multipliers.emplace_back(integral + 0.5 * h_ * sum);
      const std::vector<Jet> costate = constraint(c).jump({x.begin(), x.end()}, multipliers);
      for (Index j = 0; j < n_; ++j) r.points(n_ + j, step - junction_[a]) = costate[place(j)].value;
    };
    for (; i > junction_[a]; --i) {
      back_over_node();
      if (i <= junction_[a + 1]) converted(i - 1);
      integral += h_ * sum;
    }
    for (; i >= from; --i) back_over_node();
    r.multipliers = {sum};
    if (second) r.multipliers.push_back(integral);
  }

  [[nodiscard]] const StateConstraint& constraint(int c) const { return *s_.constraints[place(c)].constraint; }

  const ExtremalStatement& s_;
  const DirectSolution& solution_;
  Index n_, steps_;
  double h_;
  VectorXd control_scale_;
  std::vector<std::vector<double>> points_;
  MatrixXd mismatch_;  ///< arcs × steps
  std::vector<Index> junction_;
};

/// Constant controls to begin with: the guess, or the middle of the bounds; where there is neither, several values.
std::vector<VectorXd> first_controls(const ExtremalStatement& s, const DirectData& data) {
  const auto k = static_cast<Index>(s.controls.size());
  VectorXd middle(k), spread = VectorXd::Zero(k);
  for (Index j = 0; j < k; ++j) {
    const Control& control = s.controls[place(j)].second;
    const auto &lower = data.lower[place(j)], &upper = data.upper[place(j)];
    const double scale = control.scale > 0.0 ? control.scale : 1.0;
    middle[j] = lower && upper ? 0.5 * (*lower + *upper) : lower ? *lower + scale : upper ? *upper - scale : 0.0;
    if (control.guess) middle[j] = *control.guess;
    if (!control.guess && !lower && !upper) spread[j] = scale;
  }
  if (spread.isZero()) return {middle};
  // Eight angles, if that is what the control is.
  std::vector<VectorXd> all;
  for (const int eighth : {0, 1, -1, 2, -2, 3, -3, 4}) all.emplace_back(middle + eighth * 0.25 * std::numbers::pi * spread);
  return all;
}

/// Newton systems that take about a second: their work grows with the cube of the variables at a step, from some overhead on.
int search_systems(const ExtremalStatement& s) {
  const double variables = static_cast<double>(s.states.size() + s.controls.size());
  constexpr double work = 1e6, overhead = 250.0;
  return static_cast<int>(work / (overhead + std::pow(variables, 3)));
}

/// The cheapest of the solutions from all first controls. Where none leads to one, from other times, if it is free, and trajectories.
std::optional<DirectSolution> best_direct_solution(const ExtremalStatement& s, DirectData data) {
  std::optional<DirectSolution> best;
  DirectBudget budget{search_systems(s)};
  const double time = data.time;
  std::vector<VectorXd> controls = first_controls(s, data);
  const auto from_all = [&](DirectBegin begin) {
    for (const VectorXd& u : controls) {
      if (budget.newton_systems <= 0) return best.has_value();
      auto found = direct_solution(s, data, u, begin, {}, &budget);
      if (found && (!best || found->cost < best->cost)) best = std::move(found);
    }
    return best.has_value();
  };
  if (from_all(DirectBegin::straight)) return best;
  controls.resize(std::min<std::size_t>(controls.size(), 3));
  for (const double factor : {1.0, 3.0, 0.3, 10.0, 0.1}) {
    data.time = factor * time;
    if (factor != 1.0 && from_all(DirectBegin::straight)) return best;
    if (from_all(DirectBegin::simulated) || !s.free_time) return best;
  }
  return best;
}

}  // namespace

DirectArcs split(const ExtremalStatement& statement, const DirectData& data, const DirectSolution& solution) {
  return Splitter(statement, data, solution).run();
}

std::optional<Start> ExtremalProblem::search_start(const std::vector<double>& parameters) const {
  const auto index = [](std::size_t i) { return static_cast<Index>(i); };
  const auto values = [&](const std::vector<std::optional<std::size_t>>& places) {
    std::vector<std::optional<double>> r;
    for (const auto& p : places) r.push_back(p ? std::optional(parameters.at(*p)) : std::nullopt);
    return r;
  };
  if (!s_.system) return std::nullopt;
  const DirectData data{Eigen::Map<const VectorXd>(parameters.data(), index(s_.parameters.size())),
                        values(lower_parameter_),
                        values(upper_parameter_),
                        values(start_parameter_),
                        values(end_parameter_),
                        time_parameter_ ? parameters.at(*time_parameter_) : s_.time};
  const std::optional<DirectSolution> best = best_direct_solution(s_, data);
  if (!best) return std::nullopt;
  if (index(s_.arcs.size()) > best->control.cols()) return std::nullopt;  // a step is the shortest arc
  const DirectArcs arcs = split(s_, data, *best);

  Start start{this->start(), {}};
  for (std::size_t i = 0; i < n_; ++i) {
    if (start_unknown_[i]) start.unknowns[index(*start_unknown_[i])] = best->state(index(i), 0);
    if (costate_unknown_[i]) start.unknowns[index(*costate_unknown_[i])] = best->start_costate[index(i)];
  }
  for (std::size_t a = 0; a < arcs.pieces.size(); ++a) {
    if (duration_unknown_[a]) start.unknowns[index(*duration_unknown_[a])] = arcs.pieces[a].duration;
    if (a == 0) continue;
    const Junction& junction = junctions_[a - 1];
    for (std::size_t i = 0; i < junction.multipliers && i < arcs.pieces[a].multipliers.size(); ++i)
      start.unknowns[index(junction.multiplier + i)] = arcs.pieces[a].multipliers[i];
  }
  for (std::size_t j = 0; j < end_multiplier_.size(); ++j)
    start.unknowns[index(end_multiplier_[j])] = best->end_multiplier[index(j)];
  start.state = [pieces = arcs.pieces, n = index(n_), cyclic = index(cyclic_)](int arc, double fraction) {
    const MatrixXd& points = pieces[static_cast<std::size_t>(arc)].points;
    const Index last = points.cols() - 1;
    const double at = fraction * static_cast<double>(points.cols()) - 0.5;
    const Index left = std::clamp(static_cast<Index>(at), Index{0}, std::max<Index>(last - 1, 0)),
                right = std::min(left + 1, last);
    const double weight = at - static_cast<double>(left);
    const VectorXd x = (1.0 - weight) * points.col(left) + weight * points.col(right);
    VectorXd z(2 * (n - cyclic));
    z << x.segment(cyclic, n - cyclic), x.segment(n + cyclic, n - cyclic);
    return std::optional(z);
  };
  if (!start.unknowns.allFinite()) return std::nullopt;
  return start;
}

}  // namespace costate
