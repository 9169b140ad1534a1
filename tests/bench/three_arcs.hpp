/// \file
/// The yardstick of a problem of three arcs: the rolling disk saturated, free and saturated again (see costate/models/disk.hpp), by its
/// paper's equations (4.33)–(4.38), forward from the start, with difference Jacobians.
#pragma once

#include "yardstick.hpp"

namespace costate::bench {

/// Unknowns (V₀, t₁, t₂, t_f, λx, λy). With Ω = √(1 − V²), A = λx cos φ + λy sin φ: the saturated arcs have
///
///     φ' = Ω,  V' = ±√(κ² − V²Ω²),  λφ' = −V A_φ,  x' = V cos φ,  y' = V sin φ,
///
/// + before t₁ from φ = x = y = 0, V₀ and λφ = (1 − λx V₀)/Ω₀ (H = 0 where λ_V = 0), − behind t₂ from V = A. The free arc is that of
/// DiskArc. Rows: V = A and λφ = Ω at t₁; φ = π/2, x = a, y = b and 1 = A V + λφ Ω at t_f.
class ThreeArcs {
 public:
  using Unknowns = std::array<double, 6>;
  double kappa = 0.0525 * 9.80665;
  std::array<double, 2> end{1.0, 1.0};

  /// How derivatives are found.
  enum class Differences {
    whole,  ///< all arcs anew for each unknown, under error control
    shared,  ///< only what an unknown moves, by the steps of the unperturbed arcs; Jacobians are updated (Broyden) while that converges
  };

  Root<double, 6> solve(const Unknowns& start, const Ladder<double>& ladder, Differences differences) {
    first_ = {};
    last_ = {};
    free_ = {};
    Root<double, 6> root{.unknowns = start};
    Unknowns& u = root.unknowns;
    double tolerance = ladder.loosest, size = 0.0, before = 0.0;
    Matrix jacobian{};
    Unknowns residual{}, correction{};
    bool fresh = true;
    constexpr double far = 0.03, worst_contraction = 0.3;  // beyond these a Jacobian is worth its cost
    for (root.iterations = 1; root.iterations <= 40; ++root.iterations) {
      const Unknowns old = residual;
      if (!evaluate(u, tolerance, residual)) break;
      if (fresh) {
        const bool done = differences == Differences::whole ? by_whole(u, tolerance, residual, jacobian)
                                                            : by_shared(u, jacobian);
        if (!done) break;
      } else {
        update(jacobian, residual, old, correction);
      }
      correction = residual;
      Matrix factors = jacobian;
      if (!eliminate(factors, correction)) break;
      before = size;
      size = 0.0;
      for (std::size_t i = 0; i < 6; ++i) {
        u[i] -= correction[i];
        size = std::max(size, std::abs(correction[i]));
      }
      if (!(size < 1e3)) break;
      const double contraction = fresh ? size : size / before;
      if (tolerance == ladder.finest && size * contraction < ladder.enough * ladder.finest) {
        root.found = true;
        break;
      }
      fresh = differences == Differences::whole || size > far || (!fresh && contraction > worst_contraction);
      const double next = size * contraction;
      tolerance = std::clamp(fresh ? ladder.share * next * next : 0.1 * ladder.share * next * std::min(contraction, 1.0),
                             ladder.finest, ladder.loosest);
    }
    root.steps = first_.steps + free_.steps + last_.steps;
    root.evaluations = first_.evaluations + free_.evaluations + last_.evaluations;
    return root;
  }

  /// φ and λφ at t₁, to rounding.
  std::array<double, 2> first_junction(const Unknowns& u) {
    Saturated at = start(u);
    if (!first_.integrate(saturated(1.0, u), u[1], at, 1e-15)) return {std::nan(""), std::nan("")};
    return {at[0], at[2]};
  }

 private:
  using Saturated = std::array<double, 5>;  ///< φ, V, λφ, x, y
  using Free = std::array<double, 4>;       ///< φ, λφ, x, y
  using Matrix = std::array<Unknowns, 6>;

  struct SaturatedRates {
    double sign, square, lambda_x, lambda_y;
    void operator()(const Saturated& y, Saturated& rate) const {
      const double s = std::sin(y[0]), c = std::cos(y[0]), V = y[1], O2 = 1.0 - V * V;
      rate = {std::sqrt(O2), sign * std::sqrt(square - V * V * O2), V * (lambda_x * s - lambda_y * c), V * c, V * s};
    }
  };
  struct FreeRates {
    double lambda_x, lambda_y;
    void operator()(const Free& y, Free& rate) const {
      const double s = std::sin(y[0]), c = std::cos(y[0]), A = lambda_x * c + lambda_y * s;
      rate = {y[1], A * (lambda_x * s - lambda_y * c), A * c, A * s};
    }
  };
  [[nodiscard]] SaturatedRates saturated(double sign, const Unknowns& u) const { return {sign, kappa * kappa, u[4], u[5]}; }
  [[nodiscard]] static FreeRates free(const Unknowns& u) { return {u[4], u[5]}; }
  [[nodiscard]] static double along(const Unknowns& u, double phi) { return u[4] * std::cos(phi) + u[5] * std::sin(phi); }
  [[nodiscard]] static double turning(double V) { return std::sqrt(1.0 - V * V); }

