#include "bead/scene_flags.hpp"
#include "common/branch_run.hpp"
#include "common/command_line.hpp"
#include "common/output.hpp"
#include "curvature/arc_changes.hpp"
#include "curvature/curvature_scene.hpp"

using namespace costate;

namespace {

constexpr const char* description =
    "Bead on a wire with friction K(h) = -mu h + beta h^3, h = g cos(theta) + v theta' the normal force per unit mass, in "
    "minimum\n"
    "time from (0, 0) to (x, y), y up (Negron-Marrero, Santiago-Figueroa 2005, section 2.2).\n"
    "Without flags: x = 4 m, y = -2.5 m, speed 2 m/s, slope -1 rad, mu = 0.2, beta = -1e-3 s^4/m^2, g = 9.8 m/s^2.";

constexpr const char* conventions =
    "H = -1 + lambda_x v cos(theta) + lambda_y v sin(theta) + lambda_v (-g sin(theta) + K(h)) + lambda_theta theta' = 0 is\n"
    "maximised over h >= 0; lambda_v = lambda_theta = 0 at the end. Where h = 0 the bead flies (ballistic arc). With "
    "--slope free\n"
    "lambda_theta = 0 at the start. lambda_v0, lambda_theta0, h0, theta1 are values at the start, theta2 and v_f at the "
    "end.\n"
    "beta < 0: for beta >= 0 there is no minimum (Legendre-Clebsch).\n"
    "Exit status: 0 solved, 2 bad input, 3 the scene has no solution, 4 not solved.";

tools::Heading heading_of(const curvature::Scene& scene) {
  return {.model = "curvature-friction",
          .title = "Bead with curvature-coupled normal-force friction in minimum time",
          .scene = {{"x", "m", scene.x},
                    {"y", "m", scene.y},
                    {"speed", "m/s", scene.speed},
                    {"slope", "rad", scene.slope},
                    {"mu", "1", scene.mu},
                    {"beta", "s^4/m^2", scene.beta},
                    {"gravity", "m/s^2", scene.gravity}},
          .unknowns = {"lambda_x", "lambda_y", "lambda_v0", "lambda_theta0", "h0", "theta1", "theta2"}};
}

}  // namespace

int main(int argc, char** argv) {
  curvature::Scene scene;
  tools::CommandLine line("costate-curvature-friction", description);
  bead::motion_flags(line, scene);
  line.number_or("--slope", scene.slope, {-1.5707, 1.5707, "rad"}, "free",
                 "Inclination theta at the start, or the word free");
  bead::friction_flags(line, scene, {0.0, 100.0, ""}, {-1e6, 1e6, "s^4/m^2"});
  line.variation_flags();
  line.solver_flags();
  line.footer(conventions);
  if (const auto status = line.parse(argc, argv)) return *status;
  return tools::run("costate-curvature-friction", [&] {
    const SolveOptions options{.accuracy = line.accuracy,
                               .method = line.method(),
                               .advice = "a nearer end point, --slope free or stronger |beta|"};
    const auto solve = [&] { return curvature::solve_scene(scene, options); };
    if (line.variation()) {
      return tools::deliver_variation({.variation = *line.variation(),
                                       .heading = [&] { return heading_of(scene); },
                                       .solve = solve,
                                       .restructure = [&](const Junction& at) { return curvature::arc_changes(scene, at); },
                                       .options = options},
                                      line);
    }
    const tools::Outcome outcome = solve();
    return tools::deliver(heading_of(scene), outcome, line);
  });
}
