/// Scenes of the bead with normal-force friction drawn at random, each solved cold and integrated again by an integrator and a law
/// that share nothing with the library. COSTATE_SCENES sets their number.
#include "normal/normal_scene.hpp"
#include "runge_kutta.hpp"

#include <cstdio>
#include <cstdlib>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <map>
#include <random>

namespace costate::test {
namespace {

using normal_friction::Scene;
using tools::Outcome;

/// v₀ 0.1 … 40 and a 0.1 … 50, log-uniform; b −50 … a/4, three in ten near the height that the start speed reaches; μ up to 0.99 of
/// what the energy admits and at most 20, a few beyond it; friction hard or soft, |β| g² from 0.001 to 0.4 of μ, one in ten linear.
class Generator {
 public:
  Scene next() {
    Scene s;
    s.speed = 0.1 * std::pow(400.0, uniform());
    s.x = 0.1 * std::pow(500.0, uniform());
    s.y = uniform(-50.0, 0.25 * s.x);
    const double height = s.speed * s.speed / (2.0 * s.gravity);
    if (uniform() < 0.3) s.y = std::min(0.25 * s.x, height * uniform(-1.0, 1.0));
    const double most = (height - s.y) / s.x;
    s.mu = std::min(20.0, 0.99 * std::max(most, 0.02)) * uniform();
    if (uniform() < 0.05) s.mu = std::max(most, 0.0) * uniform(1.0, 1.5);
    const double size = s.mu / (s.gravity * s.gravity) * std::pow(10.0, uniform(-3.0, std::log10(0.4)));
    const double kind = uniform();
    s.beta = kind < 0.1 ? 0.0 : kind < 0.55 ? size : -size;
    return s;
  }

 private:
  double uniform(double low = 0.0, double high = 1.0) { return std::uniform_real_distribution<double>(low, high)(random_); }
  std::mt19937_64 random_{20050726};
};

/// The slope that maximises H: a grid of 180, then Newton's method.
double best_slope(const Scene& s, double v, double lambda_x, double lambda_y, double lambda_v) {
  const auto N = [&](double theta) { return s.gravity * std::cos(theta); };
  const auto H = [&](double theta) {
    return v * (lambda_x * std::cos(theta) + lambda_y * std::sin(theta)) +
           lambda_v * (-s.gravity * std::sin(theta) - s.mu * N(theta) + s.beta * std::pow(N(theta), 3));
  };
  double best = 0.0, highest = -std::numeric_limits<double>::infinity();
  for (int i = 0; i < 180; ++i) {
    const double theta = i * std::numbers::pi / 90;
    if (const double value = H(theta); value > highest) {
      highest = value;
      best = theta;
    }
  }
  for (int i = 0; i < 8; ++i) {
    const double c = std::cos(best), sn = std::sin(best), K1 = -s.mu + 3.0 * s.beta * N(best) * N(best), K2 = 6.0 * s.beta * N(best);
    const double slope = v * (lambda_y * c - lambda_x * sn) - lambda_v * s.gravity * (c + sn * K1);
    const double curvature = -v * (lambda_x * c + lambda_y * sn) - lambda_v * s.gravity * (-sn + c * K1 - s.gravity * sn * sn * K2);
    best -= std::clamp(slope / curvature, -0.02, 0.02);
  }
  return best;
}

/// Where the full equations in time, from the start that the solution gives, end: by how much of the chord and of v_f.
struct Miss {
  double place, speed, lambda_v;
};
Miss integrate_again(const Scene& s, const Outcome& outcome) {
  const double lambda_x = outcome["lambda_x"].value, lambda_y = outcome["lambda_y"].value;
  const double length = std::hypot(s.x, s.y), end_speed = outcome["v_f"].value, start_lambda = outcome["lambda_v0"].value;
  const double unit = std::hypot(s.speed, std::sqrt(2.0 * s.gravity * length));
  // x, y in chords, v in units of √(v₀² + 2 g L), λv in its own.
  const auto rates = [&](double, const std::array<double, 4>& z) {
    const double v = z[2] * unit, lambda_v = z[3] * start_lambda;
    const double theta = best_slope(s, v, lambda_x, lambda_y, lambda_v), N = s.gravity * std::cos(theta);
    return std::array{v * std::cos(theta) / length, v * std::sin(theta) / length,
                      (-s.gravity * std::sin(theta) - s.mu * N + s.beta * N * N * N) / unit,
                      -(lambda_x * std::cos(theta) + lambda_y * std::sin(theta)) / start_lambda};
  };
  const auto end = runge_kutta<4>(rates, 0.0, outcome["final_time"].value, {0.0, 0.0, s.speed / unit, 1.0}, 1e-11);
  return {std::hypot(end[0] - s.x / length, end[1] - s.y / length), std::abs(end[2] - end_speed / unit), std::abs(end[3])};
}

TEST(Sweep, ScenesAreSolvedOrCalledInfeasibleAndNoneIsWrong) {
  const char* wanted = std::getenv("COSTATE_SCENES");
  const int scenes = wanted != nullptr ? std::atoi(wanted) : 40;
  Generator generator;
  std::map<std::string, int> counts;
  int wrong = 0, failed = 0;
  double worst_miss = 0.0, slowest = 0.0;
  for (int i = 0; i < scenes; ++i) {
    const Scene s = generator.next();
    const Outcome outcome = normal_friction::solve_scene(s, {.accuracy = 1e-9});
    slowest = std::max(slowest, outcome.cost.seconds);
    const std::string name = fmt::format("--x {:.17g} --y {:.17g} --speed {:.17g} --mu {:.17g} --beta {:.17g}", s.x, s.y, s.speed, s.mu, s.beta);
    if (outcome.status == Outcome::Status::infeasible) {
      ++counts["infeasible"];
      // Even with the least friction that N in 0 … g can have, the energy does not suffice.
      const double least = std::min(s.mu, s.mu - s.beta * s.gravity * s.gravity);
      EXPECT_LE(s.speed * s.speed, 2.0 * s.gravity * (s.y + least * s.x) * (1.0 + 1e-12)) << name;
    } else if (outcome.status == Outcome::Status::failed) {
      ++failed;
      std::printf("not solved: %s\n  %s\n", name.c_str(), outcome.message.c_str());
    } else {
      ++counts[outcome.closed_form ? "closed form" : fmt::format("{} arcs", outcome.solution.arcs.size())];
      const Miss miss = integrate_again(s, outcome);
      const double condition = outcome.closed_form ? 1.0 : outcome.solution.certificate.condition;
      // What the claimed errors (1e-9) and the independent integration (some hundred steps of 1e-11) grow to.
      const double admissible = 1e-8 * std::max(10.0, condition);
      worst_miss = std::max(worst_miss, miss.place);
      if (!(std::max({miss.place, miss.speed, miss.lambda_v}) <= admissible)) {
        ++wrong;
        std::printf("wrong: %s\n  misses by %.2e chords, v_f by %.2e, lambda_v by %.2e; admissible %.2e\n", name.c_str(), miss.place,
                    miss.speed, miss.lambda_v, admissible);
      }
    }
  }
  for (const auto& [what, count] : counts) std::printf("%-12s %d\n", what.c_str(), count);
  std::printf("not solved   %d\nworst miss of the end point %.1e chords, slowest scene %.2f s\n", failed, worst_miss, slowest);
  EXPECT_EQ(wrong, 0);
  EXPECT_LE(failed, scenes / 100);
  EXPECT_LT(slowest, 2.0);
}

}  // namespace
}  // namespace costate::test
