/// \file
/// The integrator of the yardstick: what a good engineer writes by hand for one small system and no other.
///
/// Dormand & Prince's explicit Runge–Kutta method of order 8 with the error estimates of orders 5 and 3, step control and combined error
/// estimate as in DOP853 of Hairer, Nørsett & Wanner, Solving Ordinary Differential Equations I (2nd ed. 1993), II.5 and II.10,
/// whose coefficients these are. It shares nothing with the library.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace costate::bench {

/// Butcher's tableau: stages a, order 8 b, and what b is compared with for the errors of order 3 (d) and 5 (e).
template <class S>
struct Dop853Coefficients {
  static constexpr S a2_1 = S(5.26001519587677318785587544488e-2L);
  static constexpr S a3_1 = S(1.97250569845378994544595329183e-2L), a3_2 = S(5.91751709536136983633785987549e-2L);
  static constexpr S a4_1 = S(2.95875854768068491816892993775e-2L), a4_3 = S(8.87627564304205475450678981324e-2L);
  static constexpr S a5_1 = S(2.41365134159266685502369798665e-1L), a5_3 = S(-8.84549479328286085344864962717e-1L),
                     a5_4 = S(9.24834003261792003115737966543e-1L);
  static constexpr S a6_1 = S(3.7037037037037037037037037037e-2L), a6_4 = S(1.70828608729473871279604482173e-1L),
                     a6_5 = S(1.25467687566822425016691814123e-1L);
  static constexpr S a7_1 = S(3.7109375e-2L), a7_4 = S(1.70252211019544039314978060272e-1L),
                     a7_5 = S(6.02165389804559606850219397283e-2L), a7_6 = S(-1.7578125e-2L);
  static constexpr S a8_1 = S(3.70920001185047927108779319836e-2L), a8_4 = S(1.70383925712239993810214054705e-1L),
                     a8_5 = S(1.07262030446373284651809199168e-1L), a8_6 = S(-1.53194377486244017527936158236e-2L),
                     a8_7 = S(8.27378916381402288758473766002e-3L);
  static constexpr S a9_1 = S(6.24110958716075717114429577812e-1L), a9_4 = S(-3.36089262944694129406857109825L),
                     a9_5 = S(-8.68219346841726006818189891453e-1L), a9_6 = S(2.75920996994467083049415600797e1L),
                     a9_7 = S(2.01540675504778934086186788979e1L), a9_8 = S(-4.34898841810699588477366255144e1L);
  static constexpr S a10_1 = S(4.77662536438264365890433908527e-1L), a10_4 = S(-2.48811461997166764192642586468L),
                     a10_5 = S(-5.90290826836842996371446475743e-1L), a10_6 = S(2.12300514481811942347288949897e1L),
                     a10_7 = S(1.52792336328824235832596922938e1L), a10_8 = S(-3.32882109689848629194453265587e1L),
                     a10_9 = S(-2.03312017085086261358222928593e-2L);
  static constexpr S a11_1 = S(-9.3714243008598732571704021658e-1L), a11_4 = S(5.18637242884406370830023853209L),
                     a11_5 = S(1.09143734899672957818500254654L), a11_6 = S(-8.14978701074692612513997267357L),
                     a11_7 = S(-1.85200656599969598641566180701e1L), a11_8 = S(2.27394870993505042818970056734e1L),
                     a11_9 = S(2.49360555267965238987089396762L), a11_10 = S(-3.0467644718982195003823669022L);
  static constexpr S a12_1 = S(2.27331014751653820792359768449L), a12_4 = S(-1.05344954667372501984066689879e1L),
                     a12_5 = S(-2.00087205822486249909675718444L), a12_6 = S(-1.79589318631187989172765950534e1L),
                     a12_7 = S(2.79488845294199600508499808837e1L), a12_8 = S(-2.85899827713502369474065508674L),
                     a12_9 = S(-8.87285693353062954433549289258L), a12_10 = S(1.23605671757943030647266201528e1L),
                     a12_11 = S(6.43392746015763530355970484046e-1L);
  static constexpr S b1 = S(5.42937341165687622380535766363e-2L), b6 = S(4.45031289275240888144113950566L),
                     b7 = S(1.89151789931450038304281599044L), b8 = S(-5.8012039600105847814672114227L),
                     b9 = S(3.1116436695781989440891606237e-1L), b10 = S(-1.52160949662516078556178806805e-1L),
                     b11 = S(2.01365400804030348374776537501e-1L), b12 = S(4.47106157277725905176885569043e-2L);
  static constexpr S d1 = S(0.244094488188976377952755905512L), d9 = S(0.733846688281611857341361741547L),
                     d12 = S(0.220588235294117647058823529412e-1L);
  static constexpr S e1 = S(0.1312004499419488073250102996e-1L), e6 = S(-0.1225156446376204440720569753e1L),
                     e7 = S(-0.4957589496572501915214079952L), e8 = S(0.1664377182454986536961530415e1L),
                     e9 = S(-0.3503288487499736816886487290L), e10 = S(0.3341791187130174790297318841L),
                     e11 = S(0.8192320648511571246570742613e-1L), e12 = S(-0.2235530786388629525884427845e-1L);
};

