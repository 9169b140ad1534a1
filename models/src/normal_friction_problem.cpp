#include "normal_corner.hpp"

#include <costate/error.hpp>

#include <cmath>
#include <fmt/format.h>

namespace costate::normal_friction {

namespace {

/// f(θ) of the parameters that `get` gives by place.
template <class S, class Get>
Push<S> make_push(const Get& get) {
  const S x = get(x_place), y = get(y_place), gravity = get(gravity_place);
  const S cubic = get(beta_place) * gravity * gravity * gravity;
  const S linear = 1.0 - get(nonlinearity_place);
  const S square = x * x + y * y;
  const S c2 = x * x / square, s2 = y * y / square;
  return {linear * cubic * c2 * (c2 + 3.0 * s2) - get(mu_place) * gravity,
          -(2.0 * linear * cubic * c2 * x * y / square) - gravity, (1.0 - linear) * cubic};
}

/// The scene in units of the chord L and the speed √(v₀² + 2 g L).
template <class S>
struct Scaled {
  S length, speed, time;
  S start_speed;
  S chord_cosine, chord_sine;  ///< the end point
  Push<S> push;

  template <class Get>
  explicit Scaled(const Get& get) {
    const S x = get(x_place), y = get(y_place), v0 = get(speed_place), gravity = get(gravity_place);
    length = sqrt(x * x + y * y);
    speed = sqrt(v0 * v0 + 2.0 * gravity * length);
    time = length / speed;
    start_speed = v0 / speed;
    chord_cosine = x / length;
    chord_sine = y / length;
    const S unit = length / (speed * speed);
    const Push<S> own = make_push<S>(get);
    push = {own.x * unit, own.y * unit, own.cubic * unit};
  }
};

class NormalFrictionProblem final : public Problem {
 public:
  NormalFrictionProblem(const Scene& scene, Structure arcs) : arcs_(std::move(arcs)) {
    if (arcs_.empty()) throw BadInput("the arc structure is empty: at least one arc is needed");
    unknowns_ = {{"theta2"}, {"log_turn"}};
    rows_ = {{"end across gravity and linear friction"}, {"energy"}};
    structure_.assign(arcs_.size(), "sliding");
    for (std::size_t i = arcs_.size() - 1; i > 0; --i) {
      unknowns_.push_back({.name = fmt::format("jump_{}", i), .lower = 0.0});
      // The first arc may vanish at the start; one between corners or at the end does not.
      unknowns_.push_back(i == 1 ? Unknown{.name = "turn_1", .lower = 0.0} : Unknown{.name = fmt::format("log_turn_{}", i)});
      rows_.push_back({fmt::format("speed at corner {}", i)});
      rows_.push_back({fmt::format("lambda_v at corner {}", i)});
    }
    const std::vector<double> values = normal_friction::parameters(scene);
    const std::vector<std::pair<const char*, const char*>> names{{"x", "m"},           {"y", "m"},
                                                                 {"speed", "m/s"},     {"mu", "1"},
                                                                 {"beta", "s^4/m^2"},  {"gravity", "m/s^2"},
                                                                 {"nonlinearity", "1"}};
    for (std::size_t i = 0; i < values.size(); ++i) parameters_.push_back({names[i].first, names[i].second, values[i]});
  }

  [[nodiscard]] const Structure& arcs() const { return arcs_; }

