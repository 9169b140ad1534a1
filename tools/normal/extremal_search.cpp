#include "extremal_search.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

namespace costate::normal_friction {

namespace {

/// A point of an extremal, u back from its end; lengths in units of v_f², times of v_f.
struct Place {
  double u = 0.0, v = 1.0, lambda_v = 0.0, curving = 1.0;  ///< curving: Γ/q
  double t = 0.0, x = 0.0, y = 0.0;
};

/// All extremals with the end slope θ₂, one inside the other.
class Family {
 public:
  Family(const Push<double>& push, double theta2) : push_(push), theta2_(theta2) {
    side_ = SlopePoint<double>(push, theta2, 0.0).d > 0.0 ? 1.0 : -1.0;
    find_reach();
    find_corners();
    walk();
  }

  [[nodiscard]] Side side() const { return side_ > 0.0 ? Side::left : Side::right; }
  [[nodiscard]] double theta2() const { return theta2_; }
  [[nodiscard]] const std::vector<CornerAngles>& corners() const { return corners_; }
  [[nodiscard]] const std::vector<Place>& places() const { return places_; }
  [[nodiscard]] std::size_t corners_before(double u) const {
    return static_cast<std::size_t>(std::count_if(corners_.begin(), corners_.end(), [&](const auto& c) { return c.before <= u; }));
  }

 private:
  template <class S>
  [[nodiscard]] SlopePoint<S> point(const S& u) const {
    return {Push<S>{push_.x, push_.y, push_.cubic}, S(theta2_), side_ * u};
  }
  [[nodiscard]] Place at(double u) const {
    const SlopePoint<double> p = point(u);
    return {.u = u, .v = p.speed_ratio(), .lambda_v = p.lambda_v(), .curving = p.gamma / p.q};
  }

  /// How far back the speed stays positive.
  void find_reach() {
    constexpr double step = 0.02, most = 2.0 * std::numbers::pi;
    double low = 0.0, high = step;
    while (high < most && at(high).v > 0.0) {
      low = high;
      high += step;
    }
    if (high < most) {
      for (int i = 0; i < 60; ++i) {
        const double middle = 0.5 * (low + high);
        (at(middle).v > 0.0 ? low : high) = middle;
      }
    }
    reach_ = low;
  }

  /// The points (v/v_f, λv) of all slopes form a curve. Where Γ/q < 0 it runs backward between two cusps, and the branches at
  /// both sides cross where both slopes maximise H.
  void find_corners() {
    constexpr int cells = 300;
    std::vector<std::vector<Place>> branches(1);
    bool backward = false;
    for (int i = 0; i < cells; ++i) {
      const Place place = at(reach_ * i / cells);
      if (place.curving < 0.0) {
        backward = true;
        continue;
      }
      if (backward) branches.emplace_back();
      backward = false;
      branches.back().push_back(place);
    }
    double from = 0.0;
    for (std::size_t i = 0; i + 1 < branches.size(); ++i) {
      const auto corner = crossing(branches[i], branches[i + 1], from);
      if (!corner) {
        reach_ = branches[i].back().u;  // what lies beyond is not joined to the end by a corner
        return;
      }
      corners_.push_back(*corner);
      from = corner->before;
    }
  }

  [[nodiscard]] std::optional<CornerAngles> crossing(const std::vector<Place>& later, const std::vector<Place>& earlier,
                                                     double from) const {
    const auto side = [](const Place& p, const Place& q, const Place& r) {
      return (q.v - p.v) * (r.lambda_v - p.lambda_v) - (q.lambda_v - p.lambda_v) * (r.v - p.v);
    };
    for (std::size_t i = 1; i < later.size(); ++i) {
      if (later[i - 1].u < from) continue;
      const Place &a = later[i - 1], &b = later[i];
      for (std::size_t j = 1; j < earlier.size(); ++j) {
        const Place &c = earlier[j - 1], &d = earlier[j];
        if (side(a, b, c) * side(a, b, d) > 0.0 || side(c, d, a) * side(c, d, b) > 0.0) continue;
        if (const auto found = refine({d.u, b.u})) return found;
      }
    }
    return std::nullopt;
  }

  /// Newton's method on both coordinates at once.
  [[nodiscard]] std::optional<CornerAngles> refine(CornerAngles angles) const {
    using D = Dual<double, 2>;
    for (int i = 0; i < 50; ++i) {
      const auto before = point(D::variable(angles.before, 0)), after = point(D::variable(angles.after, 1));
      const D dv = before.speed_ratio() - after.speed_ratio(), dl = before.lambda_v() - after.lambda_v();
      const double determinant = dv.gradient[0] * dl.gradient[1] - dv.gradient[1] * dl.gradient[0];
      const double step_before = (dl.gradient[1] * dv.value - dv.gradient[1] * dl.value) / determinant;
      const double step_after = (dv.gradient[0] * dl.value - dl.gradient[0] * dv.value) / determinant;
      angles.before -= step_before;
      angles.after -= step_after;
      if (!(angles.before > angles.after && angles.after > 0.0 && angles.before < reach_)) return std::nullopt;
      if (std::abs(step_before) + std::abs(step_after) < 1e-12) return angles;
    }
    return std::nullopt;
  }

