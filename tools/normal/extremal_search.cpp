#include "extremal_search.hpp"

#include <costate/models/gauss.hpp>

#include <algorithm>
#include <cmath>
#include <optional>

namespace costate::normal_friction {

namespace {

/// A point of an extremal, at τ = θ₂ − θ, t before its end; lengths in units of v_f², times of v_f.
struct Place {
  double tau = 0.0, v = 1.0, lambda_v = 0.0;
  double curving = 1.0;  ///< Γ/q
  double t = 0.0, x = 0.0, y = 0.0;
  std::size_t arc = 0;  ///< counted from the end
};

/// An arc back from its end at τ = from; `turn` is +1 where τ grows backward, and `jump` the step of τ to the arc before it.
struct Arc {
  double from, turn;
  double length = 0.0, jump = 0.0;
};

/// All extremals with the end slope θ₂: one motion, of which each takes the last part.
class Family {
 public:
  Family(const Push<double>& push, double theta2) : push_(push), theta2_(theta2) {
    places_.push_back({});
    constexpr std::size_t most_arcs = 6;
    for (std::optional<double> from = 0.0; from && arcs_.size() < most_arcs;) {
      arcs_.push_back({*from, point(*from).d > 0.0 ? 1.0 : -1.0});
      from = walk(arcs_.back());
    }
  }

  [[nodiscard]] double theta2() const { return theta2_; }
  [[nodiscard]] const std::vector<Arc>& arcs() const { return arcs_; }
  [[nodiscard]] const std::vector<Place>& places() const { return places_; }

  /// The place at τ, next to another on the same arc: quadratures by Gauss's formula of four points.
  [[nodiscard]] Place after(const Place& last, double tau) const {
    const double half = 0.5 * (tau - last.tau), middle = 0.5 * (tau + last.tau);
    Place place = at(tau);
    place.t = last.t;
    place.x = last.x;
    place.y = last.y;
    place.arc = last.arc;
    for (const auto& [node, weight] : gauss_4) {
      for (const double side : {-1.0, 1.0}) {
        const SlopePoint<double> p = point(middle + side * half * node);
        const double time = half * weight * p.slowness();
        place.t += time;
        place.x += time * p.speed_ratio() * p.cosine;
        place.y += time * p.speed_ratio() * p.sine;
      }
    }
    return place;
  }

 private:
  template <class S>
  [[nodiscard]] SlopePoint<S> point(const S& tau) const {
    return {Push<S>{push_.x, push_.y, push_.cubic}, S(theta2_), tau};
  }
  [[nodiscard]] Place at(double tau) const {
    const SlopePoint<double> p = point(tau);
    Place place;
    place.tau = tau;
    place.v = p.speed_ratio();
    place.lambda_v = p.lambda_v();
    place.curving = p.gamma / p.q;
    return place;
  }
  [[nodiscard]] bool is_motion(double tau) const {
    constexpr double fastest = 1e9;  // v/v_f has a pole where q vanishes
    const Place place = at(tau);
    return place.v > 0.0 && place.v < fastest && place.curving >= 0.0;
  }

  /// How far an arc can be followed back at most.
  [[nodiscard]] double reach(const Arc& arc) const {
    constexpr double step = 0.01, most = 2.0 * std::numbers::pi;
    double low = 0.0, high = step;
    while (high < most && is_motion(arc.from + arc.turn * high)) {
      low = high;
      high += step;
    }
    for (int i = 0; i < 60; ++i) {
      const double middle = 0.5 * (low + high);
      (is_motion(arc.from + arc.turn * middle) ? low : high) = middle;
    }
    return low;
  }

  /// Tabulates the quadratures along an arc, closely at both ends, where the turn or the speed is small. Returns where the
  /// arc before it ends, if there is a corner.
  std::optional<double> walk(Arc& arc) {
    constexpr int cells = 140;
    constexpr double ends = 20.0;
    const double length = reach(arc);
    for (int i = 0; i <= cells; ++i) {
      const double u = length / (1.0 + std::exp(-ends * (2.0 * i / cells - 1.0)));
      const Place next = at(arc.from + arc.turn * u);
      const double rival = best_tau(next);
      if (std::abs(rival - next.tau) > 1e-3) {
        const auto corner = refine(next.tau, rival);
        // At the very start of an arc the rival is the slope that it has just been left for.
        if (!corner || (corner->first - places_.back().tau) * arc.turn <= 0.0) continue;
        return take(*corner, arc);
      }
      advance(next.tau);
    }
    const auto corner = across_cusps(arc, arc.from + arc.turn * length);
    return corner ? take(*corner, arc) : std::nullopt;
  }

  using Corner = std::pair<double, double>;  ///< τ after the corner and before it

  /// Ends the arc at a corner. Returns where the arc before it ends; nothing if the corner is not on the arc.
  std::optional<double> take(const Corner& corner, Arc& arc) {
    if ((corner.first - arc.from) * arc.turn <= 0.0) return std::nullopt;
    while ((places_.back().tau - corner.first) * arc.turn > 0.0) places_.pop_back();
    advance(corner.first);
    arc.length = std::abs(corner.first - arc.from);
    arc.jump = corner.second - corner.first;
    Place across = places_.back();
    across.tau = corner.second;
    ++across.arc;
    places_.push_back(across);
    return corner.second;
  }

