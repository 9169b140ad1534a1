/// The shooting problem of the bead with Coulomb friction.
#include <costate/error.hpp>
#include <costate/models/coulomb.hpp>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>

namespace costate::coulomb {

namespace {

/// The extremal of given φ_F and scale, all but its integrals. S is a jet or a double.
template <class S>
struct Extremal {
  S mu, gravity;
  S turn, rest;                         ///< φ_F and π − φ_F, each with all its digits
  S sine, cosine;                       ///< of φ_F
  S half;                               ///< σ = sin(φ_F/2)
  S r, kappa;                           ///< see the model
  S A;                                  ///< v = A h sin φ/r²
  S time_unit, length_unit, work_unit;  ///< of the arc's quadratures

  Extremal(const S& logit, const S& scale, const S& span, const S& g, const S& friction) : mu(friction), gravity(g) {
    const double pi = std::numbers::pi;
    turn = pi / (1.0 + exp(-logit));
    rest = pi / (1.0 + exp(logit));
    const bool small = primal(logit) < 0.0;
    half = small ? sin(0.5 * turn) : cos(0.5 * rest);
    const S half_cosine = small ? cos(0.5 * turn) : sin(0.5 * rest);
    sine = small ? sin(turn) : sin(rest);
    cosine = small ? cos(turn) : -cos(rest);
    const S root = sqrt(1.0 + mu * mu / (sine * sine));
    r = small ? mu * cosine / sine + root : (1.0 + mu * mu) / (root - mu * cosine / sine);
    kappa = 2.0 * mu / r * half / half_cosine;
    length_unit = span * exp(scale);
    A = sqrt(gravity * length_unit * r * r * r / (turn * (1.0 + kappa))) / half;
    time_unit = A * turn * (1.0 + kappa) / (gravity * r);
    work_unit = A * A * turn * half * half / (r * r * r);
  }

  [[nodiscard]] S lambda_x() const { return 0.5 * (1.0 + mu * mu + r * r) / A; }
  [[nodiscard]] S lambda_y() const { return r * cosine / (sine * A); }
  [[nodiscard]] S end_speed() const { return A * sine / r; }
};

/// What an arc keeps of its extremal for those who observe it.
enum Constant : std::size_t {
  A_constant,
  r_constant,
  rest_constant,
  lambda_x_constant,
  lambda_y_constant,
  length_constant,
  work_constant
};

class CoulombProblem final : public Problem {
 public:
  explicit CoulombProblem(const Scene& scene) {
    if (!(scene.span > 0.0 && std::isfinite(scene.span))) {
      throw BadInput(fmt::format("span = {:g} m is not admissible: a positive number", scene.span));
    }
    if (!(scene.gravity > 0.0 && std::isfinite(scene.gravity))) {
      throw BadInput(fmt::format("gravity = {:g} m/s^2 is not admissible: a positive number", scene.gravity));
    }
    if (!(scene.friction >= 0.0 && scene.friction < largest_friction(scene) && std::isfinite(scene.drop))) {
      throw BadInput(fmt::format("mu = {:g} is not admissible: 0 or more and less than H/L = {:.12g}", scene.friction,
                                 largest_friction(scene)));
    }
    unknowns_ = {{"turn"}, {"scale"}};
    rows_ = {{"ln of end x"}, {"ln of end y - mu x"}};
    structure_ = {"sliding"};
    const std::vector<double> values = coulomb::parameters(scene);
    parameters_ = {{"drop", "m", values[drop_place]},
                   {"span", "m", values[span_place]},
                   {"gravity", "m/s^2", values[gravity_place]},
                   {"mu", "1", values[friction_place]}};
  }

  void shoot(Shot& shot) const override {
    const Jet &drop = shot.parameter(drop_place), &span = shot.parameter(span_place);
    const Jet &gravity = shot.parameter(gravity_place), &mu = shot.parameter(friction_place);
    const Extremal<Jet> e(shot.unknown(0), shot.unknown(1), span, gravity, mu);
    const ArcEnd end = shot.arc({.arc = 0,
                                 .field = &arc_,
                                 .t0 = 0.0,
                                 .t1 = 1.0,
                                 .quadrature = {0.0, 0.0, 0.0},
                                 .parameter = {e.turn, e.kappa},
                                 .time_quadrature = time_quadrature});
    const Jet speed = e.end_speed();
    const Jet fall = (0.5 * speed * speed + mu * e.work_unit * end.quadrature[1]) / gravity;  // y − μx
    Jet wanted = drop - mu * span;
    wanted.value = std::fma(-mu.value, span.value, drop.value);  // all its digits, also as μ → H/L
    shot.row(0, shot.unknown(1) + log(end.quadrature[0]));
    shot.row(1, log(fall / wanted));

    const Jet final_time = e.time_unit * end.quadrature[2];
    shot.report("final_time", "s", final_time);
    shot.report("lambda_x", "s/m", e.lambda_x());
    shot.report("lambda_y", "s/m", e.lambda_y());
    shot.report("lambda_v0", "s^2/m", 1.0 / gravity);
    shot.report("alpha0", "rad", std::numbers::pi / 2);
    shot.report("alphaF", "rad", slope(e.sine, mu * e.sine + e.r * e.cosine));
    shot.report("end_speed", "m/s", speed);
    shot.complete({},
                  {e.A.value, e.r.value, e.rest.value, e.lambda_x().value, e.lambda_y().value, e.length_unit.value,
                   e.work_unit.value},
                  e.time_unit.value);
  }

