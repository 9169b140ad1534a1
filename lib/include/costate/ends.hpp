/// \file
/// Functions of the ends of a trajectory: terminal cost Φ and end conditions Ψ = 0.
#pragma once

#include <costate/jet_function.hpp>

#include <utility>

namespace costate {

/// What an end function may depend on: q(0), q(T), T and the model's parameters.
template <class S, int n, int m>
struct Ends {
  Vec<S, n> start, end;
  S time;
  Vec<S, m> parameters;
};

/// A function of the ends with its gradient, both as jets.
class EndFunction {
 public:
  struct Expansion {
    Jet value;
    std::vector<Jet> start, end;  ///< derivatives with respect to q(0) and q(T) (n each)
    Jet time;                     ///< and to T
  };
  EndFunction() = default;
  EndFunction(const EndFunction&) = delete;
  EndFunction& operator=(const EndFunction&) = delete;
  virtual ~EndFunction() = default;
  /// At x = (q(0), q(T), T, p).
  [[nodiscard]] virtual Expansion at(const std::vector<Jet>& x) const = 0;
};

/// The end function of an `f(const Ends<S, n, m>&)` on a generic scalar.
template <int n, int m, class F>
class EndFunctionOf final : public EndFunction {
 public:
  explicit EndFunctionOf(F f) : f_(std::move(f)) {}

  [[nodiscard]] Expansion at(const std::vector<Jet>& x) const override {
    constexpr int size = 2 * n + 1 + m;
    const std::vector<Jet> values = on_jets<size>([this](const auto& at) { return expand(at); }, x);
    const auto end = values.begin() + 1 + n, time = end + n;
    return {values[0], {values.begin() + 1, end}, {end, time}, *time};
  }

 private:
  /// (f, f_q(0), f_q(T), f_T).
  template <class S, std::size_t size>
  Vec<S, 2 * n + 2> expand(const std::array<S, size>& x) const {
    constexpr int varied = 2 * n + 1;
    using D = Dual<S, varied>;
    auto moving = lift<D>(x);
    for (int i = 0; i < varied; ++i) moving[static_cast<std::size_t>(i)] = D::variable(x[static_cast<std::size_t>(i)], i);
    Ends<D, n, m> ends{};
    for (std::size_t i = 0; i < n; ++i) {
      ends.start[i] = moving[i];
      ends.end[i] = moving[i + n];
    }
    ends.time = moving[2 * n];
    for (std::size_t i = 0; i < m; ++i) ends.parameters[i] = moving[varied + i];
    const D value = f_(ends);
    Vec<S, 2 * n + 2> r{};
    r[0] = value.value;
    for (std::size_t i = 0; i < varied; ++i) r[i + 1] = value.gradient[i];
    return r;
  }

  F f_;
};

}  // namespace costate
