#include <costate/error.hpp>
#include <costate/shooting/solution.hpp>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>
#include <fmt/format.h>

namespace costate {

bool CheckResult::holds() const {
  return kind == PathCheck::Kind::nonnegative ? worst >= -tolerance : std::abs(worst) <= tolerance;
}

bool Certificate::holds() const {
  return std::all_of(checks.begin(), checks.end(), [](const CheckResult& check) { return check.holds(); });
}

double ArcTrace::time(double own) const {
  if (record.time_quadrature) return point(own).t;
  return (record.clock + own - origin) * record.time_unit;
}

double ArcTrace::own(double wanted) const {
  if (!record.time_quadrature) return wanted / record.time_unit + origin - record.clock;
  double low = trajectory.start_time(), high = trajectory.end_time();
  if (time(low) > time(high)) std::swap(low, high);  // low and high in the order of time, not of their values
  if (wanted <= time(low)) return low;
  if (wanted >= time(high)) return high;
  while (true) {
    const double middle = std::midpoint(low, high);
    if (middle == low || middle == high) return middle;
    (time(middle) < wanted ? low : high) = middle;
  }
}

ArcPoint ArcTrace::point(double own) const {
  const Eigen::VectorXd both = trajectory.at(own);
  const Eigen::Index n = record.state.size();
  const double chain = record.time_quadrature ? both[n + *record.time_quadrature] : record.clock + own;
  return {&record, (chain - origin) * record.time_unit, both.head(n), both.tail(both.size() - n), own};
}

const Quantity& find(std::initializer_list<const std::vector<Quantity>*> lists, const std::string& name) {
  std::string known;
  for (const auto* list : lists) {
    for (const Quantity& quantity : *list) {
      if (quantity.name == name) return quantity;
      known += (known.empty() ? "" : ", ") + quantity.name;
    }
  }
  throw BadInput(fmt::format("the solution has no quantity '{}'; it has {}", name, known));
}

const Quantity& Solution::operator[](const std::string& name) const { return find({&reports, &unknowns}, name); }

double Solution::final_time() const { return arcs.empty() ? 0.0 : arcs.back().end; }

ArcPoint Solution::point(double t) const {
  if (arcs.empty()) throw BadInput("the solution has no trajectory: " + (message.empty() ? "it has no arcs" : message));
  if (!(t >= 0.0 && t <= final_time())) {
    throw BadInput(fmt::format("t = {:.17g} is outside the trajectory: admissible 0 … {:.17g}", t, final_time()));
  }
  // The last arc that begins at or before t.
  const auto next = std::upper_bound(arcs.begin(), arcs.end(), t,
                                     [](double wanted, const ArcTrace& arc) { return wanted < arc.begin; });
  const ArcTrace& arc = next == arcs.begin() ? arcs.front() : *std::prev(next);
  ArcPoint point = arc.point(arc.own(t));
  point.t = t;
  return point;
}

std::vector<double> Solution::at(double t) const { return problem->observe(point(t), parameters); }

}  // namespace costate