  void shoot(Shot& shot) const override {
    const Scaled<Jet> scene([&](std::size_t i) { return shot.parameter(i); });
    const Jet& theta2 = shot.unknown(0);
    // Arcs by place, from the last one backward.
    std::vector<Piece> pieces(arcs_.size());
    pieces.back() = {0.0, sign(arcs_.back().turn) * exp(shot.unknown(1))};
    for (std::size_t i = arcs_.size() - 1, next = 2; i-- > 0; next += 2) {
      const Jet& turn = shot.unknown(next + 1);
      pieces[i] = {pieces[i + 1].left + pieces[i + 1].turn + sign(arcs_[i + 1].jump) * shot.unknown(next),
                   sign(arcs_[i].turn) * (i == 0 ? turn : exp(turn))};
    }
    for (const Piece& piece : pieces) require_motion(scene.push, theta2.value, piece);
    const SlopePoint<Jet> start(scene.push, theta2, pieces[0].left + pieces[0].turn);
    const Jet end_speed = scene.start_speed * start.q / start.d;

    Jets at{0.0, 0.0, 0.0, 0.0};
    for (std::size_t i = 0; i < arcs_.size(); ++i) {
      if (i > 0) corner(shot, scene, i, pieces[i - 1], pieces[i], at[0]);
      at = shot.arc({.arc = static_cast<int>(i),
                     .field = &arc_,
                     .t1 = 1.0,
                     .quadrature = at,
                     .parameter = {theta2, pieces[i].left, pieces[i].turn, end_speed, scene.push.x, scene.push.y,
                                   scene.push.cubic},
                     .time_quadrature = 0})
               .quadrature;
    }
    const Push<Jet>& push = scene.push;
    const Jet across = push.x * (at[2] - scene.chord_sine) - push.y * (at[1] - scene.chord_cosine);
    shot.row(0, across / std::hypot(push.x.value, push.y.value));
    // (v_f/v₀)² − 1 with v_f/v₀ = q/d = cos τ + (f/d) sin τ, without the difference.
    const Jet slope = start.f / start.d, left = theta2 - start.theta;
    const Jet gained = sin(left) * (2.0 * slope * cos(left) - (1.0 - slope * slope) * sin(left));
    const Jet square = scene.start_speed * scene.start_speed;
    const Jet linear = 2.0 * (push.x * scene.chord_cosine + push.y * scene.chord_sine);
    const double size = std::abs(linear.value) + std::min(square.value, std::hypot(push.x.value, push.y.value));
    shot.row(1, (square * gained - linear - 2.0 * push.cubic * at[3]) / size);
    shot.report("final_time", "s", scene.time * at[0]);
    shot.report("lambda_x", "s/m", cos(theta2) / (scene.speed * end_speed));
    shot.report("lambda_y", "s/m", sin(theta2) / (scene.speed * end_speed));
    shot.report("lambda_v0", "s^2/m", scene.time / scene.speed * start.lambda_v());
    shot.report("theta1", "rad", start.theta);
    shot.report("theta2", "rad", theta2);
    shot.report("v_f", "m/s", scene.speed * end_speed);
    guard_structure(shot, scene.push, pieces, start);
    shot.complete({}, {}, scene.time.value);
  }

  [[nodiscard]] std::vector<Column> columns() const override {
    return {{"x", "m"},          {"y", "m"},          {"v", "m/s"},          {"theta", "rad"},
            {"lambda_x", "s/m"}, {"lambda_y", "s/m"}, {"lambda_v", "s^2/m"}, {"N", "m/s^2"}};
  }

  [[nodiscard]] std::vector<double> observe(const ArcPoint& point, const std::vector<double>& p) const override {
    const Scaled<double> scene([&](std::size_t i) { return p[i]; });
    const Eigen::VectorXd& constants = point.record->parameter;
    const SlopePoint<double> at = slope_point(point, constants);
    const double end_speed = scene.speed * constants[3];
    return {scene.length * point.quadrature[1],
            scene.length * point.quadrature[2],
            end_speed * at.speed_ratio(),
            at.theta,
            std::cos(constants[0]) / end_speed,
            std::sin(constants[0]) / end_speed,
            scene.time / scene.speed * at.lambda_v(),
            p[gravity_place] * at.cosine};
  }

  [[nodiscard]] std::vector<PathCheck> check(const ArcPoint& point, const std::vector<double>&) const override {
    const Eigen::VectorXd& constants = point.record->parameter;
    const SlopePoint<double> at = slope_point(point, constants);
    const Vec<double, 3> c = at.hamiltonian({constants[4], constants[5], constants[6]}, constants[0]);
    const auto hamiltonian = [&](double theta) {
      const double cosine = std::cos(theta);
      return cosine * (c[0] + c[2] * cosine * cosine) + c[1] * std::sin(theta) - 1.0;
    };
    // H is known to rounding of the terms that q is a difference of, over q.
    const double here = hamiltonian(at.theta), rounding = at.q / (std::abs(at.d) + std::abs(at.f));
    const double size = 1.0 + std::abs(c[0]) + std::abs(c[1]) + std::abs(c[2]);
    return {{"H times q/(|d| + |f|)", PathCheck::Kind::zero, here * rounding},
            {"speed", PathCheck::Kind::nonnegative, constants[3] * at.speed_ratio()},
            {"-H_theta_theta (Legendre-Clebsch)", PathCheck::Kind::nonnegative, at.gamma / at.q},
            {"(H - highest H of any slope) / size of its terms (Weierstrass)", PathCheck::Kind::nonnegative,
             (here - hamiltonian(BestSlope::of(c))) / size}};
  }

 private:
  static double sign(Side side) { return static_cast<double>(static_cast<int>(side)); }

  /// An arc from τ = left + turn to τ = left.
  struct Piece {
    Jet left, turn;
  };

  static Push<double> numbers(const Push<Jet>& push) { return {push.x.value, push.y.value, push.cubic.value}; }

