/// \file
/// Functions on a generic scalar, evaluated on jets.
#pragma once

#include <costate/jet.hpp>
#include <costate/vec.hpp>

#include <vector>

namespace costate {

/// y = f(x) for N inputs given as jets. `f` maps a Vec<S, N> to a vector of S on any scalar; its Jacobian is found by dual numbers
/// and the chain rule does the rest. An input without a gradient costs nothing in the result, and may be infinite.
template <int N, class F>
std::vector<Jet> on_jets(const F& f, const std::vector<Jet>& inputs) {
  using D = Dual<double, N>;
  Vec<D, N> x{};
  for (int i = 0; i < N; ++i) {
    const Jet& input = inputs.at(static_cast<std::size_t>(i));
    x[static_cast<std::size_t>(i)] = input.gradient().empty() ? D(input.value) : D::variable(input.value, i);
  }
  std::vector<Jet> results;
  for (const D& y : f(x)) {
    Jet result(y.value);
    for (std::size_t i = 0; i < inputs.size(); ++i) {
      if (!inputs[i].gradient().empty()) result += Jet::chain(inputs[i], 0.0, y.gradient[i]);
    }
    results.push_back(std::move(result));
  }
  return results;
}

}  // namespace costate