/// y(T) of the autonomous y' = f(y), y(0) = y₀, N numbers. Allocates
/// nothing. What is left of an interval is shared equally by the last steps, and an integration begins with the step that would have
/// suited the start of the last one, scaled for the tolerance.
template <std::size_t N, class S = double>
class Dop853 {
 public:
  using Vector = std::array<S, N>;

  long steps = 0, evaluations = 0;

  /// Errors of a step are kept below tolerance·(1 + |yᵢ|) in the
  /// root mean square. Returns whether the end was reached, within 1000 steps.
  template <class F>
  bool integrate(const F& f, S duration, Vector& y, S tolerance) {
    f(y, k1_);
    ++evaluations;
    S h = first_ > S(0) ? first_ * eighth_root(tolerance / first_tolerance_) : first_step(f, y, tolerance);
    S left = duration;
    taken_ = 0;
    duration_ = duration;
    bool first = true, rejected = false;
    for (int count = 0; count < 1000; ++count) {
      // A step may be a twentieth longer than it should if that saves one.
      const S shares = std::ceil(left / h * S(0.95));
      const bool last = !(shares > S(1));
      h = last ? left : left / shares;
      step(f, h, y);
      ++steps;
      const S error = this->error(h, y, tolerance);
      const S factor = error > S(0) ? std::clamp(S(0.9) / eighth_root(error), S(1) / 3, S(6)) : S(6);
      if (!(error <= S(1))) {
        if (!(error < S(1e30))) return false;
        h *= std::min(factor, S(1));
        rejected = true;
        continue;
      }
      if (first) {
        first_ = h * factor;
        first_tolerance_ = tolerance;
        first = false;
      }
      y = next_;
      if (taken_ < most_taken) lengths_[taken_] = h;
      ++taken_;
      if (last) return true;
      left -= h;
      f(y, k1_);
      ++evaluations;
      h *= rejected ? std::min(factor, S(1)) : factor;
      rejected = false;
    }
    return false;
  }
  /// The same with the steps of the last integration, stretched to this duration, and no error control: a perturbed solution whose
  /// difference from the last one is smooth.
  template <class F>
  bool repeat(const F& f, S duration, Vector& y) {
    if (taken_ > most_taken) return false;
    const S stretch = duration / duration_;
    for (std::size_t i = 0; i < taken_; ++i) {
      f(y, k1_);
      step(f, stretch * lengths_[i], y);
      y = next_;
    }
    evaluations += static_cast<long>(taken_);
    steps += static_cast<long>(taken_);
    return true;
  }
  /// Takes the first step from another's last integration.
  template <std::size_t M>
  void begin_like(const Dop853<M, S>& other) {
    first_ = other.first_;
    first_tolerance_ = other.first_tolerance_;
  }

 private:
  template <std::size_t, class>
  friend class Dop853;

  static S eighth_root(S x) { return std::sqrt(std::sqrt(std::sqrt(x))); }

  /// II.4: a step for which the first derivative, and the second from an explicit Euler step, change little.
  template <class F>
  S first_step(const F& f, const Vector& y, S tolerance) {
    S size = 0, slope = 0;
    for (std::size_t i = 0; i < N; ++i) {
      const S scale = tolerance * (S(1) + std::abs(y[i]));
      size += (y[i] / scale) * (y[i] / scale);
      slope += (k1_[i] / scale) * (k1_[i] / scale);
    }
    const S h0 = slope > S(1e-10) && size > S(1e-10) ? S(0.01) * std::sqrt(size / slope) : S(1e-6);
    for (std::size_t i = 0; i < N; ++i) next_[i] = y[i] + h0 * k1_[i];
    f(next_, k2_);
    ++evaluations;
    S bend = 0;
    for (std::size_t i = 0; i < N; ++i) {
      const S change = (k2_[i] - k1_[i]) / (tolerance * (S(1) + std::abs(y[i])));
      bend += change * change;
    }
    const S most = std::max(std::sqrt(bend) / h0, std::sqrt(slope));
    const S h1 = most > S(1e-15) ? eighth_root(S(0.01) / most) : std::max(S(1e-6), S(1e-3) * h0);
    return std::min(S(100) * h0, h1);
  }