  void guard_structure(Shot& shot, const Push<Jet>& push, const std::vector<Piece>& pieces,
                       const SlopePoint<Jet>& start) const {
    const Jet& theta2 = shot.unknown(0);
    const bool corners = pieces.size() > 1;
    for (std::size_t i = 0; i < pieces.size(); ++i) {
      if (i > 0) shot.guard(EventKind::arc_death, jump_at_corner(i), shot.unknown(2 * (pieces.size() - i)));
      shot.guard(EventKind::arc_birth, curvature_of_arc(i), least_curvature(push, theta2, pieces[i]));
    }
    const Jet& first_turn = shot.unknown(shot.rows().size() - 1);
    if (corners) shot.guard(EventKind::arc_death, turn_of_first_arc, first_turn);
    shot.guard(EventKind::arc_birth, lead_at_start, lead(push, start, theta2, corners ? first_turn : Jet(1.0)));
  }

  /// By how much H at the start is higher than at its other local maximum, where H_θ = 0: its derivatives are those at that slope,
  /// held. An arc with the other slope is born at the start where it vanishes. 1 where there is no other.
  static Jet lead(const Push<Jet>& push, const SlopePoint<Jet>& start, const Jet& theta2, const Jet& vanishing) {
    const Vec<Jet, 3> c = start.hamiltonian(push, theta2);
    const std::optional<double> other = BestSlope::other(primal(c), start.theta.value);
    if (!other) return 1.0;
    const double cosine = std::cos(*other);
    const Jet there = cosine * (c[0] + cosine * cosine * c[2]) + std::sin(*other) * c[1];
    return (start.cosine * (c[0] + start.cosine * start.cosine * c[2]) + start.sine * c[1] - there) / vanishing;
  }

  /// The least of Γ/q = −H_θθ along an arc: where it vanishes inside, a corner is born. By the envelope theorem its derivatives are those
  /// at the place of the minimum, held.
  static Jet least_curvature(const Push<Jet>& push, const Jet& theta2, const Piece& piece) {
    const double part = weakest_part(numbers(push), theta2.value, piece.left.value, piece.turn.value);
    const SlopePoint<Jet> place(push, theta2, piece.left + piece.turn * part);
    return place.gamma / place.q;
  }

  /// Rows and report of the corner between arcs i − 1 and i, reached at the scaled time `at`.
  void corner(Shot& shot, const Scaled<Jet>& scene, std::size_t i, const Piece& first, const Piece& second,
              const Jet& at) const {
    const Jet& theta2 = shot.unknown(0);
    const auto [speed, costate] = corner_rows(scene.push, theta2, first.left, second.left + second.turn);
    const std::size_t row = 2 * (arcs_.size() - i);
    shot.row(row, speed);
    shot.row(row + 1, costate);
    shot.report(fmt::format("t{}", i), "s", scene.time * at);
  }

  [[nodiscard]] static SlopePoint<double> slope_point(const ArcPoint& point, const Eigen::VectorXd& constants) {
    const Push<double> push{constants[4], constants[5], constants[6]};
    return {push, constants[0], constants[1] + constants[2] * (1.0 - point.own)};
  }

  /// The quadratures have a pole where q = 0: such a turn is no motion, and must not be integrated.
  static void require_motion(const Push<Jet>& push, double theta2, const Piece& piece) {
    constexpr int cells = 32;
    for (int i = 0; i <= cells; ++i) {
      const SlopePoint<double> at(numbers(push), theta2, piece.left.value + piece.turn.value * i / cells);
      if (!(at.speed_ratio() > 0.0)) {
        throw LeftDomain(fmt::format("the speed has no positive value at theta = {:.6g} rad", at.theta));
      }
    }
  }

