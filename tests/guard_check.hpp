/// \file
/// What holds for the guards of any problem: their gradients are what differences say.
#pragma once

#include <costate/error.hpp>
#include <costate/shooting/shooting.hpp>

#include <gtest/gtest.h>

namespace costate::test {

/// Compares the gradients of all guards with differences, in every unknown and in every parameter but 0 (a step is relative to a parameter).
/// The differences are of fourth order, h⁴ times a fifth derivative of the order of the column; integrations err by 1e-13 in each of some
/// hundred steps, with what the guard makes of that `growth` times 1e-13, over h.
inline void expect_gradients_of_guards(Shooting& shooting, const Eigen::VectorXd& y, double growth = 1.0) {
  shooting.set_flow_options({.tolerance = {.relative = 1e-13, .absolute = 1e-13}, .max_steps = 20000});
  constexpr double h = 5e-4;
  const std::size_t count = shooting.evaluate(y).guards().size();
  ASSERT_GT(count, 0u);
  const auto compare = [&](const std::string& what, double size, const auto& at, const Eigen::VectorXd& exact) {
    const auto values = [&](double step) {
      const std::vector<Guard> guards = at(step).guards();
      EXPECT_EQ(guards.size(), count) << "their number belongs to the structure";
      Eigen::VectorXd result(static_cast<Eigen::Index>(count));
      for (std::size_t i = 0; i < count; ++i) result[static_cast<Eigen::Index>(i)] = guards[i].value.value;
      return result;
    };
    const Eigen::VectorXd difference = (values(-2.0) - 8.0 * values(-1.0) + 8.0 * values(1.0) - values(2.0)) /
                                       (12.0 * h * size);
    for (std::size_t i = 0; i < count; ++i) {
      const auto k = static_cast<Eigen::Index>(i);
      const double bound = 1e-13 * growth / (h * size) + 1e-8 * (1.0 + std::abs(exact[k]));
      EXPECT_NEAR(difference[k], exact[k], bound) << shooting.evaluate(y).guards()[i].name << " in " << what;
    }
  };
  const auto column = [&](const Shot& shot, Eigen::Index j) {
    Eigen::VectorXd result(static_cast<Eigen::Index>(count));
    for (std::size_t i = 0; i < count; ++i) {
      result[static_cast<Eigen::Index>(i)] = shot.guards()[i].value.derivative(static_cast<int>(j));
    }
    return result;
  };
  for (Eigen::Index j = 0; j < y.size(); ++j) {
    const double size = std::min(1.0, std::max(1e-2, std::abs(y[j])));
    const auto at = [&](double step) { return shooting.values(y + step * h * size * Eigen::VectorXd::Unit(y.size(), j)); };
    compare(shooting.problem().unknowns()[static_cast<std::size_t>(j)].name, size, at, column(shooting.evaluate(y), j));
  }
  const std::vector<double> parameters = shooting.parameters();
  for (std::size_t j = 0; j < parameters.size(); ++j) {
    if (parameters[j] == 0.0) continue;
    std::vector<double> path(parameters.size(), 0.0);
    path[j] = 1.0;
    const Eigen::VectorXd exact = column(shooting.evaluate(y, path), y.size());
    const auto at = [&](double step) {
      std::vector<double> moved = parameters;
      moved[j] += step * h * std::abs(parameters[j]);
      shooting.set_parameters(moved);
      Shot shot = shooting.values(y);
      shooting.set_parameters(parameters);
      return shot;
    };
    compare(shooting.problem().parameters()[j].name, std::abs(parameters[j]), at, exact);
  }
}

/// The value of a named guard. \throws BadInput if there is none.
inline double guard_value(const Shot& shot, const std::string& name) {
  for (const Guard& guard : shot.guards()) {
    if (guard.name == name) return guard.value.value;
  }
  throw BadInput("no guard " + name);
}

}  // namespace costate::test
