#include "common/branch_run.hpp"
#include "common/command_line.hpp"
#include "common/output.hpp"
#include "arc_changes.hpp"
#include "disk_scene.hpp"

using namespace costate;

namespace {

constexpr const char* description =
    "Rolling disk in minimum time (Obradovic, Salinic, Radulovic 2017), with limited friction.\n"
    "Without flags: the case of the paper, x = y = 1 m, heading pi/2, r = sqrt(6) m, c1 = 1 m/s.";

constexpr const char* conventions =
    "H = -1 + lambda_x V cos(phi) + lambda_y V sin(phi) + lambda_phi Omega + lambda_V V' = 0 is maximised. The disk starts "
    "at\n"
    "x = y = phi = 0; V(0) and V(t_f) are free; V^2 + r^2 Omega^2/6 = c1^2. Headings count every turn; a negative one turns "
    "right.\n"
    "Exit status: 0 solved, 2 bad input, 3 the scene has no solution, 4 not solved.";

tools::Heading heading_of(const disk::Scene& scene) {
  return {.model = "disk",
          .title = "Rolling disk in minimum time",
          .scene = {{"x", "m", scene.x},
                    {"y", "m", scene.y},
                    {"heading", "rad", scene.heading},
                    {"radius", "m", scene.radius},
                    {"speed", "m/s", scene.speed},
                    {"gravity", "m/s^2", scene.gravity},
                    {"friction", "1", scene.friction}},
          .unknowns = {"lambda_x", "lambda_y", "V0", "lambda_phi0", "Omega0"}};
}

}  // namespace

int main(int argc, char** argv) {
  disk::Scene scene;
  tools::CommandLine line("costate-disk", description);
  line.number("--x", scene.x, {-1e6, 1e6, "m"}, "End point x_f");
  line.number("--y", scene.y, {-1e6, 1e6, "m"}, "End point y_f");
  line.number("--heading", scene.heading, {-6.283185307179586, 6.283185307179586, "rad", true}, "End heading phi_f");
  line.number("--radius", scene.radius, {1e-6, 1e6, "m"}, "Radius r of the disk");
  line.number("--speed", scene.speed, {1e-6, 1e6, "m/s"}, "Speed c1 of the disk when it goes straight");
  line.number("--gravity", scene.gravity, {1e-6, 1e6, "m/s^2"}, "Gravity g");
  line.number("--friction", scene.friction, {1e-9, 1e6, ""}, "Friction coefficient k_f; left out: unlimited");
  line.variation_flags();
  line.solver_flags();
  line.footer(conventions);
  if (const auto status = line.parse(argc, argv)) return *status;
  return tools::run("costate-disk", [&] {
    const SolveOptions options{.accuracy = line.accuracy,
                               .method = line.method(),
                               .advice = "a nearer end point or a larger friction coefficient"};
    if (line.variation()) {
      return tools::deliver_variation({.variation = *line.variation(),
                                       .heading = [&] { return heading_of(scene); },
                                       .solve = [&] { return tools::Outcome(disk::solve_scene(scene, options)); },
                                       .start =
                                           [&](const tools::Outcome& outcome) { return disk::branch_start(scene, outcome); },
                                       .restructure = [&](const Junction& at) { return disk::arc_changes(scene, at); },
                                       .options = options},
                                      line);
    }
    const disk::Outcome outcome = disk::solve_scene(scene, options);
    return tools::deliver(heading_of(scene), outcome, line);
  });
}
