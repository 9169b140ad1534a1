#include "bead/scene_flags.hpp"
#include "common/branch_run.hpp"
#include "common/command_line.hpp"
#include "common/output.hpp"
#include "drag_scene.hpp"

using namespace costate;

namespace {

constexpr const char* description =
    "Bead with speed-dependent friction in minimum time (Negron-Marrero, Santiago-Figueroa 2005, section 3).\n"
    "From (0, 0) at a given speed to (x, y); K(v) = -mu v + beta v^3. Without flags: a case of the paper.";

constexpr const char* conventions =
    "y up, theta the inclination of the path: x' = v cos(theta), y' = v sin(theta), v' = -g sin(theta) + K(v).\n"
    "H = -1 + lambda_x x' + lambda_y y' + lambda_v v' = 0 is maximised; lambda_v = 0 at the end, where the speed is v_f.\n"
    "theta1 and theta2 are the slopes at the start and at the end; lambda_v0 is lambda_v at the start.\n"
    "beta <= 0: hard friction. beta > 0: soft friction, a thrust at speeds above sqrt(mu/beta); the infimum over all paths "
    "may then\n"
    "not be attained, and the answer is the fastest extremal without a focal point, a local minimum.\n"
    "Exit status: 0 solved, 2 bad input, 3 the scene has no solution, 4 not solved.";

tools::Heading heading_of(const drag::Scene& scene) {
  return {.model = "drag",
          .title = "Bead with speed-dependent friction in minimum time",
          .scene = {{"x", "m", scene.x},
                    {"y", "m", scene.y},
                    {"speed", "m/s", scene.speed},
                    {"mu", "1/s", scene.mu},
                    {"beta", "s/m^2", scene.beta},
                    {"gravity", "m/s^2", scene.gravity}},
          .unknowns = {"lambda_x", "lambda_y", "lambda_v0", "theta1", "theta2", "v_f"}};
}

}  // namespace

int main(int argc, char** argv) {
  drag::Scene scene;
  tools::CommandLine line("costate-drag", description);
  bead::motion_flags(line, scene);
  bead::friction_flags(line, scene, {0.0, 1e6, "1/s"}, {-1e6, 1e6, "s/m^2"});
  line.variation_flags();
  line.solver_flags();
  line.footer(conventions);
  if (const auto status = line.parse(argc, argv)) return *status;
  return tools::run("costate-drag", [&] {
    const SolveOptions options{.accuracy = line.accuracy,
                               .method = line.method(),
                               .advice = "a nearer end point or other friction"};
    const auto solve = [&] { return drag::solve_scene(scene, options); };
    if (line.variation()) {
      return tools::deliver_variation({.variation = *line.variation(),
                                       .heading = [&] { return heading_of(scene); },
                                       .solve = solve,
                                       .start = [&](const tools::Outcome&) { return drag::branch_start(scene); },
                                       .restate = [](const Solution& root) { return drag::restated(root); },
                                       .judge = [](const Solution& s) { return drag::focal_objection(s); },
                                       .options = options},
                                      line);
    }
    const tools::Outcome outcome = solve();
    return tools::deliver(heading_of(scene), outcome, line);
  });
}
