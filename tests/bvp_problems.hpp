/// \file
/// From a problem of the test set to what is solved: one way to write second-order problems and systems, and their statement as
/// a TwoPoint.
#pragma once

#include "bvp_nonlinear.hpp"

#include <algorithm>
#include <string>
#include <vector>

namespace costate::bvp {

template <class P>
concept HasExact = requires {
  P::exact(0.5, 0.1);
};

/// y'' = second(x, y, y'; ε) as a system. Where the parameter is ε, slopes are of the order of those in a layer of width ε.
template <class P>
struct SecondOrder : P {
  static constexpr int states = 2, parameters = 1;
  static constexpr std::array names{"y", "y'"};
  template <class S>
  Vec<S, 2> rates(const S& x, const Vec<S, 2>& y, const Vec<S, 1>& p) const {
    return {y[1], P::second(x, y[0], y[1], p[0])};
  }
  static std::array<Ends, 2> ends(double epsilon) {
    std::array<double, 2> y{};
    if constexpr (HasExact<P>) {
      y = {P::exact(P::a, epsilon), P::exact(P::b, epsilon)};
    } else {
      y = P::ends(epsilon);
    }
    return {Ends{y[0], y[1]}, {open, open}};
  }
  static std::array<double, 2> scales(double epsilon) { return {1.0, std::max(1.0, 1.0 / epsilon)}; }
};

template <class P>
struct SystemOf {
  using type = SecondOrder<P>;
};
template <RightHandSide P>
struct SystemOf<P> {
  using type = P;
};
template <class P>
using System = typename SystemOf<P>::type;

/// The problem's statement. Its parameter is called "epsilon", whatever it is.
template <class P>
TwoPoint statement(double epsilon) {
  using F = System<P>;
  TwoPoint problem(F{}, F::a, F::b);
  const auto ends = F::ends(epsilon);
  for (std::size_t i = 0; i < ends.size(); ++i) {
    double scale = 1.0;
    if constexpr (requires { F::scales(epsilon); }) scale = F::scales(epsilon)[i];
    problem.state(F::names[i], {.start = ends[i].first, .end = ends[i].second, .scale = scale});
  }
  return problem.parameter("epsilon", epsilon);
}

/// y and y' of a problem solved in closed form.
template <HasExact P>
std::vector<double> exact(double x, double epsilon) {
  using D = Dual<double, 1>;
  const D y = P::exact(D::variable(x, 0), D(epsilon));
  return {y.value, y.gradient[0]};
}

}  // namespace costate::bvp
