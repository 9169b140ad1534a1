#include "extremal_search.hpp"

#include <costate/models/gauss.hpp>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

namespace costate::drag {

namespace {

using Plane = Eigen::Vector2d;
using Sensitive = Dual<double, 2>;

constexpr double infinity = std::numeric_limits<double>::infinity();

template <class S>
struct Reached {
  S x{}, y{}, t{};
  bool forward = true;  ///< N > 0 all the way; else the phase curve is no motion
  void add(const Rates<S, 0, 3>& r, const S& share) {
    x += r.quadrature[0] * share;
    y += r.quadrature[1] * share;
    t += r.quadrature[2] * share;
    forward = forward && primal(r.quadrature[2]) * primal(share) > 0.0;
  }
  [[nodiscard]] bool admissible() const { return forward && primal(x) > 0.0 && isfinite(x) && isfinite(y) && isfinite(t); }
};

/// ∫ over u from `outer` to `inner` on one side, counted forward in time, on panels that grow: the integrand varies at the
/// outer end and within some units of η = 0.
template <class Orbit, class S>
void integrate(const Orbit& orbit, double side, const S& outer, const S& inner, Reached<S>& sum) {
  const double length = std::abs(primal(inner) - primal(outer));
  if (!(length > 0.0 && length < 1e12)) return;
  double begin = 0.0, panel = 0.6;
  while (begin < length) {
    const double at = std::lerp(primal(outer), primal(inner), begin / length);
    const double limit = std::max(1.2, 0.5 * std::abs(at - primal(orbit.middle())));
    const double wide = std::min(panel, limit);
    const double end = begin + 1.4 * wide >= length ? length : begin + wide;
    for (const auto& [node, weight] : gauss) {
      for (const double sign : {-1.0, 1.0}) {
        const double u = (0.5 * (begin + end) + 0.5 * (end - begin) * sign * node) / length;
        const S span = inner - outer;
        sum.add(rates_along(orbit, S(outer + u * span), side), span * (-side * 0.5 * weight * (end - begin) / length));
      }
    }
    begin = end;
    panel *= 1.6;
  }
}

/// Where the path from one place on an orbit to another leads.
template <class Orbit, class S>
Reached<S> travel(const Orbit& orbit, const S& start, const S& end) {
  Reached<S> sum;
  switch (arcs_between(orbit, start, end)) {
    case Arcs::from_start: integrate(orbit, -1.0, orbit.variable(start, -1.0), orbit.variable(end, -1.0), sum); break;
    case Arcs::from_end: integrate(orbit, 1.0, orbit.variable(end, 1.0), orbit.variable(start, 1.0), sum); break;
    case Arcs::from_both:
      integrate(orbit, -1.0, orbit.variable(start, -1.0), orbit.middle(), sum);
      integrate(orbit, 1.0, orbit.variable(end, 1.0), orbit.middle(), sum);
      break;
  }
  sum.forward = sum.forward &&
                isfinite(primal(orbit.at_place(start).rate));  // between the nodes D may turn negative at an end
  return sum;
}

/// A family of orbits over two coordinates of order one to ten, in which its sheet is smooth and its limits are far.
class Sheet {
 public:
  Sheet(Family family, double sense, const Scaled<double>& scene) : family_(family), sense_(sense), scene_(scene) {
    const auto bound = [&](double above) { return first_steep_speed(above); };
    top_ = family == Family::turning ? bound(scene.v0) : bound(0.0);
    if (family == Family::passing && scene.friction.beta > 0.0) {
      top_ = std::min(top_, std::sqrt(scene.friction.mu / (3.0 * scene.friction.beta)));
    }
  }

  /// Where the orbits end, or nothing where there is none.
  template <class S>
  std::optional<Reached<S>> reach(const S& alpha, const S& gamma) const {
    const Friction<S> friction{scene_.friction.mu, scene_.friction.beta};
    const auto [first, second] = constants(alpha, gamma);
    Reached<S> end;
    switch (family_) {
      case Family::turning: {
        const TurningOrbit<S> orbit(scene_.v0 * sqrt(1.0 + first * first), sinh(second), friction);
        end = travel(orbit, first, orbit.end_place());
        break;
      }
      case Family::passing: {
        const PassingOrbit<S> orbit(first, second, friction);
        end = travel(orbit, S(scene_.v0), orbit.end_place());
        break;
      }
      case Family::monotone: {
        const MonotoneOrbit<double> plain(primal(first), primal(second), scene_.friction);
        if (plain.sense != sense_) return std::nullopt;
        const SpeedMap map = speed_map(plain.constants, scene_.v0, plain.end_speed);
        const MonotoneOrbit<S> orbit(first, second, friction, map);
        end = travel(orbit, S(scene_.v0), first);
        break;
      }
    }
    return end.admissible() ? std::optional(end) : std::nullopt;
  }

