#include "verify.hpp"

#include <costate/error.hpp>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace costate {

namespace {

std::string outside_domain(const Problem& problem, const Eigen::VectorXd& y) {
  for (std::size_t i = 0; i < problem.unknowns().size(); ++i) {
    const Unknown& unknown = problem.unknowns()[i];
    const double value = y[static_cast<Eigen::Index>(i)];
    if (!(value > unknown.lower && value < unknown.upper)) {
      return fmt::format("the equations have a root, but it is no solution: {} = {:.9g} must lie within {:g} … {:g}; the arc "
                         "structure is wrong for this scene",
                         unknown.name, value, unknown.lower, unknown.upper);
    }
  }
  return {};
}

/// Integrates every arc again with dense output, ordered by time, the first starting at 0.
std::vector<ArcTrace> trace(Shooting& shooting, const Shot& shot) {
  std::vector<ArcTrace> traces;
  double origin = std::numeric_limits<double>::infinity();
  for (const ArcRecord& record : shot.arcs()) {
    Trajectory trajectory =
        shooting.flows()[*record.field].record(record.t0, record.t1, record.state, record.quadrature, record.parameter);
    const double a = record.clock + record.t0;
    const double b = record.clock + record.t1;
    traces.push_back({record, std::min(a, b), std::max(a, b), record.clock, std::move(trajectory)});
    origin = std::min(origin, traces.back().begin);
  }
  for (ArcTrace& arc : traces) {
    arc.begin -= origin;
    arc.end -= origin;
    arc.shift -= origin;
  }
  std::sort(traces.begin(), traces.end(), [](const ArcTrace& a, const ArcTrace& b) { return a.record.arc < b.record.arc; });
  return traces;
}

/// Keeps the worst value of each check met so far.
void fold(std::vector<CheckResult>& worst, const PathCheck& check, double t, double tolerance) {
  auto found = std::find_if(worst.begin(), worst.end(), [&](const CheckResult& c) { return c.name == check.name; });
  if (found == worst.end()) {
    worst.push_back({check.name, check.kind, check.value, t, tolerance});
  } else if (check.kind == PathCheck::Kind::nonnegative ? !(check.value >= found->worst)
                                                        : !(std::abs(check.value) <= std::abs(found->worst))) {
    found->worst = check.value;
    found->time = t;
  }
}

}  // namespace

std::string verify_root(Shooting& shooting, double accuracy, Solution& solution) {
  if (std::string objection = outside_domain(shooting.problem(), solution.y); !objection.empty()) return objection;
  try {
    const Shot shot = shooting.evaluate(solution.y);
    Eigen::Index worst = 0;
    solution.certificate.largest_residual =
        shooting.residual(shot).cwiseQuotient(shooting.row_scales()).cwiseAbs().maxCoeff(&worst);
    solution.certificate.largest_row = shooting.problem().rows()[static_cast<std::size_t>(worst)].name;
    solution.arcs = trace(shooting, shot);
  } catch (const LeftDomain& failure) {
    return fmt::format("the solution cannot be integrated at its own root: {}", failure.what());
  }
  constexpr int samples_per_step = 4;
  solution.certificate.checks.clear();
  for (const ArcTrace& arc : solution.arcs) {
    double from = arc.trajectory.start_time();
    for (const Trajectory::Piece& piece : arc.trajectory.pieces()) {
      for (int i = 0; i <= samples_per_step; ++i) {
        const double t = from + (piece.node - from) * i / samples_per_step;
        const Eigen::VectorXd both = arc.trajectory.at(t);
        const Eigen::Index n = arc.record.state.size();
        const ArcPoint point{&arc.record, t + arc.shift, both.head(n), both.tail(both.size() - n)};
        for (const PathCheck& check : shooting.problem().check(point, shooting.parameters())) {
          fold(solution.certificate.checks, check, point.t, accuracy);
        }
      }
      from = piece.node;
    }
  }
  for (const CheckResult& check : solution.certificate.checks) {
    if (!check.holds()) {
      return fmt::format("the equations have a root, but it is no solution: {} is {:.3g} at t = {:.6g} s, must be {} 0; the arc "
                         "structure is wrong for this scene",
                         check.name, check.worst, check.time,
                         check.kind == PathCheck::Kind::nonnegative ? "at least" : "equal to");
    }
  }
  return {};
}

}  // namespace costate
