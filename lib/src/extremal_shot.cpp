#include "extremal_problem.hpp"

#include <costate/error.hpp>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace costate {

/// One evaluation of the shooting function, arc after arc.
class ExtremalProblem::Pass {
 public:
  Pass(const ExtremalProblem& problem, Shot& shot) : of_(problem), s_(problem.s_), n_(problem.n_), shot_(shot) {}

  void run() {
    start();
    for (std::size_t arc = 0; arc < s_.arcs.size(); ++arc) {
      integrate(arc);
      if (arc + 1 < s_.arcs.size()) {
        shot_.report(fmt::format("t{}", arc + 1), "s", time_);
        junction(arc);
      }
    }
    end();
  }

 private:
  void start() {
    x_.resize(2 * n_);
    for (std::size_t i = 0; i < n_; ++i) {
      x_[i] = of_.start_parameter_[i] ? shot_.parameter(*of_.start_parameter_[i]) : shot_.unknown(*of_.start_unknown_[i]);
      if (of_.costate_unknown_[i]) x_[n_ + i] = shot_.unknown(*of_.costate_unknown_[i]);
    }
    for (std::size_t i = 0; i < s_.parameters.size(); ++i) x_.push_back(shot_.parameter(i));
    for (std::size_t i = 0; i < s_.controls.size(); ++i) {
      const double infinity = std::numeric_limits<double>::infinity();
      x_.push_back(of_.lower_parameter_[i] ? shot_.parameter(*of_.lower_parameter_[i]) : Jet(-infinity));
      x_.push_back(of_.upper_parameter_[i] ? shot_.parameter(*of_.upper_parameter_[i]) : Jet(infinity));
    }
    start_ = x_;
    constants_.start_hamiltonian = s_.arcs.front().arc->hamiltonian(x_).value;
    constants_.gradient_size.resize(s_.controls.size());
    reach_.assign(s_.control_scale.begin(), s_.control_scale.end());
    constants_.entry.resize(s_.arcs.size());
    entries_.resize(s_.arcs.size());
  }

  /// Looks how large the terms of H and H_u are at an end of an arc.
  void measure(std::size_t arc) {
    try {
      const ArcValues values = s_.arcs[arc].arc->values(numbers());
      constants_.size = std::max(constants_.size, values.size);
      for (std::size_t i = 0; i < values.gradient_size.size(); ++i) {
        constants_.gradient_size[i] = std::max(constants_.gradient_size[i], values.gradient_size[i]);
        reach_[i] = std::max(reach_[i], std::abs(values.control[i]));
      }
    } catch (const LeftDomain&) {
      return;  // far from a solution, where nothing is integrated, a law need not exist
    }
  }
  [[nodiscard]] std::vector<double> numbers() const {
    std::vector<double> x;
    for (const Jet& value : x_) x.push_back(value.value);
    return x;
  }

  /// Carries x over one arc. The system does not depend on time, so every arc starts at 0 of a clock of its own.
  void integrate(std::size_t arc) {
    const Jet duration = of_.duration_unknown_[arc] ? shot_.unknown(*of_.duration_unknown_[arc])
                                                    : shot_.parameter(*of_.time_parameter_) - time_;
    const std::size_t cyclic = of_.cyclic_, rest = n_ - cyclic;
    ArcStart from{.arc = static_cast<int>(arc),
                  .field = &s_.arcs[arc].arc->field(),
                  .t0 = 0.0,
                  .t1 = duration,
                  .clock = time_.value,
                  .quadrature = {cost_},
                  .parameter = {-1.0}};
    from.state.append(x_.begin() + index(cyclic), x_.begin() + index(n_));
    from.state.append(x_.begin() + index(n_ + cyclic), x_.begin() + index(2 * n_));
    from.quadrature.append(x_.begin(), x_.begin() + index(cyclic));
    from.parameter.append(x_.begin() + index(n_), x_.begin() + index(n_ + cyclic));
    from.parameter.append(x_.begin() + index(2 * n_), x_.end());
    measure(arc);
    const ArcEnd to = shot_.arc(from);
    cost_ = to.quadrature[0];
    for (std::size_t i = 0; i < cyclic; ++i) x_[i] = to.quadrature[i + 1];
    for (std::size_t i = 0; i < rest; ++i) {
      x_[cyclic + i] = to.state[i];
      x_[n_ + cyclic + i] = to.state[rest + i];
    }
    measure(arc);
    time_ += duration;
    shot_.guard(EventKind::arc_death, fmt::format("duration of arc {}", arc + 1), duration);
  }

  void junction(std::size_t j) {
    const ExtremalArc& before = *s_.arcs[j].arc;
    const ExtremalArc& after = *s_.arcs[j + 1].arc;
    for (const Condition condition : of_.junctions_[j].conditions) {
      switch (condition) {
        case Condition::user: row(s_.junctions[j].row(x_, before.control(x_), after.control(x_))); break;
        case Condition::continuous_h: row(before.hamiltonian(x_) - after.hamiltonian(x_)); break;
        case Condition::bangs:
          row((before.hamiltonian(x_) - after.hamiltonian(x_)) / (before.control(x_)[0] - after.control(x_)[0]));
          break;
        case Condition::continuous_u: row(before.control(x_)[0] - after.control(x_)[0]); break;
        case Condition::switching_before: row(before.switching_function(x_)); break;
        case Condition::switching_after: row(after.switching_function(x_)); break;
        case Condition::switching_rate_after: row(after.switching_rate(x_)); break;
        case Condition::touch: enter(j, 2); break;
        case Condition::touch_first_order: {
          const Jet h = before.hamiltonian(x_);
          enter(j, 1);
          row(h - after.hamiltonian(x_));
          break;
        }
        case Condition::boundary: enter(j, static_cast<int>(of_.junctions_[j].multipliers)); break;
      }
    }
  }