  /// The end point of an orbit against the wanted one, 0 if they agree.
  template <class S>
  std::array<S, 2> miss(const Reached<S>& end) const {
    const S slope = end.y / end.x;
    const double wanted = scene_.y / scene_.x;
    const S size = abs(slope);
    const S inverse_sinh = log(size + sqrt(1.0 + slope * slope));
    return {log(end.x / scene_.x), (primal(slope) < 0.0 ? -inverse_sinh : inverse_sinh) - std::asinh(wanted)};
  }

  [[nodiscard]] Guess guess(const Plane& at) const {
    const auto [first, second] = constants(at[0], at[1]);
    return {family_, first, second, reach(at[0], at[1])->t};
  }

 private:
  /// The constants of the orbit (see Guess).
  template <class S>
  std::array<S, 2> constants(const S& alpha, const S& gamma) const {
    switch (family_) {
      case Family::turning: {
        const S s = sinh(alpha);
        if (top_ == infinity) return {s, gamma};
        const double square = (top_ / scene_.v0) * (top_ / scene_.v0) - 1.0;  // v₁ stays below the top
        return {s / sqrt(1.0 + s * s * (1.0 / square)), gamma};
      }
      case Family::passing: {
        const S speed = exp(alpha) * scene_.v0;
        return {top_ == infinity ? speed : speed / (1.0 + speed * (1.0 / top_)), sinh(gamma)};
      }
      case Family::monotone: {
        const S v = sense_ > 0.0 ? scene_.v0 * (1.0 + exp(alpha)) : scene_.v0 / (1.0 + exp(-alpha));
        const S K = Friction<S>{scene_.friction.mu, scene_.friction.beta}.force(v);
        constexpr double right = std::numbers::pi / 2;
        const S steady = primal(K) >= 1.0 ? S(right) : primal(K) <= -1.0 ? S(-right) : asin(K);
        const S share = 1.0 / (1.0 + exp(gamma));
        return {v, sense_ > 0.0 ? -right + (steady + right) * share : right - (right - steady) * share};
      }
    }
    return {};
  }

  /// The least speed above the given one at which |K| = 1: no bead can keep its speed there.
  [[nodiscard]] double first_steep_speed(double above) const {
    const auto excess = [&](double v) { return std::abs(scene_.friction.force(v)) - 1.0; };
    if (excess(above) >= 0.0) return above;
    // K is a cubic: between speeds that grow by 2 % it does not cross ±1 twice by more than that.
    double low = std::max(above, 1e-9);
    for (double high = low; high < 1e9; high *= 1.02) {
      if (excess(high) < 0.0) {
        low = high;
        continue;
      }
      for (int i = 0; i < 100; ++i) {
        const double middle = 0.5 * (low + high);
        (excess(middle) < 0.0 ? low : high) = middle;
      }
      return low;
    }
    return infinity;
  }

  Family family_;
  double sense_;
  const Scaled<double>& scene_;
  double top_ = infinity;
};

/// A regular grid over the coordinates of a sheet.
struct Grid {
  double alpha0, alpha1, gamma0, gamma1, step;
  [[nodiscard]] int columns() const { return static_cast<int>((alpha1 - alpha0) / step) + 1; }
  [[nodiscard]] int rows() const { return static_cast<int>((gamma1 - gamma0) / step) + 1; }
  [[nodiscard]] Plane at(int i, int j) const { return {alpha0 + i * step, gamma0 + j * step}; }
};

class Search {
 public:
  Search(const Sheet& sheet, const Grid& grid) : sheet_(sheet), grid_(grid) {
    for (int i = 0; i < grid.columns(); ++i) {
      for (int j = 0; j < grid.rows(); ++j) {
        const Plane at = grid.at(i, j);
        const auto end = sheet.reach(at[0], at[1]);
        if (!end) {
          image_.emplace_back(std::nullopt);
          continue;
        }
        const auto miss = sheet.miss(*end);
        image_.emplace_back(Plane(miss[0], miss[1]));
      }
    }
  }

  [[nodiscard]] std::vector<Guess> run() const {
    std::vector<Guess> found;
    for (const Plane& start : starts()) {
      if (const auto root = newton(start)) found.push_back(sheet_.guess(*root));
    }
    return found;
  }

 private:
  [[nodiscard]] const std::optional<Plane>& image(int i, int j) const {
    return image_[static_cast<std::size_t>(i * grid_.rows() + j)];
  }

  /// Points in triangles whose images hold 0, and the nodes nearest to it.
  [[nodiscard]] std::vector<Plane> starts() const {
    std::vector<Plane> points;
    std::vector<std::pair<double, Plane>> nodes;
    for (int i = 0; i < grid_.columns(); ++i) {
      for (int j = 0; j < grid_.rows(); ++j) {
        if (image(i, j)) nodes.emplace_back(image(i, j)->norm(), grid_.at(i, j));
        if (i + 1 == grid_.columns() || j + 1 == grid_.rows()) continue;
        add_inside({{{i, j}, {i + 1, j}, {i, j + 1}}}, points);
        add_inside({{{i + 1, j + 1}, {i, j + 1}, {i + 1, j}}}, points);
      }
    }
    const std::size_t nearest = std::min<std::size_t>(4, nodes.size());
    std::partial_sort(nodes.begin(), nodes.begin() + static_cast<std::ptrdiff_t>(nearest), nodes.end(),
                      [](const auto& a, const auto& b) { return a.first < b.first; });
    for (std::size_t i = 0; i < nearest; ++i) points.push_back(nodes[i].second);
    return points;
  }