  [[nodiscard]] std::vector<Column> columns() const override {
    return {{"x", "m"},          {"y", "m"},          {"v", "m/s"},          {"alpha", "rad"},
            {"lambda_x", "s/m"}, {"lambda_y", "s/m"}, {"lambda_v", "s^2/m"}, {"normal", "m/s^2"}};
  }

  [[nodiscard]] std::vector<double> observe(const ArcPoint& point, const std::vector<double>& p) const override {
    const Observed at = observed(point, p);
    const std::vector<double>& c = point.record->constants;
    const double mu = p[friction_place], g = p[gravity_place];
    const double x = c[length_constant] * point.quadrature[0];
    const double y = mu * x + (0.5 * at.v * at.v + mu * c[work_constant] * point.quadrature[1]) / g;
    return {x, y, at.v, at.alpha, c[lambda_x_constant], c[lambda_y_constant], at.lambda_v, at.normal};
  }

  [[nodiscard]] std::vector<PathCheck> check(const ArcPoint& point, const std::vector<double>& p) const override {
    const Observed at = observed(point, p);
    const std::vector<double>& c = point.record->constants;
    const double mu = p[friction_place], g = p[gravity_place];
    const double lambda_x = c[lambda_x_constant], lambda_y = c[lambda_y_constant];
    // H as a function of the slope, z and λz held: H + 1 = z e^{μα}(λx cos α + λy sin α) + λz g (sin α − μ cos α) e^{−μα}.
    // As μ → H/L its terms grow beyond bounds and cancel, so it is measured by their size.
    const auto hamiltonian = [&](double alpha) {
      const double sine = std::sin(alpha), cosine = std::cos(alpha), growth = std::exp(mu * (alpha - at.alpha));
      return at.v * growth * (lambda_x * cosine + lambda_y * sine) + at.lambda_v * g / growth * (sine - mu * cosine) - 1.0;
    };
    const double size = 1.0 + at.v * (lambda_x + std::abs(lambda_y)) + at.lambda_v * g * (1.0 + mu);
    const double here = hamiltonian(at.alpha);
    constexpr double farthest = 30.0;  // in μΔα: what lies beyond is e^30 times worse, and overflows in the end
    const double highest = std::numbers::pi / 2, lowest = std::max(-highest, at.alpha - farthest / mu);
    double elsewhere = -std::numeric_limits<double>::infinity();
    constexpr int cells = 12;
    for (int i = 0; i <= cells; ++i) {
      elsewhere = std::max(elsewhere, hamiltonian(std::lerp(lowest, highest, static_cast<double>(i) / cells)));
    }
    return {{"Hamiltonian, by the size of its terms", PathCheck::Kind::zero, here / size},
            {"speed", PathCheck::Kind::nonnegative, at.v / c[A_constant]},
            {"lambda_v", PathCheck::Kind::nonnegative, at.lambda_v * g},
            {"normal force", PathCheck::Kind::nonnegative, at.normal / g},
            {"H less H at other slopes", PathCheck::Kind::nonnegative, (here - elsewhere) / size}};
  }

 private:
  static constexpr int time_quadrature = 2;

  struct Observed {
    double v, alpha, lambda_v, normal;
  };

  static Jet slope(const Jet& x, const Jet& y) {
    const double square = x.value * x.value + y.value * y.value;
    return Jet::chain(x, y, std::atan2(y.value, x.value), -y.value / square, x.value / square);
  }

  /// The closed relations between the speed, the slope, their costate and the angle φ of the arc; λv = h sin(φ_F − φ)/(g r
  /// sin φ_F).
  [[nodiscard]] static Observed observed(const ArcPoint& point, const std::vector<double>& p) {
    const std::vector<double>& c = point.record->constants;
    const double mu = p[friction_place], g = p[gravity_place], r = c[r_constant], rest = c[rest_constant];
    // φ_F may be close to π, where angles lose their digits: there each sine is taken of the smaller of angle and
    // supplement.
    const double turn = point.record->parameter[0], gone = turn * point.own, left = turn * (1.0 - point.own);
    const bool wide = turn > 0.5 * std::numbers::pi, early = point.own < 0.5;
    const double sine = wide && !early ? std::sin(rest + left) : std::sin(gone);
    const double cosine = wide && !early ? -std::cos(rest + left) : std::cos(gone);
    const double ahead = wide && early ? std::sin(rest + gone) : std::sin(left);
    const double end_sine = wide ? std::sin(rest) : std::sin(turn);
    const double down = mu * sine + r * cosine;
    const double h = std::hypot(sine, down);
    return {.v = c[A_constant] * h * sine / (r * r),
            .alpha = std::atan2(down, sine),
            .lambda_v = h * ahead / (g * r * end_sine),
            .normal = g * sine / h * (1.0 + r * r / (2.0 * h * h - r * r))};
  }

  FieldOf<SlidingArc> arc_;
};

}  // namespace

std::shared_ptr<const Problem> make_problem(const Scene& scene) { return std::make_shared<CoulombProblem>(scene); }

std::vector<double> parameters(const Scene& scene) { return {scene.drop, scene.span, scene.gravity, scene.friction}; }

}  // namespace costate::coulomb