  /// The corner over a narrow stretch with Γ/q < 0 that begins at τ, whose two maxima of H are too close to be told apart on
  /// a grid. There Γ is nearly a parabola, and equal areas make the jump √3 times as wide as the stretch.
  [[nodiscard]] std::optional<Corner> across_cusps(const Arc& arc, double tau) const {
    constexpr double step = 1e-3, widest = 0.3;
    double width = step;
    if (const Place next = at(tau + arc.turn * step); !(next.curving < 0.0 && next.v > 0.0)) return std::nullopt;
    while (width < widest && at(tau + arc.turn * width).curving < 0.0) width += step;
    const double middle = tau + 0.5 * arc.turn * width, half = 0.5 * std::numbers::sqrt3 * arc.turn * width;
    return refine(middle - half, middle + half);
  }

  /// τ of the slope that maximises H at a place, within π of the place's own.
  [[nodiscard]] double best_tau(const Place& place) const {
    const Vec<double, 3> c{place.v * std::cos(theta2_) + place.lambda_v * push_.x,
                           place.v * std::sin(theta2_) + place.lambda_v * push_.y, place.lambda_v * push_.cubic};
    // cos³θ = ¾ cos θ + ¼ cos 3θ: a first harmonic of more than nine times the third leaves one maximum.
    if (std::hypot(c[0] + 0.75 * c[2], c[1]) >= 2.25 * std::abs(c[2])) return place.tau;
    return place.tau + std::remainder(theta2_ - BestSlope::of(c) - place.tau, 2.0 * std::numbers::pi);
  }

  /// The two slopes with the same v and λv, by Newton's method on both.
  [[nodiscard]] std::optional<Corner> refine(double own, double rival) const {
    using D = Dual<double, 2>;
    const double jump = rival - own;
    for (int i = 0; i < 50; ++i) {
      const auto a = point(D::variable(own, 0)), b = point(D::variable(rival, 1));
      const D dv = a.speed_ratio() - b.speed_ratio(), dl = a.lambda_v() - b.lambda_v();
      const double determinant = dv.gradient[0] * dl.gradient[1] - dv.gradient[1] * dl.gradient[0];
      const double own_step = (dl.gradient[1] * dv.value - dv.gradient[1] * dl.value) / determinant;
      const double rival_step = (dv.gradient[0] * dl.value - dl.gradient[0] * dv.value) / determinant;
      own -= own_step;
      rival -= rival_step;
      if (!((rival - own) / jump > 0.1)) return std::nullopt;
      if (std::abs(own_step) + std::abs(rival_step) < 1e-12) return Corner(own, rival);
    }
    return std::nullopt;
  }

  void advance(double tau) {
    places_.push_back(after(places_.back(), tau));
    places_.back().arc = arcs_.size() - 1;
  }

  Push<double> push_;
  double theta2_;
  std::vector<Arc> arcs_;
  std::vector<Place> places_;
};

/// A member of a family that comes from v₀ over the wanted distance; `off` is the angle from the wanted direction to its
/// own.
struct Arrival {
  double tau, off, time;
  std::size_t arc;
};

/// The place between a and b at which `excess` vanishes, by the rule of false position (Illinois).
template <class F>
Place settle(const Family& family, const F& excess, const Place& a, double left, const Place& b, double right) {
  double low = a.tau, high = b.tau;
  Place place = a;
  for (int i = 0; i < 20; ++i) {
    place = family.after(a, low + left / (left - right) * (high - low));
    const double value = excess(place);
    if (std::abs(value) < 1e-12) break;
    if ((value > 0.0) == (right > 0.0)) {
      high = place.tau;
      right = value;
      left *= 0.5;
    } else {
      low = place.tau;
      left = value;
      right *= 0.5;
    }
  }
  return place;
}

std::vector<Arrival> arrivals(const Family& family, const Scene& scene) {
  const double wanted = std::log(std::hypot(scene.x, scene.y) / (scene.speed * scene.speed));
  const auto excess = [&](const Place& p) { return std::log(std::hypot(p.x, p.y)) - 2.0 * std::log(p.v) - wanted; };
  std::vector<Arrival> found;
  const std::vector<Place>& places = family.places();
  for (std::size_t i = 2; i < places.size(); ++i) {
    const Place &a = places[i - 1], &b = places[i];
    const double left = excess(a), right = excess(b);
    if (a.arc != b.arc || !(left * right <= 0.0)) continue;
    const Place p = settle(family, excess, a, left, b, right);
    found.push_back(
        {p.tau, std::atan2(p.y * scene.x - p.x * scene.y, p.x * scene.x + p.y * scene.y), scene.speed / p.v * p.t, p.arc});
  }
  return found;
}

Side side_of(double sign) { return sign > 0.0 ? Side::left : Side::right; }

RoughExtremal rough_extremal(const Family& family, const Arrival& arrival) {
  Chain chain{.theta2 = family.theta2(), .arcs = {}};
  for (std::size_t i = 0; i <= arrival.arc; ++i) {
    const Arc& arc = family.arcs()[i];
    const bool first = i == arrival.arc;
    chain.arcs.insert(chain.arcs.begin(), {.shape = {.turn = side_of(arc.turn), .jump = first ? Side::left : side_of(arc.jump)},
                                           .turn = first ? std::abs(arrival.tau - arc.from) : arc.length,
                                           .jump = first ? 0.0 : std::abs(arc.jump)});
  }
  return {chain.structure(), unknowns(chain), arrival.time};
}

/// The search over θ₂. The points at the wanted distance, v₀ wanted there, form a continuous front as θ₂ varies, also where
/// the structure changes; it ends where v_f → 0.
class Search {
 public:
  explicit Search(const Scene& scene) : scene_(scene), push_(push_of(scene)) {}