  Structure arcs_;
  FieldOf<SlopeArc> arc_;
};

}  // namespace

Structure Chain::structure() const {
  Structure result;
  for (const ArcSpan& arc : arcs) result.push_back(arc.shape);
  return result;
}

Eigen::VectorXd unknowns(const Chain& chain) {
  std::vector<double> y{chain.theta2};
  for (std::size_t i = chain.arcs.size(); i-- > 0;) {
    const bool first_of_several = i == 0 && chain.arcs.size() > 1;
    y.push_back(first_of_several ? chain.arcs[i].turn : std::log(chain.arcs[i].turn));
    if (i > 0) y.push_back(chain.arcs[i].jump);
  }
  return Eigen::Map<const Eigen::VectorXd>(y.data(), static_cast<Eigen::Index>(y.size()));
}

std::vector<BestSlope::Bracket> BestSlope::maxima(const Vec<double, 3>& c) {
  constexpr std::size_t cells = 72;
  struct Direction {
    double theta, cosine, sine;
  };
  static const auto grid = [] {
    std::array<Direction, cells + 1> directions{};
    for (std::size_t i = 0; i <= cells; ++i) {
      const double theta = std::numbers::pi * (2.0 * static_cast<double>(i) / cells - 1.0);
      directions[i] = {theta, std::cos(theta), std::sin(theta)};
    }
    return directions;
  }();
  const auto falls = [&](const Direction& at) {
    return c[1] * at.cosine - at.sine * (c[0] + 3.0 * c[2] * at.cosine * at.cosine) <= 0.0;
  };
  std::vector<Bracket> found;
  for (std::size_t i = 0; i < cells; ++i) {
    if (!falls(grid[i]) && falls(grid[i + 1])) found.push_back({grid[i].theta, grid[i + 1].theta});
  }
  // π and −π are one direction, but not to the last digit.
  constexpr double seam = 1e-6;
  if (falls(grid.front()) && !falls(grid.back())) found.push_back({std::numbers::pi - seam, std::numbers::pi + seam});
  return found;
}

namespace {

/// α cos θ + σ sin θ + κ cos³θ.
double height(const Vec<double, 3>& c, double theta) {
  const double cosine = std::cos(theta);
  return cosine * (c[0] + c[2] * cosine * cosine) + c[1] * std::sin(theta);
}

}  // namespace

BestSlope::Bracket BestSlope::highest(const Vec<double, 3>& c) {
  Bracket best{-std::numbers::pi, std::numbers::pi};
  double top = -std::numeric_limits<double>::infinity();
  for (const Bracket& around : maxima(c)) {
    const double here = height(c, guarded_root(Slope{}, c, around.lower, around.upper));
    if (here > top) {
      top = here;
      best = around;
    }
  }
  return best;
}

std::optional<double> BestSlope::other(const Vec<double, 3>& c, double theta) {
  constexpr double same = 1e-5;
  std::optional<double> best;
  for (const Bracket& around : maxima(c)) {
    const double there = guarded_root(Slope{}, c, around.lower, around.upper);
    if (std::abs(std::remainder(there - theta, 2.0 * std::numbers::pi)) < same) continue;
    if (!best || height(c, there) > height(c, *best)) best = there;
  }
  return best;
}

Chain chain_of(const Problem& problem, const Eigen::VectorXd& y) {
  const auto* own = dynamic_cast<const NormalFrictionProblem*>(&problem);
  if (own == nullptr) throw BadInput("the problem is not one of a bead with friction by the normal force");
  if (y.size() != static_cast<Eigen::Index>(problem.unknowns().size())) {
    throw BadInput(fmt::format("the problem has {} unknowns, not {}", problem.unknowns().size(), y.size()));
  }
  Chain chain{.theta2 = y[0], .arcs = {}};
  for (const ArcShape& shape : own->arcs()) chain.arcs.push_back({.shape = shape});
  Eigen::Index next = 1;
  for (std::size_t i = chain.arcs.size(); i-- > 0;) {
    const bool first_of_several = i == 0 && chain.arcs.size() > 1;
    chain.arcs[i].turn = first_of_several ? y[next] : std::exp(y[next]);
    ++next;
    if (i > 0) chain.arcs[i].jump = y[next++];
  }
  return chain;
}

double weakest_part(const Push<double>& push, double theta2, double left, double turn) {
  const auto at = [&](double part) {
    const SlopePoint<double> p(push, theta2, left + turn * part);
    return p.gamma / p.q;
  };
  constexpr int cells = 64;
  int least = 0;
  for (int i = 1; i <= cells; ++i) {
    if (at(static_cast<double>(i) / cells) < at(static_cast<double>(least) / cells)) least = i;
  }
  double a = static_cast<double>(std::max(least - 1, 0)) / cells, b = static_cast<double>(std::min(least + 1, cells)) / cells;
  for (int i = 0; i < 50; ++i) {
    constexpr double golden = 0.6180339887498949;
    const double lower = b - golden * (b - a), upper = a + golden * (b - a);
    (at(lower) < at(upper) ? b : a) = at(lower) < at(upper) ? upper : lower;
  }
  return 0.5 * (a + b);
}

std::string jump_at_corner(std::size_t i) { return fmt::format("jump at corner {}", i); }
std::string curvature_of_arc(std::size_t i) { return fmt::format("-H_theta_theta of arc {}", i + 1); }

std::shared_ptr<const Problem> make_problem(const Scene& scene, const Structure& structure) {
  return std::make_shared<NormalFrictionProblem>(scene, structure);
}

Push<double> push_of(const Scene& scene, double nonlinearity) {
  const std::vector<double> values = parameters(scene, nonlinearity);
  return make_push<double>([&](std::size_t i) { return values[i]; });
}

std::vector<double> parameters(const Scene& scene, double nonlinearity) {
  return {scene.x, scene.y, scene.speed, scene.mu, scene.beta, scene.gravity, nonlinearity};
}

}  // namespace costate::normal_friction
