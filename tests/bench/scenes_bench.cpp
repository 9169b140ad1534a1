// Whole scenes drawn at random, one a model, from the scene alone and with either engine; and the gallery's programs as whole processes. CPU time,
// medians of several runs; the true error of the final time is against a solve by the other engine to 1e-11.
//   scenes_bench [SEED]
#include "coulomb/coulomb_scene.hpp"
#include "curvature/curvature_scene.hpp"
#include "disk/disk_scene.hpp"
#include "drag/drag_scene.hpp"
#include "normal/normal_scene.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fcntl.h>
#include <fmt/format.h>
#include <functional>
#include <random>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

namespace {

using namespace costate;

constexpr int runs = 5;

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + runs / 2, values.end());
  return values[runs / 2];
}

using Solve = std::function<tools::Outcome(const SolveOptions&)>;
/// A scene, and a name that tells it.
using Draw = std::function<std::pair<std::string, Solve>(std::mt19937_64&)>;

double even(std::mt19937_64& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

std::pair<std::string, Solve> draw_disk(std::mt19937_64& random) {
  disk::Scene scene;
  scene.x = even(random, 0.0, 3.0);
  scene.y = even(random, 0.0, 3.0);
  scene.heading = even(random, 0.5, 3.0);
  scene.friction = even(random, 0.05, 0.07);
  return {fmt::format("disk --x {:.3g} --y {:.3g} --heading {:.3g} --friction {:.3g}", scene.x, scene.y, scene.heading,
                      *scene.friction),
          [scene](const SolveOptions& options) { return disk::solve_scene(scene, options); }};
}

std::pair<std::string, Solve> draw_coulomb(std::mt19937_64& random) {
  coulomb::Scene scene;
  scene.drop = even(random, 1.0, 10.0);
  scene.span = even(random, 1.0, 10.0);
  scene.friction = even(random, 0.0, 0.95) * coulomb::largest_friction(scene);
  return {fmt::format("coulomb --drop {:.3g} --span {:.3g} --friction {:.3g}", scene.drop, scene.span, scene.friction),
          [scene](const SolveOptions& options) { return coulomb::solve_scene(scene, options); }};
}

/// v₀, a, b, μ, β of a bead with friction of [N].
template <class Scene>
std::pair<std::string, Solve> draw_bead(std::mt19937_64& random, const char* name, double most_mu, double beta) {
  Scene scene;
  scene.speed = even(random, 2.0, 10.0);
  scene.x = even(random, 2.0, 10.0);
  scene.y = even(random, -10.0, -1.0);
  scene.mu = even(random, 0.05, most_mu);
  scene.beta = -beta * even(random, 0.5, 2.0);
  return {fmt::format("{} --x {:.3g} --y {:.3g} --speed {:.3g} --mu {:.3g} --beta {:.3g}", name, scene.x, scene.y,
                      scene.speed, scene.mu, scene.beta),
          [scene](const SolveOptions& options) { return solve_scene(scene, options); }};
}

void time_scene(const Draw& draw, std::mt19937_64& random) {
  // A drawn scene may have no solution: the first that has one is timed.
  std::pair<std::string, Solve> scene;
  do scene = draw(random);
  while (!scene.second({.accuracy = 1e-8}).solved());
  for (const Method method : {Method::adams, Method::runge_kutta}) {
    const Method other = method == Method::adams ? Method::runge_kutta : Method::adams;
    const double exact = scene.second({.accuracy = 1e-11, .method = other})["final_time"].value;
    std::vector<double> times;
    tools::Outcome outcome;
    for (int run = 0; run < runs; ++run) {
      const double begin = thread_seconds();
      outcome = scene.second({.accuracy = 1e-8, .method = method});
      times.push_back(1e3 * (thread_seconds() - begin));
    }
    const Quantity& time = outcome["final_time"];
    fmt::print("{:80} {:11} {:8.2f} {:8} {:8} {:9.1e} {:9.1e}\n", scene.first,
               method == Method::adams ? "CVODES" : "Runge-Kutta", median(times),
               outcome.cost.rhs_evaluations + outcome.cost.sensitivity_evaluations, outcome.cost.steps,
               std::abs(time.value - exact), time.error_bound);
  }
}

/// CPU time of a process, ms; negative if it fails.
double process_time(const std::string& program) {
  rusage usage{};
  std::fflush(stdout);  // or the child would print it again
  const pid_t child = fork();
  if (child == 0) {
    if (dup2(open("/dev/null", O_WRONLY), STDOUT_FILENO) < 0) _exit(127);
    execl(program.c_str(), program.c_str(), nullptr);
    _exit(127);
  }
  int status = 0;
  if (child < 0 || wait4(child, &status, 0, &usage) < 0 || !WIFEXITED(status) || WEXITSTATUS(status) == 127) return -1.0;
  const auto ms = [](const timeval& t) {
    return 1e3 * static_cast<double>(t.tv_sec) + 1e-3 * static_cast<double>(t.tv_usec);
  };
  return ms(usage.ru_utime) + ms(usage.ru_stime);
}

}  // namespace

int main(int count, char** values) {
  std::mt19937_64 random(count > 1 ? static_cast<unsigned>(std::atoi(values[1])) : 1u);
  fmt::print("{:80} {:11} {:>8} {:>8} {:>8} {:>9} {:>9}\n", "scene, accuracy 1e-8", "engine", "ms", "rhs", "steps", "true",
             "bound");
  const Draw draws[] = {draw_disk, draw_coulomb,
                        [](auto& r) { return draw_bead<normal_friction::Scene>(r, "normal-friction", 0.6, 1e-4); },
                        [](auto& r) { return draw_bead<curvature::Scene>(r, "curvature-friction", 0.4, 1e-3); },
                        [](auto& r) { return draw_bead<drag::Scene>(r, "drag", 0.5, 2e-3); }};
  for (const Draw& draw : draws) time_scene(draw, random);
  fmt::print("\n{:80} {:>8}\n", "program, the whole process", "ms");
  for (const std::string program : {COSTATE_PROGRAMS}) {
    std::vector<double> times;
    for (int run = 0; run < runs; ++run) times.push_back(process_time(program));
    fmt::print("{:80} {:8.1f}\n", program.substr(program.rfind('/') + 1), median(times));
  }
}
