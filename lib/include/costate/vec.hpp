/// \file
/// Fixed-size vectors of a generic scalar, as models are written on them: `auto [x, y, phi] = state;`.
#pragma once

#include <array>
#include <cstddef>

namespace costate {

/// A vector in S^N.
template <class S, int N>
using Vec = std::array<S, static_cast<std::size_t>(N)>;

/// Inner product Σ aᵢ bᵢ of vectors over possibly different scalars; the result is of the richer one.
template <class A, class B, std::size_t N>
constexpr auto dot(const std::array<A, N>& a, const std::array<B, N>& b) {
  using R = decltype(A{} * B{});
  R sum{};
  for (std::size_t i = 0; i < N; ++i) sum = sum + a[i] * b[i];
  return sum;
}

/// The vector on a richer scalar (a constant there).
template <class R, class S, std::size_t N>
constexpr std::array<R, N> lift(const std::array<S, N>& a) {
  std::array<R, N> r{};
  for (std::size_t i = 0; i < N; ++i) r[i] = R(a[i]);
  return r;
}

}  // namespace costate