  [[nodiscard]] static Saturated start(const Unknowns& u) {
    return {0.0, u[0], (1.0 - u[4] * u[0]) / turning(u[0]), 0.0, 0.0};
  }
  [[nodiscard]] static Free to_free(const Saturated& y) { return {y[0], y[2], y[3], y[4]}; }
  [[nodiscard]] static Saturated from_free(const Unknowns& u, const Free& y) {
    return {y[0], along(u, y[0]), y[1], y[2], y[3]};
  }
  [[nodiscard]] Unknowns rows(const Unknowns& u, const Saturated& junction, const Saturated& at) const {
    return {junction[1] - along(u, junction[0]),
            junction[2] - turning(junction[1]),
            at[0] - std::numbers::pi / 2,
            at[3] - end[0],
            at[4] - end[1],
            1.0 - along(u, at[0]) * at[1] - at[2] * turning(at[1])};
  }

  /// Keeps the ends of the arcs.
  bool evaluate(const Unknowns& u, double tolerance, Unknowns& residual) {
    ends_.first = start(u);
    if (!first_.integrate(saturated(1.0, u), u[1], ends_.first, tolerance)) return false;
    ends_.free = to_free(ends_.first);
    if (!free_.integrate(free(u), u[2] - u[1], ends_.free, tolerance)) return false;
    ends_.last = from_free(u, ends_.free);
    if (!last_.integrate(saturated(-1.0, u), u[3] - u[2], ends_.last, tolerance)) return false;
    residual = rows(u, ends_.first, ends_.last);
    for (const double row : residual) {
      if (!std::isfinite(row)) return false;
    }
    return true;
  }

  bool by_whole(Unknowns u, double tolerance, const Unknowns& residual, Matrix& jacobian) {
    const double step = std::sqrt(1e-2 *
                                  tolerance);  // what two integrations disagree by is some orders below their tolerance
    for (std::size_t j = 0; j < 6; ++j) {
      const double kept = u[j];
      u[j] += step;
      Unknowns moved;
      if (!evaluate(u, tolerance, moved)) return false;
      for (std::size_t i = 0; i < 6; ++i) jacobian[i][j] = (moved[i] - residual[i]) / step;
      u[j] = kept;
    }
    return true;
  }

  bool by_shared(const Unknowns& u, Matrix& jacobian) {
    constexpr double step = 1e-7;
    const Ends base = ends_;
    const Unknowns residual = rows(u, base.first, base.last);
    Saturated first_rate, last_rate;
    Free free_rate;
    saturated(1.0, u)(base.first, first_rate);
    free(u)(base.free, free_rate);
    saturated(-1.0, u)(base.last, last_rate);
    for (const std::size_t j : {0U, 1U, 2U, 3U, 4U, 5U}) {
      Unknowns v = u;
      v[j] += step;
      Ends moved = base;
      if (j == 0 || j > 3) {
        moved.first = start(v);
        if (!first_.repeat(saturated(1.0, v), v[1], moved.first)) return false;
      } else if (j == 1) {
        for (std::size_t i = 0; i < 5; ++i) moved.first[i] += step * first_rate[i];
      }
      if (j < 2 || j > 3) {
        moved.free = to_free(moved.first);
        if (!free_.repeat(free(v), v[2] - v[1], moved.free)) return false;
      } else if (j == 2) {
        for (std::size_t i = 0; i < 4; ++i) moved.free[i] += step * free_rate[i];
      }
      if (j != 3) {
        moved.last = from_free(v, moved.free);
        if (!last_.repeat(saturated(-1.0, v), v[3] - v[2], moved.last)) return false;
      } else {
        for (std::size_t i = 0; i < 5; ++i) moved.last[i] += step * last_rate[i];
      }
      const Unknowns changed = rows(v, moved.first, moved.last);
      for (std::size_t i = 0; i < 6; ++i) jacobian[i][j] = (changed[i] - residual[i]) / step;
    }
    return true;
  }

  /// Broyden's update after the step −correction.
  static void update(Matrix& jacobian, const Unknowns& residual, const Unknowns& old, const Unknowns& correction) {
    double square = 0.0;
    for (const double c : correction) square += c * c;
    for (std::size_t i = 0; i < 6; ++i) {
      double predicted = old[i];
      for (std::size_t j = 0; j < 6; ++j) predicted -= jacobian[i][j] * correction[j];
      const double factor = (residual[i] - predicted) / square;
      for (std::size_t j = 0; j < 6; ++j) jacobian[i][j] -= factor * correction[j];
    }
  }

  /// x of A x = b in the place of b, by elimination with row pivots. False if A is singular.
  static bool eliminate(Matrix& A, Unknowns& b) {
    for (std::size_t k = 0; k < 6; ++k) {
      std::size_t pivot = k;
      for (std::size_t i = k + 1; i < 6; ++i) {
        if (std::abs(A[i][k]) > std::abs(A[pivot][k])) pivot = i;
      }
      if (!(std::abs(A[pivot][k]) > 0.0)) return false;
      std::swap(A[k], A[pivot]);
      std::swap(b[k], b[pivot]);
      for (std::size_t i = k + 1; i < 6; ++i) {
        const double factor = A[i][k] / A[k][k];
        for (std::size_t j = k + 1; j < 6; ++j) A[i][j] -= factor * A[k][j];
        b[i] -= factor * b[k];
      }
    }
    for (std::size_t k = 6; k-- > 0;) {
      for (std::size_t j = k + 1; j < 6; ++j) b[k] -= A[k][j] * b[j];
      b[k] /= A[k][k];
    }
    return true;
  }

  struct Ends {
    Saturated first{};
    Free free{};
    Saturated last{};
  };
  Ends ends_;
  Dop853<5> first_, last_;
  Dop853<4> free_;
};

}  // namespace costate::bench