  /// One step of length h from y, whose rates are k1_: next_.
  template <class F>
  void step(F f, S h, const Vector& y) {
    using C = Dop853Coefficients<S>;
    const auto stage = [&](Vector& k, auto slope) {
      for (std::size_t i = 0; i < N; ++i) next_[i] = y[i] + h * slope(i);
      f(next_, k);
    };
    stage(k2_, [&](std::size_t i) { return C::a2_1 * k1_[i]; });
    stage(k3_, [&](std::size_t i) { return C::a3_1 * k1_[i] + C::a3_2 * k2_[i]; });
    stage(k4_, [&](std::size_t i) { return C::a4_1 * k1_[i] + C::a4_3 * k3_[i]; });
    stage(k5_, [&](std::size_t i) { return C::a5_1 * k1_[i] + C::a5_3 * k3_[i] + C::a5_4 * k4_[i]; });
    stage(k6_, [&](std::size_t i) { return C::a6_1 * k1_[i] + C::a6_4 * k4_[i] + C::a6_5 * k5_[i]; });
    stage(k7_, [&](std::size_t i) { return C::a7_1 * k1_[i] + C::a7_4 * k4_[i] + C::a7_5 * k5_[i] + C::a7_6 * k6_[i]; });
    stage(k8_, [&](std::size_t i) {
      return C::a8_1 * k1_[i] + C::a8_4 * k4_[i] + C::a8_5 * k5_[i] + C::a8_6 * k6_[i] + C::a8_7 * k7_[i];
    });
    stage(k9_, [&](std::size_t i) {
      return C::a9_1 * k1_[i] + C::a9_4 * k4_[i] + C::a9_5 * k5_[i] + C::a9_6 * k6_[i] + C::a9_7 * k7_[i] + C::a9_8 * k8_[i];
    });
    stage(k10_, [&](std::size_t i) {
      return C::a10_1 * k1_[i] + C::a10_4 * k4_[i] + C::a10_5 * k5_[i] + C::a10_6 * k6_[i] + C::a10_7 * k7_[i] +
             C::a10_8 * k8_[i] + C::a10_9 * k9_[i];
    });
    stage(k11_, [&](std::size_t i) {
      return C::a11_1 * k1_[i] + C::a11_4 * k4_[i] + C::a11_5 * k5_[i] + C::a11_6 * k6_[i] + C::a11_7 * k7_[i] +
             C::a11_8 * k8_[i] + C::a11_9 * k9_[i] + C::a11_10 * k10_[i];
    });
    stage(k12_, [&](std::size_t i) {
      return C::a12_1 * k1_[i] + C::a12_4 * k4_[i] + C::a12_5 * k5_[i] + C::a12_6 * k6_[i] + C::a12_7 * k7_[i] +
             C::a12_8 * k8_[i] + C::a12_9 * k9_[i] + C::a12_10 * k10_[i] + C::a12_11 * k11_[i];
    });
    evaluations += 11;
    for (std::size_t i = 0; i < N; ++i) {
      next_[i] = y[i] + h * (C::b1 * k1_[i] + C::b6 * k6_[i] + C::b7 * k7_[i] + C::b8 * k8_[i] + C::b9 * k9_[i] +
                             C::b10 * k10_[i] + C::b11 * k11_[i] + C::b12 * k12_[i]);
    }
  }

  /// The error of the last step, h from y to next_, in tolerances.
  S error(S h, const Vector& y, S tolerance) const {
    using C = Dop853Coefficients<S>;
    S fifth = 0, third = 0;
    for (std::size_t i = 0; i < N; ++i) {
      const S slope = C::b1 * k1_[i] + C::b6 * k6_[i] + C::b7 * k7_[i] + C::b8 * k8_[i] + C::b9 * k9_[i] + C::b10 * k10_[i] +
                      C::b11 * k11_[i] + C::b12 * k12_[i];
      const S weight = S(1) / (S(1) + std::max(std::abs(y[i]), std::abs(next_[i])));
      const S e3 = weight * (slope - C::d1 * k1_[i] - C::d9 * k9_[i] - C::d12 * k12_[i]);
      const S e5 = weight * (C::e1 * k1_[i] + C::e6 * k6_[i] + C::e7 * k7_[i] + C::e8 * k8_[i] + C::e9 * k9_[i] +
                             C::e10 * k10_[i] + C::e11 * k11_[i] + C::e12 * k12_[i]);
      third += e3 * e3;
      fifth += e5 * e5;
    }
    const S sum = fifth + S(0.01) * third;
    return sum > S(0) ? h * fifth / (tolerance * std::sqrt(S(N) * sum)) : S(0);
  }

  static constexpr std::size_t most_taken = 64;
  std::array<S, most_taken> lengths_{};
  std::size_t taken_ = 0;
  S duration_ = 1, first_ = 0, first_tolerance_ = 1;
  Vector next_{}, k1_{}, k2_{}, k3_{}, k4_{}, k5_{}, k6_{}, k7_{}, k8_{}, k9_{}, k10_{}, k11_{}, k12_{};
};
}  // namespace costate::bench
