/// \file
/// What solutions of the test set are compared with: closed forms, else collocation.
#pragma once

#include "bvp_problems.hpp"
#include "collocation.hpp"

#include <costate/shooting/solution.hpp>

#include <fmt/format.h>
#include <limits>

namespace costate::bvp {

/// y(a) and y(b), and how far they are known, by their magnitude or 1. The last of the parameters is meant, the others lead the
/// collocation there.
struct Known {
  std::vector<double> start, end;
  double error = 0.0;
};

template <class P>
Known known(const std::vector<double>& parameters) {
  if constexpr (HasExact<P>) {
    return {exact<P>(P::a, parameters.back()), exact<P>(P::b, parameters.back()), 0.0};
  } else {
    const auto r = collocation::reference<System<P>>(parameters, 600);
    Known k{{}, {}, static_cast<double>(r.error)};
    for (const auto v : r.start) k.start.push_back(static_cast<double>(v));
    for (const auto v : r.end) k.end.push_back(static_cast<double>(v));
    return k;
  }
}

/// A solution beside what is known, by the magnitude of each value or 1.
struct Comparison {
  double error = 0.0;   ///< the largest
  double bound = 0.0;   ///< the largest claimed
  double excess = 0.0;  ///< the largest ratio of an error, less what the reference leaves open, to its bound
};

template <class P>
Comparison compare(const Solution& s, const Known& known) {
  using F = System<P>;
  Comparison c;
  for (const auto& [values, x] : {std::pair{known.start, F::a}, {known.end, F::b}}) {
    for (std::size_t i = 0; i < values.size(); ++i) {
      const Quantity& q = s[fmt::format("{}({})", F::names[i], x)];
      const double unit = std::max(1.0, std::abs(values[i]));
      const double error = std::abs(q.value - values[i]) / unit;
      // A closed form in doubles is known to some units of rounding, as values at the ends that are taken from it are.
      const double open = 2.0 * known.error + 8.0 * std::numeric_limits<double>::epsilon();
      c.error = std::max(c.error, error);
      c.bound = std::max(c.bound, q.error_bound / unit);
      if (error > open) c.excess = std::max(c.excess, (error - open) / (q.error_bound / unit));
    }
  }
  return c;
}

}  // namespace costate::bvp
