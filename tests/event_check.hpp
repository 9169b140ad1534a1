/// \file
/// Whether scenes solved by themselves know the place of an event of a branch.
#pragma once

#include <costate/error.hpp>
#include <costate/shooting/branch.hpp>

#include <cmath>
#include <gtest/gtest.h>
#include <string>
#include <vector>

namespace costate::test {

/// The value of a named report. \throws BadInput if there is none.
inline double report(const BranchPoint& point, const std::string& name) {
  for (const BranchReport& report : point.reports) {
    if (report.name == name) return report.value;
  }
  throw BadInput("no report " + name);
}

/// A quantity that vanishes at the place, and of which the parameter is a smooth function, from five scenes on the way from there to
/// `side`: its zero by inverse interpolation. That is known to as much as the two farthest scenes matter.
template <class Quantity>
void expect_zero_at(double place, double side, const Quantity& quantity) {
  std::vector<double> values, places;
  for (const double part : {0.01, 0.02, 0.04, 0.06, 0.1}) {
    places.push_back(std::lerp(place, side, part));
    values.push_back(quantity(places.back()));
  }
  const auto interpolated = [&](std::size_t n) {
    double sum = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
      double weight = 1.0;
      for (std::size_t j = 0; j < n; ++j) weight *= i == j ? 1.0 : values[j] / (values[j] - values[i]);
      sum += weight * places[i];
    }
    return sum;
  };
  const double best = interpolated(5), fewer = interpolated(4), least = interpolated(3);
  const double unsure = std::abs(best - fewer) + std::abs(fewer - least);
  EXPECT_NEAR(best, place, unsure) << "on the way to " << side;
  EXPECT_LT(unsure, 0.5 * std::abs(places.front() - place)) << "else the comparison says nothing";
}

}  // namespace costate::test