  void add_inside(const std::array<std::array<int, 2>, 3>& corners, std::vector<Plane>& points) const {
    for (const auto& [i, j] : corners) {
      if (!image(i, j)) return;
    }
    const Plane base = grid_.at(corners[0][0], corners[0][1]), origin = *image(corners[0][0], corners[0][1]);
    Eigen::Matrix2d sides, image_sides;
    for (int k = 0; k < 2; ++k) {
      const auto& [i, j] = corners[static_cast<std::size_t>(k + 1)];
      sides.col(k) = grid_.at(i, j) - base;
      image_sides.col(k) = *image(i, j) - origin;
    }
    const Plane share = -image_sides.partialPivLu().solve(origin);
    if (share[0] >= 0.0 && share[1] >= 0.0 && share.sum() <= 1.0) points.push_back(base + sides * share);
  }

  /// Newton's method with steps of at most one grid cell or two, halved until the step that would follow with the same
  /// Jacobian is shorter (Deuflhard's natural monotonicity test: rows of any scale).
  [[nodiscard]] std::optional<Plane> newton(Plane at) const {
    // The number of panels jumps as the ends of a path move: below the error of the quadrature Newton's method finds no
    // decrease.
    constexpr double tolerance = 1e-10, close = 1e-5;
    for (int iteration = 0; iteration < 40; ++iteration) {
      const auto end = sheet_.reach(Sensitive::variable(at[0], 0), Sensitive::variable(at[1], 1));
      if (!end) return std::nullopt;
      const auto miss = sheet_.miss(*end);
      Eigen::Matrix2d jacobian;
      Plane residual;
      for (Eigen::Index i = 0; i < 2; ++i) {
        const Sensitive& row = miss[static_cast<std::size_t>(i)];
        residual[i] = row.value;
        jacobian.row(i) << row.gradient[0], row.gradient[1];
      }
      const auto solver = jacobian.fullPivLu();
      const Plane step = -solver.solve(residual);
      if (!step.allFinite()) return std::nullopt;
      if (residual.cwiseAbs().maxCoeff() < tolerance) return at;
      double share = std::min(1.0, 1.0 / step.cwiseAbs().maxCoeff());
      for (;; share *= 0.5) {
        if (share < 1e-4) return residual.norm() < close ? std::optional(at) : std::nullopt;
        const Plane next = at + share * step;
        const auto trial = sheet_.reach(next[0], next[1]);
        if (!trial) continue;
        const auto left = sheet_.miss(*trial);
        if (solver.solve(Plane(left[0], left[1])).norm() < (1.0 - 0.25 * share) * step.norm()) break;
      }
      at += share * step;
    }
    return std::nullopt;
  }

  const Sheet& sheet_;
  Grid grid_;
  std::vector<std::optional<Plane>> image_;
};

}  // namespace

std::vector<Guess> find_extremals(const Scene& scene) {
  const std::vector<double> p = parameters(scene);
  const Scaled<double> scaled([&](std::size_t i) { return p[i]; });
  std::vector<Guess> all;
  const auto add = [&](Family family, double sense, const Grid& grid) {
    const std::vector<Guess> found = Search(Sheet(family, sense, scaled), grid).run();
    all.insert(all.end(), found.begin(), found.end());
  };
  // A bead that starts slowly and gains all the speed that a fall over some three times the distance can give.
  const double gained = -std::asinh(3.0 * std::sqrt(scaled.v0 * scaled.v0 + 4.0) / scaled.v0) - 1.0;
  add(Family::turning, 0.0, {0.5 * std::floor(2.0 * gained), 8.0, -9.0, 26.0, 0.5});
  add(Family::passing, 0.0, {-14.0, 14.0, -2.0, 17.0, 0.5});
  add(Family::monotone, -1.0, {-9.0, 9.0, -9.0, 9.0, 0.5});
  add(Family::monotone, 1.0, {-9.0, 9.0, -9.0, 9.0, 0.5});
  std::sort(all.begin(), all.end(), [](const Guess& a, const Guess& b) { return a.final_time < b.final_time; });
  std::vector<Guess> distinct;
  for (const Guess& guess : all) {
    const bool known = std::any_of(distinct.begin(), distinct.end(), [&](const Guess& other) {
      return std::abs(guess.final_time - other.final_time) <= 1e-4 * guess.final_time;
    });
    if (!known) distinct.push_back(guess);
  }
  return distinct;
}

}  // namespace costate::drag
