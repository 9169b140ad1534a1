/// Descent along given wires: two quadratures.
#include "coulomb_wire.hpp"
#include "quadrature.hpp"

#include <costate/error.hpp>
#include <costate/models/cycloid.hpp>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace costate::coulomb {

namespace {

constexpr double upright = std::numbers::pi / 2;

/// Rates of a wire in its parameter q ∈ [0, 1], and its slope from straight down.
struct WireRate {
  double dx, dy, b;
};

/// A wire whose slope is its parameter, b = b_F q: dx = ρ sin b db, dy = ρ cos b db. The radius ρ is constant (circle) or ∝
/// sin b (cycloid).
struct TurningWire {
  double end;     ///< b_F
  double radius;  ///< the largest
  bool cycloid;

  [[nodiscard]] WireRate at(double q) const {
    const double b = end * q, sine = std::sin(b);
    const double rate = end * (cycloid ? radius * sine : radius);
    return {rate * sine, rate * std::cos(b), b};
  }
};

/// The parabola, by w with sinh w its slope: analytic in a strip of width π about the real axis, however steep.
struct ParabolaWire {
  double start, width, turn;  ///< w at the start; dx = L·width·cosh w dq, w = start − turn·q
  double span;

  ParabolaWire(const Scene& scene, double epsilon) : span(scene.span) {
    const double chord = scene.drop / scene.span;
    const double first = chord * (1.0 + epsilon), last = chord * (1.0 - epsilon);
    start = std::asinh(first);
    // asinh a − asinh b = asinh((a² − b²)/(a√(1 + b²) + b√(1 + a²))) keeps its digits as ε → 0.
    const double ratio = 2.0 * chord / (first * std::hypot(1.0, last) + last * std::hypot(1.0, first));
    const double change = first - last;
    turn = last >= 0.0 ? std::asinh(change * ratio) : start - std::asinh(last);
    width = change == 0.0 ? ratio : turn / change;
  }
  [[nodiscard]] WireRate at(double q) const {
    const double w = start - turn * q, dx = span * width * std::cosh(w), slope = std::sinh(w);
    return {dx, dx * slope, std::atan2(1.0, slope)};
  }
};

/// Motion along a wire.
template <class Wire>
class Slide {
 public:
  Slide(const Wire& wire, double mu, double g) : wire_(wire), mu_(mu), g_(g), end_square_(square_between(0.0, 1.0)) {}

  /// Is the wire steep enough at the start for the bead to move?
  [[nodiscard]] bool moves() const {
    const WireRate rate = wire_.at(0.0);
    return std::cos(rate.b) > mu_ * std::sin(rate.b);
  }

  /// v² e^{2μb} at the end; the bead arrives if it is not negative.
  [[nodiscard]] double end_square() const { return end_square_; }
  [[nodiscard]] double end_speed() const { return std::sqrt(end_square_) * std::exp(-mu_ * wire_.at(1.0).b); }

  /// v² e^{2μb} at q, summed from the nearer end.
  [[nodiscard]] double square(double q, double rest) const {
    return q < 0.5 ? square_between(0.0, q) : end_square_ - square_between(q, rest);
  }
  [[nodiscard]] double speed(double q) const {
    return std::sqrt(std::max(0.0, square(q, 1.0 - q))) * std::exp(-mu_ * wire_.at(q).b);
  }
  [[nodiscard]] Integral<double> time() const { return time_between(0.0, 1.0); }
  /// From `first` over `length` of the parameter. The speed may vanish at either end.
  [[nodiscard]] Integral<double> time_between(double first, double length) const {
    Integral<double> t = integrate([&](double part, double other) {
      const double q = first + length * part, rest = (1.0 - first - length) + length * other;
      const WireRate rate = wire_.at(q);
      return std::hypot(rate.dx, rate.dy) * std::exp(mu_ * rate.b) / std::sqrt(square(q, rest));
    });
    return {t.value * length, t.change * length};
  }
  [[nodiscard]] double x(double q) const { return length_to(q, &WireRate::dx); }
  [[nodiscard]] double y(double q) const { return length_to(q, &WireRate::dy); }

  /// What rounding of the end's v² is worth in the time: much where the bead all but stops there.
  [[nodiscard]] double rounding(double time) const {
    Slide other = *this;
    other.end_square_ += square_rounding();
    return std::abs(other.time().value - time);
  }
  /// And in the end's speed.
  [[nodiscard]] double speed_rounding() const {
    return std::sqrt(end_square_ + square_rounding()) * std::exp(-mu_ * wire_.at(1.0).b) - end_speed();
  }

