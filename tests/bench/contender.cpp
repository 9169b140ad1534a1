#include "contender.hpp"

#include "bare_cvode.hpp"
#include "free_end_problems.hpp"
#include "three_arcs.hpp"

#include <costate/error.hpp>
#include <costate/shooting/locate.hpp>
#include <costate/shooting/solve.hpp>

#include <fmt/format.h>

#include <limits>
#include <memory>
#include <stdexcept>

namespace costate::bench {
namespace {

template <std::size_t N>
Outcome outcome(const Root<double, N>& root) {
  Outcome o{root.found, {}, root.iterations, root.steps, root.evaluations};
  std::copy(root.unknowns.begin(), root.unknowns.end(), o.unknowns.begin());
  return o;
}

Outcome outcome(bool found, const Eigen::VectorXd& y, int iterations, const Statistics& before, const Statistics& after) {
  Outcome o{found, {}, iterations, after.steps - before.steps, after.rhs_evaluations - before.rhs_evaluations};
  std::copy(y.begin(), y.end(), o.unknowns.begin());
  return o;
}

/// The yardstick's Newton method on the library's evaluations.
Outcome by_evaluations(Shooting& shooting, const Eigen::VectorXd& start, Method method, const Ladder<double>& ladder) {
  const Statistics before = shooting.statistics();
  Eigen::VectorXd y = start, residual(y.size()), correction(y.size());
  double tolerance = ladder.loosest;
  for (int i = 1; i <= 20; ++i) {
    shooting.set_flow_options({.tolerance = {tolerance, tolerance}, .method = method});
    try {
      if (!shooting.factorise(y)) break;
      shooting.residual(y, residual);
    } catch (const LeftDomain&) {
      break;
    }
    shooting.solve(residual, correction);
    y -= correction;
    const double size = correction.lpNorm<Eigen::Infinity>();
    if (!(size < 1e3)) break;
    if (tolerance == ladder.finest && size * size < ladder.enough * ladder.finest) {
      return outcome(true, y, i, before, shooting.statistics());
    }
    tolerance = ladder.next(size);
  }
  return outcome(false, y, 20, before, shooting.statistics());
}

/// How the tolerances of the way down follow the corrections is tuned for every
/// contender.
const double shares[] = {1e-4, 1e-2, 1.0, 1e2};

struct Engine {
  const char* name;
  Method method;
};
const Engine engines[] = {{"CVODES", Method::adams}, {"Runge-Kutta", Method::runge_kutta}};

/// The library on a problem, without certificate and with.
void add_library(std::vector<Contender>& to, const std::string& name, const std::shared_ptr<const Problem>& problem,
                 const Eigen::VectorXd& start, const std::vector<double>& reference) {
  for (const auto& [engine, method] : engines) {
    const auto shooting = std::make_shared<Shooting>(problem);
    Contender plain{name, fmt::format("evaluations, {}", engine), reference, {}, 0.1, 1e-15};
    for (const double share : shares) {
      for (const double loosest : {0.1, 1e-3}) {
        plain.variants.push_back([=, m = method](double setting) {
          return by_evaluations(*shooting, start, m,
                                {.finest = setting, .loosest = std::max(setting, loosest), .share = share});
        });
      }
    }
    to.push_back(std::move(plain));
    // The options of a search are kept as long as they are the same.
    struct Search {
      double setting = 0.0;
      std::unique_ptr<Locator> locator;
    };
    const auto search = std::make_shared<Search>();
    const Solve located = [=, m = method](double setting) {
      if (search->setting != setting)
        *search = {setting, std::make_unique<Locator>(*shooting, LocateOptions{.accuracy = setting, .method = m})};
      const Located l = search->locator->find(start);
      Outcome o{l.converged(), {}, l.iterations, l.statistics.steps, l.statistics.rhs_evaluations};
      std::copy(l.y.begin(), l.y.end(), o.unknowns.begin());
      return o;
    };
    to.push_back({name, fmt::format("locate, {}", engine), reference, {located}});
    const Solve certified = [=, m = method](double setting) {
      const Solution s = costate::solve(*shooting, start, {.accuracy = setting, .method = m});
      Outcome o{s.solved(), {}, static_cast<int>(s.cost.newton_iterations), s.cost.steps, s.cost.rhs_evaluations};
      std::copy(s.y.begin(), s.y.end(), o.unknowns.begin());
      return o;
    };
    to.push_back({name,
                  fmt::format("solve with certificate, {}", engine),
                  reference,
                  {certified},
                  coarsest_accuracy,
                  finest_accuracy});
  }
}

template <class Arc>
Contender by_hand(const char* name, const std::array<double, 3>& start, const std::vector<double>& reference) {
  Contender c{name, "yardstick", reference, {}};
  for (const bool chord : {false, true}) {
    for (const double share : {1.0, 100.0}) {
      c.variants.push_back([=](double setting) {
        const Ladder<double> ladder{.finest = setting, .loosest = std::max(0.1, setting), .share = share, .chord = chord};
        return outcome(solve_by_hand(Arc{}, start, ladder));
      });
    }
  }
  return c;
}

/// The yardstick's equations and Newton method on CVODE driven by hand.
template <class Arc>
Contender by_bare_cvode(const char* name, const std::array<double, 3>& start, const std::vector<double>& reference) {
  // CVODE's numbers are each followed by their derivatives.
  using Numbers = std::array<double, Arc::size>;
  struct Layout {
    static void gather(const double* from, Numbers& y) {
      for (std::size_t i = 0; i < 4; ++i) {
        y[i] = from[3 * i];
        for (std::size_t j = 0; j < 2; ++j) y[4 + 2 * i + j] = from[3 * i + 1 + j];
      }
    }
    static void scatter(const Numbers& y, double* to) {
      for (std::size_t i = 0; i < 4; ++i) {
        to[3 * i] = y[i];
        for (std::size_t j = 0; j < 2; ++j) to[3 * i + 1 + j] = y[4 + 2 * i + j];
      }
    }
  };
  struct Driver {
    Arc arc;
    BareCvode cvode{[](double, const double* y, double* dy, const void* data) {
                      Numbers at, rate;
                      Layout::gather(y, at);
                      (*static_cast<const Arc*>(data))(at, rate);
                      Layout::scatter(rate, dy);
                      return true;
                    },
                    &arc, 4, 2};
  };
  const auto driver = std::make_shared<Driver>();
  Contender c{name, "bare CVODE", reference, {}};
  for (const double share : shares) {
    for (const double loosest : {0.1, 1e-3}) {
      c.variants.push_back([=](double setting) {
        const Ladder<double> ladder{.finest = setting,
                                    .loosest = std::max(loosest, setting),
                                    .share = share,
                                    .chord = false};
        long steps = 0, evaluations = 0;
        auto root = newton(Arc{}, start, ladder, [&](const Arc& at, double duration, Numbers& y, double tolerance, bool) {
          driver->arc = at;
          Numbers numbers;
          Layout::scatter(y, numbers.data());
          try {
            driver->cvode.integrate(0.0, duration, numbers, tolerance, tolerance);
          } catch (const std::runtime_error&) {
            return false;
          }
          Layout::gather(numbers.data(), y);
          steps += driver->cvode.steps();
          evaluations += driver->cvode.evaluations();
          return true;
        });
        root.steps = steps;
        root.evaluations = evaluations;
        return outcome(root);
      });
    }
  }
  return c;
}

/// λ_across, … of the disk's problem with arcs C F C at the unknowns of the
/// paper.
Eigen::VectorXd outward(const ThreeArcs::Unknowns& u) {
  const auto [phi, lambda_phi] = ThreeArcs{}.first_junction(u);
  const disk::ArcType up{disk::ArcKind::saturated, 1.0}, down{disk::ArcKind::saturated, -1.0};
  disk::Chain chain{u[4], u[5], {{up, u[1], {}, {}}, {{}, u[2] - u[1], {}, {}}, {down, u[3] - u[2], {}, {}}}};
  chain.arcs[1].begin = {.phi = phi, .V = chain.along(phi), .lambda_phi = lambda_phi};
  return disk::unknowns(chain);
}

void add_three_arcs(std::vector<Contender>& to) {
  const ThreeArcs::Unknowns start{0.6, 1.0, 1.2, 2.2, 0.55, 0.55};
  const ThreeArcs::Unknowns root{0.62649933845929283581, 1.0855647258861120056,  1.1277604886791390037,
                                 2.2133252145652510093,  0.54680115257495074564, 0.54680115257495074564};
  const auto solver = std::make_shared<ThreeArcs>();
  const auto hand = [&](const char* name, ThreeArcs::Differences differences) {
    Contender c{"P3", name, {root.begin(), root.end()}, {}};
    for (const double share : {1.0, 10.0}) {
      for (const double enough : {1.0, 10.0}) {
        c.variants.push_back([=](double setting) {
          const Ladder<double> ladder{.finest = setting,
                                      .loosest = std::max(0.1, setting),
                                      .share = share,
                                      .enough = enough};
          return outcome(solver->solve(start, ladder, differences));
        });
      }
    }
    to.push_back(std::move(c));
  };
  hand("yardstick", ThreeArcs::Differences::whole);
  hand("by hand, shared differences", ThreeArcs::Differences::shared);
  disk::Scene scene;
  scene.friction = 0.0525;
  const disk::Structure structure{{disk::ArcKind::saturated, 1.0}, {}, {disk::ArcKind::saturated, -1.0}};
  const Eigen::VectorXd reference = outward(root);
  add_library(to, "P3", disk::make_problem(scene, structure), outward(start), {reference.begin(), reference.end()});
}

double seconds_of(const Solve& solve, double setting) {
  double best = std::numeric_limits<double>::infinity();
  for (int repetition = 0; repetition < 5; ++repetition) {
    const double begin = thread_seconds();
    int count = 0;
    while (thread_seconds() - begin < 2e-4) {
      solve(setting);
      ++count;
    }
    best = std::min(best, (thread_seconds() - begin) / count);
  }
  return best;
}

}  // namespace

double Contender::error(const Outcome& outcome) const {
  double worst = 0.0;
  for (std::size_t i = 0; i < reference.size(); ++i) worst = std::max(worst, std::abs(outcome.unknowns[i] - reference[i]));
  return worst;
}

std::vector<Contender> contenders() {
  std::vector<Contender> all;
  const Eigen::Vector3d disk_start(2.0, 0.5, 0.5), bead_start(1.5, 0.2, 0.3);
  const std::vector<double> disk_root{2.2117064716698362607, 0.54389466469897336825, 0.54389466469897336825};
  const std::vector<double> bead_root{1.4687921521171958687, 0.1868959177730843904, 0.2520381594354885505};
  all.push_back(by_hand<DiskArc<double>>("P1", {2.0, 0.5, 0.5}, disk_root));
  all.push_back(by_bare_cvode<DiskArc<double>>("P1", {2.0, 0.5, 0.5}, disk_root));
  add_library(all, "P1", std::make_shared<DiskTransfer>(), disk_start, disk_root);
  all.push_back(by_hand<BeadFlight<double>>("P2", {1.5, 0.2, 0.3}, bead_root));
  all.push_back(by_bare_cvode<BeadFlight<double>>("P2", {1.5, 0.2, 0.3}, bead_root));
  add_library(all, "P2", std::make_shared<BeadTransfer>(), bead_start, bead_root);
  add_three_arcs(all);
  return all;
}

std::vector<Path> paths() {
  const auto path = [](const std::string& problem_name, const std::string& engine, std::shared_ptr<const Problem> problem,
                       const Eigen::Vector3d& start, const std::string& parameter, double from, double to, Method method) {
    const auto shooting = std::make_shared<Shooting>(std::move(problem));
    const LocateOptions options{.accuracy = 1e-9, .method = method};
    std::vector<double> values;
    for (int i = 0; i < path_points; ++i) values.push_back(from + (to - from) * i / (path_points - 1));
    const auto along = [=] { return locate_along(*shooting, start, parameter, values, options).size() == values.size(); };
    const auto locator = std::make_shared<Locator>(*shooting, options);
    const auto place = std::find_if(shooting->problem().parameters().begin(), shooting->problem().parameters().end(),
                                    [&](const Parameter& p) { return p.name == parameter; }) -
                       shooting->problem().parameters().begin();
    const auto cold = [=] {
      auto parameters = shooting->parameters();
      bool all = true;
      for (const double value : values) {
        parameters[static_cast<std::size_t>(place)] = value;
        shooting->set_parameters(parameters);
        all = locator->find(start).converged() && all;
      }
      return all;
    };
    return Path{fmt::format("{}, {} = {:g} ... {:g}, {}", problem_name, parameter, from, to, engine), along, cold};
  };
  std::vector<Path> all;
  for (const auto& [engine, method] : engines) {
    all.push_back(path("P1", engine, std::make_shared<DiskTransfer>(), {2.0, 0.5, 0.5}, "x", 1.0, 1.5, method));
    all.push_back(path("P2", engine, std::make_shared<BeadTransfer>(), {1.5, 0.2, 0.3}, "mu", 0.3, 0.25, method));
  }
  return all;
}

Tuned tune(const Contender& contender, double target) {
  Tuned best{&contender, nullptr, 0.0, {}};
  double least = std::numeric_limits<double>::infinity();
  for (const Solve& solve : contender.variants) {
    for (double setting = contender.coarsest; setting > 0.9 * contender.finest; setting *= std::sqrt(0.1)) {
      const Outcome outcome = solve(setting);
      if (!outcome.found || !(contender.error(outcome) <= target)) continue;
      // A solver that keeps first steps may take others the next time.
      const double seconds = seconds_of(solve, setting);
      const Outcome again = solve(setting);
      if (!again.found || !(contender.error(again) <= target)) continue;
      if (seconds < least) {
        least = seconds;
        best = {&contender, &solve, setting, again};
      }
      break;
    }
  }
  return best;
}

}  // namespace costate::bench
