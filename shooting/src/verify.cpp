#include "verify.hpp"

#include <costate/error.hpp>

#include <algorithm>
#include <cmath>
#include <tuple>
#include <fmt/format.h>

namespace costate {

namespace {

std::string outside_domain(const Problem& problem, const Eigen::VectorXd& y) {
  for (std::size_t i = 0; i < problem.unknowns().size(); ++i) {
    const Unknown& unknown = problem.unknowns()[i];
    const double value = y[static_cast<Eigen::Index>(i)];
    if (!(value > unknown.lower && value < unknown.upper)) {
      return fmt::format(
          "the equations have a root, but it is no solution: {} = {:.9g} must lie within {:g} … {:g}; the arc "
          "structure is wrong for this scene",
          unknown.name, value, unknown.lower, unknown.upper);
    }
  }
  return {};
}

/// Integrates every arc again with dense output, ordered by time, the first starting at 0.
std::vector<ArcTrace> trace(Shooting& shooting, const Shot& shot) {
  double first = std::numeric_limits<double>::infinity();
  std::vector<ArcTrace> traces;
  for (const ArcRecord& record : shot.arcs()) {
    ArcTrace arc{record, 0.0, 0.0, 0.0,
                 shooting.flows()[*record.field].record(record.t0, record.t1, record.state, record.quadrature,
                                                        record.parameter)};
    std::tie(arc.begin, arc.end) = std::minmax({arc.time(record.t0), arc.time(record.t1)});
    first = std::min(first, arc.begin);
    traces.push_back(std::move(arc));
  }
  for (ArcTrace& arc : traces) {
    arc.origin = first / arc.record.time_unit;
    arc.begin -= first;
    arc.end -= first;
  }
  // An arc may have been integrated in several pieces.
  std::sort(traces.begin(), traces.end(), [](const ArcTrace& a, const ArcTrace& b) {
    return std::tie(a.record.arc, a.begin) < std::tie(b.record.arc, b.begin);
  });
  return traces;
}

/// One arc's path checks at one point.
struct Sample {
  double time;  ///< of the reports
  std::vector<PathCheck> checks;
};
Sample sample(const Shooting& shooting, const ArcTrace& arc, double own) {
  const ArcPoint point = arc.point(own);
  return {point.t, shooting.problem().check(point, shooting.parameters())};
}

/// How bad a check is: the smaller the value that must not be negative, the larger the one that must be zero. Not a number is
/// worst of all.
double badness(const PathCheck& check) {
  const double bad = check.kind == PathCheck::Kind::nonnegative ? -check.value : std::abs(check.value);
  return std::isnan(bad) ? std::numeric_limits<double>::infinity() : bad;
}

/// Keeps the worst value of each check met so far. Its place among the results is the same from sample to sample.
void fold(std::vector<CheckResult>& worst, const PathCheck& check, double t, double tolerance, std::size_t& place) {
  if (place >= worst.size() || worst[place].name != check.name) {
    place = static_cast<std::size_t>(
        std::find_if(worst.begin(), worst.end(), [&](const CheckResult& c) { return c.name == check.name; }) -
        worst.begin());
  }
  if (place == worst.size()) {
    worst.push_back({check.name, check.kind, check.value, t, tolerance});
  } else if (badness(check) > badness({{}, worst[place].kind, worst[place].worst})) {
    worst[place].worst = check.value;
    worst[place].time = t;
  }
}

/// Times at which an arc is looked at: every step of the integration cut in at least four, the arc in at least 64.
std::vector<double> sample_times(const Trajectory& trajectory) {
  std::vector<double> times{trajectory.start_time()};
  const std::size_t steps = trajectory.pieces().size();
  const std::size_t cells = steps == 0 ? 0 : std::max<std::size_t>(4, 64 / steps + 1);
  for (const Trajectory::Piece& piece : trajectory.pieces()) {
    const double from = times.back();
    for (std::size_t i = 1; i <= cells; ++i) {
      times.push_back(i == cells ? piece.node
                                 : std::lerp(from, piece.node, static_cast<double>(i) / static_cast<double>(cells)));
    }
  }
  return times;
}

/// Looks for the worst of check `j` between the samples beside the worst sample (golden section), and folds it.
void sharpen(const Shooting& shooting, const ArcTrace& arc, std::size_t j, double a, double b, double tolerance,
             std::vector<CheckResult>& results, std::size_t& place) {
  constexpr double golden = 0.6180339887498949;
  constexpr int sections = 40;
  const auto look = [&](double own) {
    const Sample at = sample(shooting, arc, own);
    fold(results, at.checks[j], at.time, tolerance, place);
    return badness(at.checks[j]);
  };
  double left = b - golden * (b - a), right = a + golden * (b - a);
  double at_left = look(left), at_right = look(right);
  for (int i = 1; i < sections; ++i) {
    if (at_left > at_right) {
      b = right;
      right = left;
      at_right = at_left;
      left = b - golden * (b - a);
      at_left = look(left);
    } else {
      a = left;
      left = right;
      at_left = at_right;
      right = a + golden * (b - a);
      at_right = look(right);
    }
  }
}

/// Every path check along one arc, at the samples and between those around the worst.
void check_arc(const Shooting& shooting, const ArcTrace& arc, double tolerance, std::vector<CheckResult>& results) {
  const std::vector<double> times = sample_times(arc.trajectory);
  std::vector<std::size_t> worst_at, place;
  std::vector<double> worst;
  for (std::size_t i = 0; i < times.size(); ++i) {
    const auto [time, checks] = sample(shooting, arc, times[i]);
    worst_at.resize(checks.size(), 0);
    place.resize(checks.size(), 0);
    worst.resize(checks.size(), -std::numeric_limits<double>::infinity());
    for (std::size_t j = 0; j < checks.size(); ++j) {
      fold(results, checks[j], time, tolerance, place[j]);
      if (badness(checks[j]) <= worst[j]) continue;
      worst[j] = badness(checks[j]);
      worst_at[j] = i;
    }
  }
  for (std::size_t j = 0; j < worst_at.size(); ++j) {
    const std::size_t i = worst_at[j];
    sharpen(shooting, arc, j, times[i == 0 ? 0 : i - 1], times[std::min(i + 1, times.size() - 1)], tolerance, results,
            place[j]);
  }
}

}  // namespace

std::string verify_root(Shooting& shooting, const Eigen::VectorXd& point, double accuracy, Solution& solution) {
  if (std::string objection = outside_domain(shooting.problem(), point); !objection.empty()) return objection;
  try {
    const Shot shot = shooting.evaluate(point);
    Eigen::Index worst = 0;
    solution.certificate.largest_residual =
        shooting.residual(shot).cwiseQuotient(shooting.row_scales()).cwiseAbs().maxCoeff(&worst);
    solution.certificate.largest_row = shooting.row_name(worst);
    solution.arcs = trace(shooting, shot);
  } catch (const LeftDomain& failure) {
    return fmt::format("the solution cannot be integrated at its own root: {}", failure.what());
  }
  // The arcs fill the time one after the other: one that runs backward in time would overlap its neighbour.
  const double slack = std::max(10.0 * accuracy, 1e-9) * std::max(1.0, solution.final_time());
  for (std::size_t i = 1; i < solution.arcs.size(); ++i) {
    const double gap = solution.arcs[i].begin - solution.arcs[i - 1].end;
    if (std::abs(gap) > slack) {
      return fmt::format(
          "the equations have a root, but it is no solution: the arcs {1} and {2} do not join at "
          "t = {3:.6g} s, {0:.3g} s apart; "
          "the arc structure is wrong for this scene",
          gap, solution.arcs[i - 1].record.arc + 1, solution.arcs[i].record.arc + 1, solution.arcs[i].begin);
    }
  }
  // What is left of a gap is error: one arc begins where the other ends.
  for (std::size_t i = 1; i < solution.arcs.size(); ++i) {
    solution.arcs[i].begin = std::min(solution.arcs[i - 1].end, solution.arcs[i].end);
  }
  solution.certificate.checks.clear();
  // Conditions along the arcs are known to the error of this integration, far better than the accuracy asked of the result, and
  // a switching function is small where it matters.
  const double tolerance = std::max(0.01 * accuracy, 1e-11);
  for (const ArcTrace& arc : solution.arcs) check_arc(shooting, arc, tolerance, solution.certificate.checks);
  for (const CheckResult& check : solution.certificate.checks) {
    if (!check.holds()) {
      return fmt::format(
          "the equations have a root, but it is no solution: {} is {:.3g} at t = {:.6g} s, must be {} 0; the arc "
          "structure is wrong for this scene",
          check.name, check.worst, check.time, check.kind == PathCheck::Kind::nonnegative ? "at least" : "equal to");
    }
  }
  return {};
}

}  // namespace costate