  /// The rows with which a constraint is met, and the jump of the costates there.
  void enter(std::size_t j, int rows) {
    const Junction& at = of_.junctions_[j];
    const StateConstraint& constraint = *s_.constraints[static_cast<std::size_t>(at.constraint)].constraint;
    const std::vector<Jet> met = constraint.entry_conditions(x_);
    for (int i = 0; i < rows; ++i) row(met[static_cast<std::size_t>(i)]);
    std::vector<Jet> multipliers;
    for (std::size_t i = 0; i < at.multipliers; ++i) multipliers.push_back(shot_.unknown(at.multiplier + i));
    const std::vector<Jet> costate = constraint.jump(x_, multipliers);
    std::copy(costate.begin(), costate.end(), x_.begin() + index(n_));
    if (s_.arcs[j + 1].arc->kind() == ArcKind::boundary && at.multipliers == 2) {
      entries_[j + 1] = {multipliers[0].value, numbers()};
    }
  }

  /// The parts of multipliers at the entries, π₀ + dμ/dt, over their terms or over what μ is made of in the time there is.
  void weigh_entries() {
    for (std::size_t arc = 0; arc < entries_.size(); ++arc) {
      const auto& [first, x] = entries_[arc];
      if (x.empty()) continue;
      try {
        const double slope = s_.arcs[arc].arc->load(x).slope;
        const double usual = constants_.gradient_size[0] /
                             (std::abs(s_.arcs[arc].arc->values(x).constraint_slope) * constants_.time);
        const double size = std::max(std::abs(first) + std::abs(slope), usual);
        constants_.entry[arc] = size > 0.0 ? (first + slope) / size : 0.0;
      } catch (const LeftDomain&) {
        return;  // as in measure()
      }
    }
  }

  /// μ(T) of a constraint of order 2 on which the trajectory ends.
  void weigh_exit() {
    const ExtremalStatement::PlacedArc& last = s_.arcs.back();
    if (last.constraint < 0 || !(constants_.gradient_size[0] > 0.0)) return;
    const auto& constraint = s_.constraints[static_cast<std::size_t>(last.constraint)];
    if (constraint.order < 2 || !of_.ends_free(numbers(), *constraint.constraint)) return;
    try {
      constants_.exit = last.arc->values(numbers()).control_gradient[0] / constants_.gradient_size[0];
    } catch (const LeftDomain&) {
      return;  // as in measure()
    }
  }

  void end() {
    std::vector<Jet> start_gradient(n_), end_gradient(n_), conditions;
    Jet time_gradient, terminal_cost;
    if (of_.has_end_functions()) {
      std::vector<Jet> ends(start_.begin(), start_.begin() + index(n_));
      ends.insert(ends.end(), x_.begin(), x_.begin() + index(n_));
      ends.push_back(time_);
      ends.insert(ends.end(), x_.begin() + index(2 * n_), x_.begin() + index(2 * n_ + s_.parameters.size()));
      const auto add = [&](const EndFunction& f, const Jet& weight) {
        const EndFunction::Expansion at = f.at(ends);
        for (std::size_t i = 0; i < n_; ++i) {
          start_gradient[i] += weight * at.start[i];
          end_gradient[i] += weight * at.end[i];
        }
        time_gradient += weight * at.time;
        return at.value;
      };
      if (s_.terminal_cost) terminal_cost = add(*s_.terminal_cost, 1.0);
      for (std::size_t j = 0; j < s_.end_conditions.size(); ++j) {
        conditions.push_back(add(*s_.end_conditions[j].second, shot_.unknown(of_.end_multiplier_[j])));
      }
    }
    for (std::size_t i = 0; i < n_; ++i) {
      if (of_.start_unknown_[i] && of_.costate_unknown_[i]) row(start_[n_ + i] - start_gradient[i]);
    }
    for (std::size_t i = 0; i < n_; ++i) {
      row(of_.end_parameter_[i] ? x_[i] - shot_.parameter(*of_.end_parameter_[i]) : x_[n_ + i] + end_gradient[i]);
    }
    for (const Jet& condition : conditions) row(condition);
    if (s_.free_time) row(s_.arcs.back().arc->hamiltonian(x_) - time_gradient);
    shot_.report("final_time", "s", time_);
    shot_.report("cost", "1", cost_ + terminal_cost);
    constants_.time = time_.value;
    // A control that never matters has nothing but rounding in H_u: to it counts what the others make of H over its own range.
    for (std::size_t i = 0; i < reach_.size(); ++i)
      constants_.gradient_size[i] = std::max(constants_.gradient_size[i], constants_.size / reach_[i]);
    weigh_entries();
    weigh_exit();
    shot_.complete({}, constants_.packed());
  }

  void row(const Jet& value) { shot_.row(row_++, value); }
  static std::ptrdiff_t index(std::size_t i) { return static_cast<std::ptrdiff_t>(i); }

  const ExtremalProblem& of_;
  const ExtremalStatement& s_;
  std::size_t n_;
  Shot& shot_;
  std::vector<Jet> x_, start_;
  Jet time_, cost_;
  Constants constants_;
  std::vector<double> reach_;  ///< of the controls: their scales, or values if larger
  std::vector<std::pair<double, std::vector<double>>>
      entries_;  ///< by arc: π₀ and x there, where the constraint has order 2
  std::size_t row_ = 0;
};

void ExtremalProblem::shoot(Shot& shot) const { Pass(*this, shot).run(); }

}  // namespace costate
