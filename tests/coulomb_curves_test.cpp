/// Descents along the comparison curves: Table 1 of [K] whole, its own curve, the places where the bead stops.
#include "coulomb/coulomb_scene.hpp"
#include "coulomb_reference.hpp"
#include "runge_kutta.hpp"

#include <costate/error.hpp>

#include <gtest/gtest.h>
#include <numbers>

namespace costate::test {
namespace {

using coulomb::Curve;
using coulomb::Descent;
using coulomb::DescentPoint;
using coulomb::Scene;

const std::map<std::string, Curve> columns{{"circle", Curve::circle},
                                           {"parab", Curve::parabola},
                                           {"cyc", Curve::cycloid},
                                           {"glad", Curve::gladkov},
                                           {"kur", Curve::kurilin}};

TEST(CoulombCurves, TableOneWhole) {
  const auto data = coulomb_data();
  int times = 0, dashes = 0;
  for (const auto& [mu, row] : data.at("table1").items()) {
    const Scene scene{1.0, 1.0, 9.81, std::stod(mu)};
    const double unit = std::sqrt(scene.span / (2.0 * scene.gravity));
    for (const auto& [column, curve] : columns) {
      SCOPED_TRACE(column + " at mu = " + mu);
      const Descent descent = descend(curve, scene);
      if (row.at(column).is_null()) {
        ++dashes;
        EXPECT_NE(descent.end, Descent::End::arrives);
        EXPECT_LT(descent.limit, scene.friction);
        continue;
      }
      ++times;
      ASSERT_EQ(descent.end, Descent::End::arrives);
      const double expected = std::stod(row.at(column).get<std::string>());
      EXPECT_NEAR(descent.final_time / unit, expected, 1e-12 * expected);
      EXPECT_NEAR(descent.final_time / unit, expected, descent.time_bound / unit + 1e-15 * expected);
      EXPECT_GE(descent.limit, scene.friction);
    }
    const tools::Outcome optimum = coulomb::solve_scene(scene, {.accuracy = 1e-11});
    ASSERT_TRUE(optimum.solved());
    EXPECT_NEAR(optimum["final_time"].value / unit, std::stod(row.at("true").get<std::string>()), 1e-10);
    // The paper's curve is not the optimum: it is slower as soon as there is friction.
    const double kurilin = descend(Curve::kurilin, scene).final_time;
    if (scene.friction > 0.0) {
      EXPECT_LT(optimum["final_time"].value, kurilin * (1.0 - 1e-5));
    }
    for (const auto& [column, curve] : columns) {
      const Descent descent = descend(curve, scene);
      if (descent.end != Descent::End::arrives) continue;
      EXPECT_GE(descent.final_time * (1.0 + 1e-13), optimum["final_time"].value) << column;
    }
  }
  EXPECT_EQ(times, 40);
  EXPECT_EQ(dashes, 10);
}

TEST(CoulombCurves, LimitsAtWhichTheBeadJustArrives) {
  const Scene scene{1.0, 1.0, 9.81, 0.0};
  for (const auto& [curve, limit] : {std::pair{Curve::circle, 0.603342},
                                     {Curve::cycloid, 0.793159},
                                     {Curve::parabola, 0.887571},
                                     {Curve::gladkov, 0.5},
                                     {Curve::kurilin, 1.0}}) {
    const double found = descend(curve, scene).limit;
    EXPECT_NEAR(found, limit, 5e-7) << name_of(curve);
    for (const double side : {-1e-6, 1e-6}) {
      const Descent descent = descend(curve, {1.0, 1.0, 9.81, found + side});
      EXPECT_EQ(descent.end == Descent::End::arrives, side < 0.0) << name_of(curve) << " " << side;
    }
  }
}

TEST(CoulombCurves, KurilinsOwnConstants) {
  int given = 0;
  for (const CoulombCase& c : coulomb_cases()) {
    if (c.kurilin.empty()) continue;
    ++given;
    SCOPED_TRACE(c.name);
    const auto best = coulomb::kurilin(c.scene);
    ASSERT_TRUE(best.has_value());
    const double distance = largest_friction(c.scene) - c.scene.friction;
    const double rounding = std::ldexp(c.scene.friction / distance, -52) +
                            1e-15;  // of the decimal μ and of the reference's digits
    const auto expect = [&](const char* name, double value, double bound) {
      EXPECT_NEAR(value, c.kurilin.at(name), bound + rounding * std::abs(value)) << name;
      EXPECT_NEAR(value, c.kurilin.at(name), 1e-10 * std::abs(value)) << name;
    };
    expect("final_time", best->final_time, best->time_bound * best->final_time);
    expect("alpha0", best->alpha0, best->angle_bound);
    expect("alphaF", best->alphaF, best->angle_bound);
    expect("C", best->C, best->relative_bound * best->C + 4.0 * rounding * best->C);
  }
  EXPECT_EQ(given, 34);
  EXPECT_FALSE(coulomb::kurilin({1.0, 1.0, 9.81, 1.0}).has_value());
}

/// The motion again, in time, by Newton's law along a wire of the given radius of curvature ρ(b) (negative: along that of
/// constant b').
template <class Radius>
void expect_motion(Curve curve, const Scene& s, double epsilon, const Radius& rate) {
  SCOPED_TRACE(name_of(curve));
  const std::vector<DescentPoint> points = descent_points(curve, s, epsilon, 40);
  ASSERT_EQ(points.size(), 41U);
  const DescentPoint &first = points[4], &last = points.back();
  const auto newton = [&](double, const std::array<double, 4>& q) {
    const double v = q[2], b = q[3], turning = rate(v, b);
    return std::array<double, 4>{v * std::sin(b), v * std::cos(b),
                                 s.gravity * (std::cos(b) - s.friction * std::sin(b)) - s.friction * v * turning, turning};
  };
  const double up = std::numbers::pi / 2;
  for (const std::size_t i : {std::size_t{20}, std::size_t{40}}) {
    const auto end = runge_kutta<4>(newton, first.t, points[i].t, {first.x, first.y, first.v, up - first.alpha}, 1e-12);
    EXPECT_NEAR(end[0], points[i].x, 1e-9 * s.span);
    EXPECT_NEAR(end[1], points[i].y, 1e-9 * s.drop);
    EXPECT_NEAR(end[2], points[i].v, 1e-9 * (1.0 + points[i].v));
    EXPECT_NEAR(up - end[3], points[i].alpha, 1e-9);
  }
  EXPECT_EQ(points.front().t, 0.0);
  EXPECT_EQ(points.front().v, 0.0);
  EXPECT_NEAR(last.x, s.span, 1e-13 * s.span);
  EXPECT_NEAR(last.y, s.drop, 1e-12 * s.drop);
  const Descent descent = descend(curve, s, epsilon);
  EXPECT_NEAR(last.t, descent.final_time, 1e-12 * last.t);
  EXPECT_NEAR(last.v, descent.end_speed, 1e-11);
  EXPECT_EQ(last.alpha, descent.alphaF);
  EXPECT_EQ(points.front().alpha, descent.alpha0);
}

TEST(CoulombCurves, MotionIsNewtons) {
  for (const Scene& s : {Scene{2.0, 3.0, 9.81, 0.1}, Scene{3.0, 1.0, 1.62, 0.4}, Scene{0.3, 1.0, 9.81, 0.02}}) {
    const double H = s.drop, L = s.span;
    const double R = (L * L + H * H) / (2.0 * L);
    expect_motion(Curve::circle, s, 0.6, [&](double v, double) { return v / R; });
    const Descent cycloid = descend(Curve::cycloid, s);
    const double end = std::numbers::pi / 2 - cycloid.alphaF;
    const double size = L / (end - 0.5 * std::sin(2.0 * end));  // x = (k/2)(b − ½ sin 2b), ρ = k sin b
    expect_motion(Curve::cycloid, s, 0.6, [&](double v, double b) { return v / (2.0 * size * std::sin(b)); });
    for (const double epsilon : {0.0, 0.3, 1.7}) {
      expect_motion(Curve::parabola, s, epsilon, [&](double v, double b) {
        return v * 2.0 * epsilon * H / (L * L) * std::pow(std::sin(b), 3);  // 1/ρ = |y''| cos³α
      });
    }
    const double omega = std::sqrt(2.0 * s.gravity / coulomb::kurilin(s)->C);
    expect_motion(Curve::kurilin, s, 0.6, [&](double, double) { return omega; });
    const Descent gladkov = descend(Curve::gladkov, s);
    const double last = std::numbers::pi / 2 - gladkov.alphaF;
    double sum = 0.0;  // x/k, by Simpson's rule
    constexpr int cells = 2000;
    for (int i = 0; i <= cells; ++i) {
      const double b = last * i / cells, weight = i == 0 || i == cells ? 1.0 : i % 2 == 1 ? 4.0 : 2.0;
      sum += weight * std::pow(std::sin(b), 2) * std::exp(-4.0 * s.friction * b) * last / (3.0 * cells);
    }
    expect_motion(Curve::gladkov, s, 0.6,
                  [&](double v, double b) { return v / (L / sum * std::sin(b) * std::exp(-4.0 * s.friction * b)); });
  }
}

// Where the bead stops, the work of friction has eaten the fall: g(y − μx) = μ∫v² db with v = 0.
TEST(CoulombCurves, PlaceWhereTheBeadStops) {
  for (const double mu : {0.7, 3.0, 100.0}) {
    const Descent stopped = descend(Curve::circle, {1.0, 1.0, 9.81, mu});
    ASSERT_EQ(stopped.end, Descent::End::stops);
    // In time along the quarter circle of radius 1, until the speed is gone.
    const auto newton = [&](double, const std::array<double, 2>& q) {
      return std::array<double, 2>{9.81 * (std::cos(q[1]) - mu * std::sin(q[1])) - mu * q[0] * q[0], q[0]};
    };
    double low = 0.0, high = 2.0;
    while (high - low > 1e-12) {
      const double middle = 0.5 * (low + high);
      (runge_kutta<2>(newton, 0.0, middle, {0.0, 0.0}, 1e-13)[0] > 0.0 ? low : high) = middle;
    }
    const double b = runge_kutta<2>(newton, 0.0, low, {0.0, 0.0}, 1e-13)[1];
    EXPECT_NEAR(stopped.stop_x, 1.0 - std::cos(b), 1e-10) << mu;
    EXPECT_NEAR(stopped.stop_y, std::sin(b), 1e-10) << mu;
  }
  const Scene scene{1.0, 1.0, 9.81, 0.7};
  EXPECT_THROW((void)descent_points(Curve::circle, scene), BadInput);
  // On a wire too flat for it the bead does not start.
  const Descent still = descend(Curve::parabola, {1.0, 1.0, 9.81, 1.7});
  EXPECT_EQ(still.end, Descent::End::stops);
  EXPECT_EQ(still.stop_x, 0.0);
  EXPECT_EQ(still.stop_y, 0.0);
}

TEST(CoulombCurves, StraightLineIsTheParabolaOfNoBend) {
  const Scene s{3.0, 4.0, 9.81, 0.5};
  const Descent line = descend(Curve::parabola, s, 0.0);
  EXPECT_NEAR(line.final_time, std::sqrt(2.0 * 5.0 / (9.81 * (0.6 - 0.5 * 0.8))), 1e-13);
  EXPECT_EQ(line.limit, 0.75);
  for (const double epsilon : {1e-15, 1e-12, 1e-8, 1e-5}) {
    EXPECT_NEAR(descend(Curve::parabola, s, epsilon).final_time, line.final_time, 10.0 * epsilon + 1e-13) << epsilon;
  }
}

// Where the bead all but stops at the end, rounding of its last speed is worth more and more of the time, and the bound says
// so.
TEST(CoulombCurves, BoundGrowsTowardsTheLimit) {
  const double limit = descend(Curve::cycloid, {1.0, 1.0, 9.81, 0.0}).limit;
  double before = 0.0;
  for (const double distance : {1e-2, 1e-6, 1e-10}) {
    const Descent descent = descend(Curve::cycloid, {1.0, 1.0, 9.81, limit * (1.0 - distance)});
    ASSERT_EQ(descent.end, Descent::End::arrives) << distance;
    EXPECT_GT(descent.time_bound, before);
    EXPECT_LT(descent.time_bound, 1e-15 / distance + 1e-13);
    before = descent.time_bound;
  }
}

TEST(CoulombCurves, SteepAndFlatScenes) {
  for (const auto& [H, L] : {std::pair{1.0, 1e-4}, {1e6, 1.0}, {1e-3, 1.0}, {1e-6, 1.0}, {1e6, 1e-6}}) {
    for (const double part : {0.0, 1e-8, 0.3, 0.49}) {
      const Scene s{H, L, 9.81, part * H / L};
      const tools::Outcome optimum = coulomb::solve_scene(s, {});
      ASSERT_TRUE(optimum.solved());
      for (const Curve curve : coulomb::curves) {
        const Descent descent = descend(curve, s);
        EXPECT_EQ(descent.end == Descent::End::arrives, s.friction <= descent.limit)
            << name_of(curve) << " " << H << " " << L << " " << part;
        if (descent.end != Descent::End::arrives) continue;
        EXPECT_GE(descent.final_time, optimum["final_time"].value * (1.0 - 1e-8))
            << name_of(curve) << " " << H << " " << L << " " << part;
        EXPECT_LT(descent.time_bound, 1e-8 * descent.final_time) << name_of(curve) << " " << H << " " << L << " " << part;
      }
    }
  }
}

TEST(CoulombCurves, RefuseWhatIsNotAdmissible) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const Scene& bad :
       {Scene{0.0, 1.0, 9.81, 0.1}, Scene{1.0, 0.0, 9.81, 0.1}, Scene{1.0, 1.0, nan, 0.1}, Scene{1.0, 1.0, 9.81, -0.1}}) {
    for (const Curve curve : coulomb::curves) EXPECT_THROW((void)descend(curve, bad), BadInput) << name_of(curve);
  }
  EXPECT_THROW((void)descend(Curve::parabola, {}, -0.1), BadInput);
}

}  // namespace
}  // namespace costate::test
