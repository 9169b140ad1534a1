#include "bead/scene_flags.hpp"
#include "common/branch_run.hpp"
#include "common/command_line.hpp"
#include "common/output.hpp"
#include "corner_changes.hpp"
#include "normal_scene.hpp"

using namespace costate;

namespace {

constexpr const char* description =
    "Bead with friction that depends on the normal force (Negron-Marrero, Santiago-Figueroa 2005, section 2.1), in minimum "
    "time.\n"
    "Without flags: a case of the paper's Table 1, x = 3 m, y = -9 m, v0 = 35 m/s, mu = 5, beta = -0.02.";

constexpr const char* conventions =
    "y up, theta the slope of the path and the control, N = g cos(theta), K(N) = -mu N + beta N^3:\n"
    "H = -1 + lambda_x v cos(theta) + lambda_y v sin(theta) + lambda_v (K - g sin(theta)) = 0 is maximised. The bead starts "
    "at\n"
    "x = y = 0 with v = v0 and ends at any speed, lambda_v(t_f) = 0. Costates are dT/d(end point) = (lambda_x, lambda_y) "
    "and\n"
    "-dT/dv0 = lambda_v0. With beta = 0 the solution is a cycloid in closed form. Hard friction, beta < 0, can give the "
    "path corners.\n"
    "N_min < 0 in the result: the path overhangs, and friction is a thrust there, as the paper's problem admits.\n"
    "The paper's multipliers: c2 = -lambda_x, c3 = lambda_y, lambda = lambda_v / v.\n"
    "Exit status: 0 solved, 2 bad input, 3 the scene has no solution, 4 not solved.";

tools::Heading heading_of(const normal_friction::Scene& scene) {
  return {.model = "normal-friction",
          .title = "Bead with normal-force friction in minimum time",
          .scene = {{"x", "m", scene.x},
                    {"y", "m", scene.y},
                    {"speed", "m/s", scene.speed},
                    {"mu", "1", scene.mu},
                    {"beta", "s^4/m^2", scene.beta},
                    {"gravity", "m/s^2", scene.gravity}},
          .unknowns = {"lambda_x", "lambda_y", "lambda_v0", "theta1", "theta2"}};
}

}  // namespace

int main(int argc, char** argv) {
  normal_friction::Scene scene;
  tools::CommandLine line("costate-normal-friction", description);
  bead::motion_flags(line, scene);
  bead::friction_flags(line, scene, {0.0, 1e3, ""}, {-1e3, 1e3, "s^4/m^2"});
  line.variation_flags();
  line.solver_flags();
  line.footer(conventions);
  if (const auto status = line.parse(argc, argv)) return *status;
  return tools::run("costate-normal-friction", [&] {
    const SolveOptions options{.accuracy = line.accuracy,
                               .method = line.method(),
                               .advice = "a nearer end point or other friction"};
    const auto solve = [&] { return normal_friction::solve_scene(scene, options); };
    if (line.variation()) {
      return tools::deliver_variation({.variation = *line.variation(),
                                       .heading = [&] { return heading_of(scene); },
                                       .solve = solve,
                                       .start = [&](const tools::Outcome&) { return normal_friction::branch_start(scene); },
                                       .restructure =
                                           [&](const Junction& at) { return normal_friction::corner_changes(scene, at); },
                                       .options = options},
                                      line);
    }
    const tools::Outcome outcome = solve();
    return tools::deliver(heading_of(scene), outcome, line);
  });
}