  /// Where the bead stops.
  [[nodiscard]] double stop() const {
    if (!moves()) return 0.0;
    const auto at = [&](double q) { return square_between(0.0, q); };  // beyond the stop it may be huge: nothing from there
    double moving = 0.5;
    while (!(at(moving) > 0.0)) moving *= 0.5;  // far on, e^{2μb} of a large μ overflows
    return bracketed_root(at, moving, 1.0);
  }

 private:
  [[nodiscard]] double square_between(double first, double length) const {
    if (length == 0.0) return 0.0;
    return 2.0 * g_ * length * integrate([&](double part, double) {
                                 const WireRate rate = wire_.at(first + length * part);
                                 return std::exp(2.0 * mu_ * rate.b) * (rate.dy - mu_ * rate.dx);
                               }).value;
  }
  [[nodiscard]] double square_rounding() const { return 1e-15 * (square(0.5, 0.5) + end_square_); }
  [[nodiscard]] double length_to(double q, double WireRate::*rate) const {
    return q == 0.0 ? 0.0 : q * integrate([&](double part, double) { return wire_.at(q * part).*rate; }).value;
  }

  Wire wire_;
  double mu_, g_, end_square_;
};

TurningWire circle_wire(const Scene& s) {
  return {2.0 * std::atan2(s.span, s.drop), (s.span * s.span + s.drop * s.drop) / (2.0 * s.span), false};
}

TurningWire cycloid_wire(const Scene& s) {
  const Cycloid free = cycloid(s.span, -s.drop, 0.0, s.gravity).value();
  return {free.psi2, 1.0 / (s.gravity * free.lambda_x * free.lambda_x), true};
}

/// The curve of [14] of [K], on which the motion is known in closed form: with it
///     y − 2μx = ½k sin²b e^{−4μb},   v = √(gk) sin b e^{−2μb},   t = √(k/g) (1 − e^{−2μb})/(2μ).
struct Gladkov {
  double mu, g, end, size;  ///< μ, g, b_F, k

  /// \pre 2μ ≤ H/L
  explicit Gladkov(const Scene& s) : mu(s.friction), g(s.gravity), end(std::numbers::pi), size(1.0) {
    const double excess = std::fma(-2.0 * mu, s.span, s.drop) / s.span;  // H/L − 2μ, (y − 2μx)/x at the end
    if (excess > 0.0) {
      const auto difference = [&](double logit) {
        const double pi = std::numbers::pi;
        end = pi / (1.0 + std::exp(-logit));
        const double sine = logit < 0.0 ? std::sin(end) : std::sin(pi / (1.0 + std::exp(logit)));
        return std::log(0.5 * sine * sine * std::exp(-4.0 * mu * end) / (excess * x(end)));
      };
      constexpr double widest = 60.0;  // φ from 1e-26 to within 1e-26 of π
      difference(bracketed_root(difference, -widest, widest));
    }
    size = s.span / x(end);
  }
  [[nodiscard]] double x(double b) const {
    return size * b * integrate([&](double q, double) {
                        const double sine = std::sin(b * q);
                        return sine * sine * std::exp(-4.0 * mu * b * q);
                      }).value;
  }
  [[nodiscard]] double y(double b) const {
    const double sine = std::sin(b);
    return 2.0 * mu * x(b) + 0.5 * size * sine * sine * std::exp(-4.0 * mu * b);
  }
  [[nodiscard]] double speed(double b) const { return std::sqrt(g * size) * std::sin(b) * std::exp(-2.0 * mu * b); }
  [[nodiscard]] double time(double b) const {
    return std::sqrt(size / g) * (mu == 0.0 ? b : -std::expm1(-2.0 * mu * b) / (2.0 * mu));
  }
};

/// The coefficient at which the bead just arrives, along a wire that does not depend on it. At every zero of the end's v²
/// e^{2μb} it falls with μ, so there is one.
template <class Wire>
double finish_limit(const Wire& wire, const Scene& s) {
  const auto end_square = [&](double mu) { return Slide(wire, mu, s.gravity).end_square(); };
  const double largest = largest_friction(s);  // not reached but by the straight line
  return end_square(largest) < 0.0 ? bracketed_root(end_square, 0.0, largest) : largest;
}

template <class Wire>
Descent slide_down(const Wire& wire, const Scene& s, double limit) {
  const Slide<Wire> slide(wire, s.friction, s.gravity);
  Descent result{.alpha0 = upright - wire.at(0.0).b, .alphaF = upright - wire.at(1.0).b, .limit = limit};
  if (slide.end_square() < 0.0) {
    const double q = slide.stop();
    result.end = Descent::End::stops;
    result.stop_x = slide.x(q);
    result.stop_y = slide.y(q);
    return result;
  }
  const Integral<double> time = slide.time();
  result.end = Descent::End::arrives;
  result.final_time = time.value;
  result.end_speed = slide.end_speed();
  result.time_bound = time.change + slide.rounding(time.value) + 1e-14 * time.value;
  result.speed_bound = slide.speed_rounding() + 1e-14 * result.end_speed;
  result.angle_bound = 1e-15;
  return result;
}

Descent descend_gladkov(const Scene& s) {
  Descent result{.alpha0 = upright, .limit = 0.5 * largest_friction(s)};
  if (!(std::fma(-2.0 * s.friction, s.span, s.drop) >= 0.0)) return result;
  const Gladkov curve(s);
  result.end = Descent::End::arrives;
  result.final_time = curve.time(curve.end);
  result.end_speed = curve.speed(curve.end);
  result.time_bound = 1e-13 * result.final_time;
  result.speed_bound = 1e-13 * curve.speed(0.5 * curve.end);
  result.angle_bound = 1e-13;
  result.alphaF = upright - curve.end;
  return result;
}

/// Calls `use` with the wire of a curve that does not depend on the friction.
template <class Use>
void with_wire(Curve curve, const Scene& s, double epsilon, const Use& use) {
  if (curve == Curve::circle) use(circle_wire(s));
  if (curve == Curve::cycloid) use(cycloid_wire(s));
  if (curve == Curve::parabola) use(ParabolaWire(s, epsilon));
}

Descent descend_kurilin(const Scene& scene) {
  Descent result{.limit = largest_friction(scene)};
  if (const std::optional<Kurilin> best = kurilin(scene)) {
    result.end = Descent::End::arrives;
    result.final_time = best->final_time;
    result.end_speed = best->end_speed;
    result.time_bound = best->time_bound * best->final_time;
    result.speed_bound = best->relative_bound * best->end_speed;
    result.angle_bound = best->angle_bound;
    result.alpha0 = best->alpha0;
    result.alphaF = best->alphaF;
  }
  return result;
}

}  // namespace

