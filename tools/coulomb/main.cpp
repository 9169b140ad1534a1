#include "common/branch_run.hpp"
#include "common/command_line.hpp"
#include "common/output.hpp"
#include "comparison.hpp"
#include "coulomb_scene.hpp"

#include <costate/error.hpp>

#include <fmt/format.h>

using namespace costate;

namespace {

constexpr const char* description =
    "Fastest descent of a bead from rest with Coulomb friction mu N, N = m (g cos(alpha) + v^2/R), and descent times along "
    "other\n"
    "curves (Kurilin 2025). Without flags: drop 5 m, span 4 m, mu = 0.3.";

constexpr const char* conventions =
    "y is measured down from the start, alpha is the slope below the horizontal. H = -1 + lambda_x v cos(alpha) + lambda_y "
    "v sin(alpha)\n"
    "+ lambda_v g (sin(alpha) - mu cos(alpha)) = 0 is maximised with v exp(-mu alpha) and lambda_v exp(mu alpha) held; "
    "lambda_v is the\n"
    "costate of v, lambda_v0 = 1/g at the start. There is an optimum for mu below mu_max = drop/span. mu = 0: the cycloid, "
    "in closed form.\n"
    "Curves: kurilin (slope turning at a constant rate, its alpha0, alphaF, C = 2 g/alpha'^2 optimal), cycloid (that "
    "without friction),\n"
    "parabola y/H = (1 + epsilon)(x/L) - epsilon (x/L)^2, circle (straight down at the start), gladkov (x' = cos^2(beta) "
    "exp(4 mu beta),\n"
    "y' = sin(beta) cos(beta) exp(4 mu beta); needs 2 mu < drop/span). mu_finish: from there on the bead does not arrive.\n"
    "Exit status: 0 solved, 2 bad input, 3 the scene has no solution (or the bead stops), 4 not solved.";

tools::Heading heading_of(const coulomb::Scene& scene, const std::string& curve, double epsilon) {
  tools::Heading heading{.model = "coulomb",
                         .title = "Descent with Coulomb friction, curve: " + curve,
                         .scene = {{"drop", "m", scene.drop},
                                   {"span", "m", scene.span},
                                   {"gravity", "m/s^2", scene.gravity},
                                   {"mu", "1", scene.friction}},
                         .unknowns = {"alpha0", "alphaF"}};
  if (curve == "optimal") heading.unknowns = {"lambda_x", "lambda_y", "lambda_v0", "alpha0", "alphaF"};
  if (curve == "kurilin") heading.unknowns.emplace_back("C");
  if (curve == "parabola") heading.scene.push_back({"epsilon", "1", epsilon});
  return heading;
}

/// The curve of that name; none for the optimum.
std::optional<coulomb::Curve> curve_of(const std::string& name) {
  for (const coulomb::Curve curve : coulomb::curves) {
    if (name == coulomb::name_of(curve)) return curve;
  }
  return std::nullopt;
}

}  // namespace

int main(int argc, char** argv) {
  coulomb::Scene scene;
  std::string curve = "optimal";
  double epsilon = 0.6;
  bool compare = false;
  tools::CommandLine line("costate-coulomb", description);
  line.number("--drop", scene.drop, {-1e6, 1e6, "m"}, "Height H of the start above the end");
  line.number("--span", scene.span, {1e-6, 1e6, "m"}, "Horizontal distance L");
  line.number("--gravity", scene.gravity, {1e-6, 1e6, "m/s^2"}, "Gravity g");
  line.number("--mu", scene.friction, {0.0, 1e6, ""}, "Friction coefficient");
  line.variation_flags();
  std::vector<std::string> words{"optimal"};
  for (const coulomb::Curve c : coulomb::curves) words.emplace_back(coulomb::name_of(c));
  line.choice("--curve", curve, words, "The wire");
  line.number("--epsilon", epsilon, {0.0, 1e3, ""}, "Of the parabola: 0 straight, 1 level at the end");
  line.toggle("--compare", compare, "Print the optimum and all curves in one table");
  line.solver_flags();
  line.footer(conventions);
  if (const auto status = line.parse(argc, argv)) return *status;
  return tools::run("costate-coulomb", [&] {
    const SolveOptions options{.accuracy = line.accuracy, .method = line.method(), .advice = "a larger --accuracy"};
    if (compare && line.variation()) throw BadInput("--compare and --vary exclude each other");
    if (compare && (!line.csv.empty() || curve != "optimal")) {
      throw BadInput(fmt::format("--compare and {} exclude each other", line.csv.empty() ? "--curve" : "--csv"));
    }
    const tools::Heading heading = heading_of(scene, curve, epsilon);
    if (compare) {
      return coulomb::deliver_comparison(heading, coulomb::compare(scene, epsilon, options), line);
    }
    if (line.variation()) {
      if (curve != "optimal")
        throw BadInput(fmt::format("--vary and --curve {} exclude each other: the optimum is followed", curve));
      return tools::deliver_variation({.variation = *line.variation(),
                                       .heading = [&] { return heading_of(scene, curve, epsilon); },
                                       .solve = [&] { return coulomb::solve_scene(scene, options); },
                                       .start = [&](const tools::Outcome&) { return coulomb::branch_start(scene); },
                                       .options = options},
                                      line);
    }
    const std::optional<coulomb::Curve> wire = curve_of(curve);
    const tools::Outcome outcome = wire ? coulomb::solve_curve(*wire, scene, epsilon, !line.csv.empty())
                                        : coulomb::solve_scene(scene, options);
    return tools::deliver(heading, outcome, line);
  });
}
