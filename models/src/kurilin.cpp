/// The family of curves of [K], and the fastest of it.
#include "coulomb_wire.hpp"
#include "quadrature.hpp"

#include <costate/models/coulomb_curves.hpp>
#include <costate/models/cycloid.hpp>

#include <algorithm>
#include <cmath>

namespace costate::coulomb {

namespace {

/// A member of the family in units of g/ω for the speed and g/ω² for lengths, from b₀ over the turn Δ.
template <class S>
struct Member {
  double mu;
  S b0, turn;

  /// V after the turn θ, as a sum of two terms that are small where it is; sin 2m and cos 2m keep their digits as m → π/2.
  [[nodiscard]] S speed(const S& theta) const {
    const double sine = 2.0 * mu / (1.0 + mu * mu), cosine = (1.0 - mu * mu) / (1.0 + mu * mu);
    const S middle = b0 + 0.5 * theta;
    const S half = 0.5 * mu * theta;
    const S lost = primal(half) < 0.5 ? 2.0 * exp(-half) * sinh(half) : 1.0 - exp(-2.0 * half);  // 1 − e^{−μθ}
    return 2.0 * (cos(middle) * cosine - sin(middle) * sine) * sin(0.5 * theta) + lost * (sin(b0) * cosine + cos(b0) * sine);
  }
  [[nodiscard]] S x() const {
    return turn * integrate<S>([&](double q, double) { return speed(turn * q) * sin(b0 + turn * q); }).value;
  }
  /// y − μx
  [[nodiscard]] S fall() const {
    const S end = speed(turn);
    const S work = turn * integrate<S>([&](double q, double) {
                            const S v = speed(turn * q);
                            return v * v;
                          }).value;
    return 0.5 * end * end + mu * work;
  }
};

/// The members that pass through both points, by b₀.
class Family {
 public:
  explicit Family(const Scene& scene)
      : mu_(scene.friction),
        fall_(std::fma(-mu_, scene.span, scene.drop) / scene.span),
        chord_(std::atan2(scene.span, scene.drop)) {}

  /// b of the straight line to the end: every curve starts steeper.
  [[nodiscard]] double chord() const { return chord_; }

  /// The turn of the member of given b₀, or nothing if its bead stops before. (y − μx)/x falls as the turn grows.
  [[nodiscard]] std::optional<double> turn(double b0) const {
    const double driven = std::atan2(1.0, mu_) - b0;  // up to here gravity beats friction
    const double stop = bracketed_root([&](double theta) { return member(b0, 0.0).speed(theta); }, driven,
                                       std::numbers::pi - b0);
    const auto excess = [&](double turn) {
      const Member<double> at = member(b0, turn);
      return std::log(at.fall() / (at.x() * fall_));
    };
    if (!(excess(stop) < 0.0)) return std::nullopt;
    return bracketed_root(excess, 1e-30 * stop, stop);
  }

  /// d ln T/db₀ along the members through both points, T² ∝ Δ²/x.
  [[nodiscard]] double time_slope(double b0, double turn) const {
    using D = Dual<double, 2>;
    const Member<D> at{mu_, D::variable(b0, 0), D::variable(turn, 1)};
    const D x = at.x();
    const D time = log(at.turn) - 0.5 * log(x), constraint = log(at.fall() / x);
    return time.gradient[0] - time.gradient[1] * constraint.gradient[0] / constraint.gradient[1];
  }

  [[nodiscard]] Member<double> member(double b0, double turn) const { return {mu_, b0, turn}; }

 private:
  double mu_, fall_, chord_;
};

/// ω of a scene's member.
double turning_rate(const Scene& scene, double x) { return std::sqrt(scene.gravity * x / scene.span); }

}  // namespace

std::optional<Kurilin> kurilin(const Scene& scene) {
  check_wire_scene(scene, 0.0);
  if (!(scene.friction < largest_friction(scene))) return std::nullopt;
  constexpr double upright = std::numbers::pi / 2;
  if (scene.friction == 0.0) {
    const Cycloid free = cycloid(scene.span, -scene.drop, 0.0, scene.gravity).value();
    const double rate = scene.gravity * free.lambda_x;
    const double end_speed = std::sqrt(2.0 * scene.gravity * scene.drop);
    return Kurilin{upright, -free.theta2(), 2.0 * scene.gravity / (rate * rate), free.final_time, end_speed, 1e-14,
                   1e-14,   1e-14};
  }
  const Family family(scene);
  // Where b₀ is so small that the bead stops, the time falls towards larger b₀ as from infinity.
  const auto slope = [&](double b0) {
    const std::optional<double> turn = family.turn(b0);
    return turn ? family.time_slope(b0, *turn) : -1.0;
  };
  const double b0 = slope(0.0) < 0.0 ? bracketed_root(slope, 0.0, family.chord() * (1.0 - 1e-6)) : 0.0;
  const std::optional<double> turn = family.turn(b0);
  if (!turn) return std::nullopt;
  const Member<double> best = family.member(b0, *turn);
  const double rate = turning_rate(scene, best.x());
  // The stationarity condition, of terms of size 1/Δ, is known to rounding; b₀ and with it Δ to that over its slope.
  const double nearby = b0 + 1e-3 * (family.chord() - b0);
  const double curvature = std::abs(slope(nearby) / (nearby - b0));
  const double bound = 1e-15 * (b0 + *turn) + 4e-15 / (*turn * curvature);
  return Kurilin{upright - b0,
                 upright - b0 - *turn,
                 2.0 * scene.gravity / (rate * rate),
                 *turn / rate,
                 scene.gravity / rate * best.speed(*turn),
                 bound + 1e-15,
                 1e-13 + curvature * bound * bound,
                 1e-13 + 4.0 * bound / *turn};
}

std::vector<DescentPoint> kurilin_points(const Scene& scene, const Kurilin& curve, int cells) {
  const double b0 = std::numbers::pi / 2 - curve.alpha0, turn = curve.alpha0 - curve.alphaF;
  const double rate = turn / curve.final_time, unit = scene.gravity / (rate * rate);
  std::vector<DescentPoint> points;
  for (int i = 0; i <= cells; ++i) {
    const double theta = turn * i / cells;
    const Member<double> part{scene.friction, b0, theta};
    const double x = i == 0 ? 0.0 : part.x(), fall = i == 0 ? 0.0 : part.fall();
    points.push_back({curve.final_time * i / cells, unit * x, unit * (fall + scene.friction * x),
                      scene.gravity / rate * part.speed(theta), curve.alpha0 - theta});
  }
  return points;
}

}  // namespace costate::coulomb