const char* name_of(Curve curve) {
  switch (curve) {
    case Curve::kurilin: return "kurilin";
    case Curve::cycloid: return "cycloid";
    case Curve::parabola: return "parabola";
    case Curve::circle: return "circle";
    case Curve::gladkov: return "gladkov";
  }
  return "";
}

void check_wire_scene(const Scene& scene, double epsilon) {
  const auto positive = [](const char* name, double value, const char* unit) {
    if (!(value > 0.0 && std::isfinite(value))) {
      throw BadInput(fmt::format("{} = {:g} {} is not admissible: a positive number", name, value, unit));
    }
  };
  positive("drop", scene.drop, "m");
  positive("span", scene.span, "m");
  positive("gravity", scene.gravity, "m/s^2");
  if (!(scene.friction >= 0.0 && std::isfinite(scene.friction))) {
    throw BadInput(fmt::format("mu = {:g} is not admissible: 0 or more", scene.friction));
  }
  if (!(epsilon >= 0.0 && std::isfinite(epsilon))) {
    throw BadInput(fmt::format("epsilon = {:g} is not admissible: 0 or more", epsilon));
  }
}

Descent descend(Curve curve, const Scene& scene, double epsilon) {
  check_wire_scene(scene, epsilon);
  if (curve == Curve::kurilin) return descend_kurilin(scene);
  if (curve == Curve::gladkov) return descend_gladkov(scene);
  Descent result;
  with_wire(curve, scene, epsilon, [&](const auto& wire) { result = slide_down(wire, scene, finish_limit(wire, scene)); });
  return result;
}

std::vector<DescentPoint> descent_points(Curve curve, const Scene& scene, double epsilon, int cells) {
  const Descent descent = descend(curve, scene, epsilon);
  if (descent.end != Descent::End::arrives) {
    throw BadInput(
        fmt::format("along the {} the bead does not arrive: admissible mu below {:.12g}", name_of(curve), descent.limit));
  }
  if (curve == Curve::kurilin) return kurilin_points(scene, kurilin(scene).value(), cells);
  std::vector<DescentPoint> points;
  if (curve == Curve::gladkov) {
    const Gladkov wire(scene);
    for (int i = 0; i <= cells; ++i) {
      const double b = wire.end * i / cells;
      points.push_back({wire.time(b), wire.x(b), wire.y(b), wire.speed(b), upright - b});
    }
    return points;
  }
  with_wire(curve, scene, epsilon, [&](const auto& wire) {
    const Slide slide(wire, scene.friction, scene.gravity);
    double t = 0.0;
    for (int i = 0; i <= cells; ++i) {
      const double q = static_cast<double>(i) / cells;
      if (i > 0) t += slide.time_between(static_cast<double>(i - 1) / cells, 1.0 / cells).value;
      points.push_back({t, slide.x(q), slide.y(q), i == 0 ? 0.0 : slide.speed(q), upright - wire.at(q).b});
    }
  });
  return points;
}

}  // namespace costate::coulomb