  /// Tabulates the quadratures, closely at both ends, where the turn or the speed v₀ (or v_f) is small.
  void walk() {
    constexpr int cells = 120;
    constexpr double ends = 14.0;
    places_.push_back({});
    std::size_t next = 0;
    for (int i = 0; i <= cells; ++i) {
      const double z = ends * (2.0 * i / cells - 1.0);
      const double u = reach_ / (1.0 + std::exp(-z));
      while (next < corners_.size() && u > corners_[next].after) {
        advance(corners_[next].after);
        Place across = at(corners_[next].before);
        across.t = places_.back().t;
        across.x = places_.back().x;
        across.y = places_.back().y;
        places_.push_back(across);
        ++next;
      }
      if (u > places_.back().u) advance(u);
    }
  }

  void advance(double u) {
    // Gauss's formula of four points.
    constexpr double nodes[] = {-0.8611363115940526, -0.3399810435848563, 0.3399810435848563, 0.8611363115940526};
    constexpr double weights[] = {0.3478548451374538, 0.6521451548625461, 0.6521451548625461, 0.3478548451374538};
    const Place& last = places_.back();
    const double half = 0.5 * (u - last.u), middle = 0.5 * (u + last.u);
    Place place = at(u);
    place.t = last.t;
    place.x = last.x;
    place.y = last.y;
    for (std::size_t k = 0; k < 4; ++k) {
      const SlopePoint<double> p = point(middle + half * nodes[k]);
      const double time = half * weights[k] * side_ * p.slowness();
      place.t += time;
      place.x += time * p.speed_ratio() * p.cosine;
      place.y += time * p.speed_ratio() * p.sine;
    }
    places_.push_back(place);
  }

  Push<double> push_;
  double theta2_, side_ = 1.0, reach_ = 0.0;
  std::vector<CornerAngles> corners_;
  std::vector<Place> places_;
};

/// A member of a family that comes from v₀ over the wanted distance; `off` is the angle from the wanted direction to its own.
struct Arrival {
  double u, off, time;
  std::size_t corners;
};

std::vector<Arrival> arrivals(const Family& family, const Scene& scene) {
  const double wanted = std::log(std::hypot(scene.x, scene.y) / (scene.speed * scene.speed));
  std::vector<Arrival> found;
  const auto excess = [&](const Place& p) { return 0.5 * std::log(p.x * p.x + p.y * p.y) - 2.0 * std::log(p.v) - wanted; };
  const std::vector<Place>& places = family.places();
  for (std::size_t i = 2; i < places.size(); ++i) {
    const Place &a = places[i - 1], &b = places[i];
    if (a.x == b.x && a.y == b.y) continue;  // a corner
    const double left = excess(a), right = excess(b);
    if (!(left * right <= 0.0)) continue;
    const double s = left / (left - right);
    const auto between = [&](double p, double q) { return p + s * (q - p); };
    const double x = between(a.x, b.x), y = between(a.y, b.y);
    const double end_speed = scene.speed / between(a.v, b.v);
    found.push_back({between(a.u, b.u), std::atan2(y * scene.x - x * scene.y, x * scene.x + y * scene.y),
                     end_speed * between(a.t, b.t), family.corners_before(b.u)});
  }
  return found;
}

}  // namespace

Eigen::VectorXd RoughExtremal::unknowns() const {
  Eigen::VectorXd y(2 + 2 * static_cast<Eigen::Index>(corners.size()));
  y[0] = theta2;
  double from = 0.0;
  Eigen::Index next = 1;
  for (const CornerAngles& corner : corners) {
    y[next++] = std::log(corner.after - from);
    y[next++] = std::log(corner.before - corner.after);
    from = corner.before;
  }
  y[next] = std::log(turned - from);
  return y;
}

std::vector<RoughExtremal> find_extremals(const Scene& scene) {
  const Push<double> push = push_of(scene);
  constexpr int rows = 360;
  std::vector<RoughExtremal> extremals;
  std::optional<Family> last;
  std::vector<Arrival> before;
  for (int i = 0; i <= rows; ++i) {
    Family family(push, std::numbers::pi * (2.0 * i / rows - 1.0) + 1e-3);
    std::vector<Arrival> now = arrivals(family, scene);
    for (const Arrival& a : before) {
      for (const Arrival& b : now) {
        if (family.side() != last->side() || a.corners != b.corners || a.off * b.off > 0.0) continue;
        if (std::abs(a.off - b.off) > 1.0 || std::abs(a.u - b.u) > 0.3) continue;
        const double s = a.off / (a.off - b.off);
        const auto between = [&](double p, double q) { return p + s * (q - p); };
        RoughExtremal found{family.side(), between(last->theta2(), family.theta2()), between(a.u, b.u), {}, between(a.time, b.time)};
        for (std::size_t k = 0; k < a.corners; ++k) {
          found.corners.push_back({between(last->corners()[k].before, family.corners()[k].before),
                                   between(last->corners()[k].after, family.corners()[k].after)});
        }
        if (a.corners > 0 && found.turned <= found.corners.back().before) continue;
        extremals.push_back(std::move(found));
      }
    }
    last.emplace(std::move(family));
    before = std::move(now);
  }
  std::sort(extremals.begin(), extremals.end(), [](const auto& a, const auto& b) { return a.time < b.time; });
  return extremals;
}

}  // namespace costate::normal_friction
