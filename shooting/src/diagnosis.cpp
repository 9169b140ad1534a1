#include "diagnosis.hpp"

#include <costate/error.hpp>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <numeric>

namespace costate {

namespace {

/// Places in order of a size, the largest first.
template <class Size>
std::vector<Eigen::Index> largest_first(Eigen::Index count, Size size) {
  std::vector<Eigen::Index> order(static_cast<std::size_t>(count));
  std::iota(order.begin(), order.end(), Eigen::Index{0});
  std::sort(order.begin(), order.end(), [&](Eigen::Index a, Eigen::Index b) { return size(a) > size(b); });
  return order;
}

/// Which rows and unknowns of the problem have a derivative that is not 0.
struct Dependence {
  std::vector<bool> rows, unknowns;
  [[nodiscard]] bool complete() const {
    const auto all = [](const std::vector<bool>& v) { return std::find(v.begin(), v.end(), false) == v.end(); };
    return all(rows) && all(unknowns);
  }
};

Dependence dependence(const Shooting& shooting, const Shot& shot) {
  const auto border = static_cast<std::size_t>(shooting.border());
  Dependence d{std::vector<bool>(border), std::vector<bool>(border)};
  for (Eigen::Index i = 0; i < shooting.size(); ++i) {
    for (const auto& entry : shooting.row(shot, i).gradient()) {
      if (entry.derivative == 0.0) continue;
      if (i < shooting.border()) d.rows[static_cast<std::size_t>(i)] = true;
      if (entry.column < shooting.border()) d.unknowns[static_cast<std::size_t>(entry.column)] = true;
    }
  }
  return d;
}

}  // namespace

std::string worst_rows(const Shooting& shooting, const Eigen::VectorXd& residual) {
  const Eigen::VectorXd scaled = residual.cwiseQuotient(shooting.row_scales()).cwiseAbs();
  std::string text;
  const auto order = largest_first(scaled.size(), [&](Eigen::Index i) { return scaled[i]; });
  for (std::size_t i = 0; i < std::min<std::size_t>(3, order.size()); ++i) {
    text += fmt::format("{}{}: {:.2e}", i == 0 ? "" : ", ", shooting.row_name(order[i]), residual[order[i]]);
  }
  return text;
}

std::string weakest_direction(const Shooting& shooting, const Staircase& jacobian) {
  // Nodes follow what the unknowns of the problem do.
  const Eigen::VectorXd direction = jacobian.weakest().head(shooting.border()).normalized();
  std::string text;
  const auto order = largest_first(direction.size(), [&](Eigen::Index i) { return std::abs(direction[i]); });
  for (std::size_t i = 0; i < std::min<std::size_t>(3, order.size()); ++i) {
    const double part = direction[order[i]];
    if (!(std::abs(part) > 0.1)) break;
    text += i == 0 ? (part < 0.0 ? "-" : "") : (part < 0.0 ? " - " : " + ");
    text += fmt::format("{:.2f} {}", std::abs(part), shooting.unknown_name(order[i]));
  }
  return text;
}

void check_well_posed(Shooting& shooting, const Eigen::VectorXd& y) {
  Dependence found;
  Eigen::VectorXd values;
  try {
    const Shot& shot = shooting.evaluate(y);
    values = shooting.residual(shot);
    found = dependence(shooting, shot);
    if (found.complete()) return;
    // A derivative may vanish at one point by chance.
    Eigen::VectorXd beside = y;
    for (Eigen::Index j = 0; j < y.size(); ++j)
      beside[j] += 1e-2 * shooting.unknown_scales()[j] * (1.0 + 0.1 * std::sin(static_cast<double>(j + 1)));
    const Dependence there = dependence(shooting, shooting.evaluate(beside));
    for (std::size_t i = 0; i < found.rows.size(); ++i) {
      found.rows[i] = found.rows[i] || there.rows[i];
      found.unknowns[i] = found.unknowns[i] || there.unknowns[i];
    }
  } catch (const LeftDomain&) {
    return;  // Where the problem cannot be evaluated nothing is known yet.
  }
  for (std::size_t i = 0; i < found.rows.size(); ++i) {
    if (found.rows[i]) continue;
    const double value = values[static_cast<Eigen::Index>(i)];
    throw BadInput(fmt::format("the row '{}' depends on no unknown: it is {:.6g} whatever they are, so that {}",
                               shooting.row_name(static_cast<Eigen::Index>(i)), value,
                               value == 0.0 ? "it says nothing" : "no solution can fulfil it"));
  }
  for (std::size_t j = 0; j < found.unknowns.size(); ++j) {
    if (found.unknowns[j]) continue;
    throw BadInput(fmt::format("no row depends on the unknown '{}': nothing determines it",
                               shooting.unknown_name(static_cast<Eigen::Index>(j))));
  }
}

}  // namespace costate
