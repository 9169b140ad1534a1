/// The parts of a branch, one after the other: what is common to all structures.
#include "tracer.hpp"

#include <costate/error.hpp>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace costate {

namespace {

void require_finite(double value, const char* what) {
  if (!std::isfinite(value)) throw BadInput(fmt::format("{} of a branch is {}: it must be a finite number", what, value));
}

}  // namespace

std::string structure_name(const Problem& problem) {
  std::string name;
  for (const std::string& arc : problem.structure()) name += (name.empty() ? "" : "-") + arc;
  return name;
}

Branch trace(std::shared_ptr<const Problem> problem, const std::vector<double>& parameters, const Eigen::VectorXd& y,
             const std::string& parameter, double to, const TraceOptions& options, const Restructure& restructure) {
  const std::size_t place = parameter_place(*problem, parameter);
  if (parameters.size() != problem->parameters().size()) {
    throw BadInput(
        fmt::format("{} parameter values given, the problem has {}", parameters.size(), problem->parameters().size()));
  }
  if (y.size() != static_cast<Eigen::Index>(problem->unknowns().size())) {
    throw BadInput(fmt::format("the start has {} values, the problem {} unknowns", y.size(), problem->unknowns().size()));
  }
  for (const double value : y) require_finite(value, "an unknown at the start");
  for (const double value : parameters) require_finite(value, "a parameter");
  require_finite(to, "the end");
  const double from = parameters[place];
  if (from == to)
    throw BadInput(fmt::format("the branch starts and ends at {} = {:g}: there is nothing to follow", parameter, to));
  for (const double landing : options.landings) {
    if (!(landing >= std::min(from, to) && landing <= std::max(from, to))) {
      throw BadInput(
          fmt::format("{} = {:g} cannot be landed on: the branch goes from {:g} to {:g}", parameter, landing, from, to));
    }
  }
  return Tracer(std::move(problem), parameters, place, to, options, restructure).run(y, std::nullopt);
}

std::vector<BranchReport> derivatives(Shooting& shooting, const Eigen::VectorXd& y, const std::string& parameter) {
  std::vector<double> path(shooting.parameters().size(), 0.0);
  path[parameter_place(shooting.problem(), parameter)] = 1.0;
  const Shot& shot = shooting.evaluate(y, path);
  const Eigen::VectorXd slopes = -shooting.jacobian(shot).partialPivLu().solve(shooting.path_derivative(shot));
  std::vector<BranchReport> result;
  for (const Report& report : shot.reports()) {
    double derivative = 0.0;
    for (const auto& entry : report.value.gradient()) {
      derivative += entry.derivative * (entry.column < slopes.size() ? slopes[entry.column] : 1.0);
    }
    result.push_back({report.name, report.unit, report.value.value, derivative});
  }
  return result;
}

Branch restart(const Branch& branch, std::size_t point, double to, const TraceOptions& options,
               const Restructure& restructure, bool backward) {
  if (point >= branch.points.size()) {
    throw BadInput(fmt::format("the branch has no point {}: it has {}", point, branch.points.size()));
  }
  const BranchPoint& start = branch.points[point];
  const Stretch& stretch = branch.stretches.at(start.stretch);
  std::vector<double> parameters = stretch.parameters;
  parameters[stretch.place] = start.parameter;
  require_finite(to, "the end");
  if (to == start.parameter)
    throw BadInput(fmt::format("the branch would start and end at {:g}: there is nothing to follow", to));
  const Eigen::VectorXd direction = backward ? Eigen::VectorXd(-start.tangent) : start.tangent;
  return Tracer(stretch.problem, parameters, stretch.place, to, options, restructure).run(start.y, direction);
}

}  // namespace costate