  std::vector<RoughExtremal> run() {
    constexpr int rows = 240;
    // The grid avoids round angles, at which d may vanish exactly.
    const auto row = [&](int i) { return member(std::numbers::pi * (2.0 * i / rows - 1.0) + 1e-3); };
    std::optional<Member> last = row(0);
    for (int i = 1; i <= rows; ++i) {
      Member next = row(i);
      compare(*last, next, 12);
      last.emplace(std::move(next));
    }
    std::sort(found_.begin(), found_.end(), [](const auto& a, const auto& b) { return a.time < b.time; });
    return std::move(found_);
  }

 private:
  struct Member {
    Family family;
    std::vector<Arrival> arrivals;
  };
  [[nodiscard]] Member member(double theta2) const {
    Family family(push_, theta2);
    std::vector<Arrival> list = arrivals(family, scene_);
    return {std::move(family), std::move(list)};
  }

  /// The arrival of a member that continues this one along the front, if any.
  static const Arrival* nearest(const Arrival& to, const Member& in) {
    constexpr double most = 0.3;
    const auto distance = [&](const Arrival& a) { return std::abs(a.off - to.off) + std::abs(std::log(a.time / to.time)); };
    const auto best = std::min_element(in.arrivals.begin(), in.arrivals.end(),
                                       [&](const Arrival& a, const Arrival& b) { return distance(a) < distance(b); });
    return best != in.arrivals.end() && distance(*best) < most ? &*best : nullptr;
  }

  /// The extremal between two points of the front at both sides of the wanted one, by the rule of false position (Illinois).
  void settle_between(double low, Arrival a, double high, Arrival b) {
    double left = a.off, right = b.off;
    for (int i = 0; i < 60; ++i) {
      const Member middle = member(low + left / (left - right) * (high - low));
      const Arrival* at = nearest(std::abs(a.off) < std::abs(b.off) ? a : b, middle);
      if (at == nullptr) return;
      if (std::abs(at->off) < 1e-10 || high - low < 1e-14) {
        found_.push_back(rough_extremal(middle.family, *at));
        return;
      }
      if ((at->off > 0.0) == (right > 0.0)) {
        high = middle.family.theta2();
        b = *at;
        right = at->off;
        left *= 0.5;
      } else {
        low = middle.family.theta2();
        a = *at;
        left = at->off;
        right *= 0.5;
      }
    }
  }

  /// The front between two members; more closely where a point of one has no counterpart in the other, since the front ends
  /// or turns back between.
  void compare(const Member& left, const Member& right, int depth) {
    std::vector<std::pair<const Arrival*, const Arrival*>> pairs;
    for (const Arrival& a : left.arrivals) {
      const Arrival* b = nearest(a, right);
      if (b != nullptr && nearest(*b, left) == &a) pairs.emplace_back(&a, b);
    }
    const bool matched = pairs.size() == left.arrivals.size() && pairs.size() == right.arrivals.size();
    if (!matched && depth > 0) {
      const Member middle = member(0.5 * (left.family.theta2() + right.family.theta2()));
      compare(left, middle, depth - 1);
      compare(middle, right, depth - 1);
      return;
    }
    for (const auto& [a, b] : pairs) {
      if (a->off * b->off <= 0.0) settle_between(left.family.theta2(), *a, right.family.theta2(), *b);
    }
    if (!matched) {
      turning(left, right);
      turning(right, left);
    }
  }

  /// Where the front turns back between a member and another: two points of it at both sides of the wanted one, close to
  /// each other.
  void turning(const Member& member, const Member& other) {
    const Arrival* last = nullptr;
    for (const Arrival& a : member.arrivals) {
      if (nearest(a, other) != nullptr) continue;
      if (last != nullptr && last->off * a.off <= 0.0 && std::abs(last->off - a.off) < 0.3) {
        found_.push_back(rough_extremal(member.family, std::abs(a.off) < std::abs(last->off) ? a : *last));
      }
      last = &a;
    }
  }

  Scene scene_;
  Push<double> push_;
  std::vector<RoughExtremal> found_;
};

}  // namespace

std::vector<RoughExtremal> find_extremals(const Scene& scene) { return Search(scene).run(); }

}  // namespace costate::normal_friction
