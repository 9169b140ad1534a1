#include "structure_search.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace costate::disk {

namespace {

/// A new saturated arc may take this part of the free arc it is born on: far enough from the birth, where the equations
/// degenerate, and near enough for the local expansion to be a good guess.
constexpr double largest_birth = 0.05;
constexpr double smallest_birth = largest_birth / 100.0;
constexpr int most_stages = 12;

std::string letters(const Structure& arcs) {
  std::string text;
  for (const ArcType& arc : arcs) text += arc.kind == ArcKind::free ? 'F' : arc.kind == ArcKind::saturated ? 'C' : 'B';
  return text;
}

std::size_t index_of_free(const Structure& arcs) {
  return static_cast<std::size_t>(
      std::find_if(arcs.begin(), arcs.end(), [](const ArcType& a) { return a.kind == ArcKind::free; }) - arcs.begin());
}

Eigen::VectorXd vector(const std::vector<double>& values) {
  return Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
}

}  // namespace

/// A point of a free arc: heading, λ along and across it (A = V, B = A_φ), λφ = Ω; and what follows from them.
struct StructureSearch::FreePoint {
  double phi, A, B, Omega;

  FreePoint(const ArcRecord& free, double heading)
      : phi(heading),
        A(free.parameter[0] * std::cos(phi) + free.parameter[1] * std::sin(phi)),
        B(free.parameter[1] * std::cos(phi) - free.parameter[0] * std::sin(phi)),
        Omega(std::sqrt(std::max(0.0, 1.0 - A * A))) {}

  [[nodiscard]] double lambda() const { return std::hypot(A, B); }
  /// |V'| is |B Ω|, and V'² + V²Ω² = |λ|²Ω².
  [[nodiscard]] double friction() const { return lambda() * Omega; }
  /// Ω' = −A B.
  [[nodiscard]] double friction_rate() const { return -lambda() * A * B; }
  /// Sign of V' = B Ω.
  [[nodiscard]] double sign() const { return B < 0.0 ? -1.0 : 1.0; }
  [[nodiscard]] double speed_angle() const { return std::atan2(Omega, A); }
};

StructureSearch::StructureSearch(const Scene& scene, const Solution& free, const SolveOptions& options, Cost& cost)
    : scene_(scene),
      options_(options),
      unit_(scene.speed * scene.speed / (scene.gravity * scene.radius / std::sqrt(6.0))),
      arcs_{{ArcKind::free}},
      y_(free.y),
      friction_(std::numeric_limits<double>::infinity()),
      birth_(largest_birth),
      cost_(cost) {}

double StructureSearch::duration(const Eigen::VectorXd& y, std::size_t arc) const {
  return y[y.size() - static_cast<Eigen::Index>(arcs_.size() - arc)];
}

Solution StructureSearch::failed(const std::string& why) const {
  Solution solution;
  const std::string where = std::isfinite(friction_) ? fmt::format("structure {} ends at friction = {:.9g}", letters(arcs_), friction_)
                                                     : "no arc can be added to the free one";
  solution.message =
      fmt::format("the arcs of this scene were not found: {}: {}; try a larger friction coefficient", where, why);
  return solution;
}

bool StructureSearch::fits(const Shot& shot, const Eigen::VectorXd& y, double friction) const {
  for (const ArcRecord& record : shot.arcs()) {
    const auto i = static_cast<std::size_t>(record.arc);
    if (duration(y, i) <= 0.0) return false;
    if (arcs_[i].kind != ArcKind::free) continue;
    const bool starts = i == 0, ends = i + 1 == arcs_.size();
    if (starts && unit_ * FreePoint(record, record.state[0]).friction() > friction) return false;
    if (ends && unit_ * FreePoint(record, record.end_state[0]).friction() > friction) return false;
  }
  return true;
}

Solution StructureSearch::run() {
  Scene unlimited = scene_;
  unlimited.friction.reset();
  {
    Shooting free(make_problem(unlimited, arcs_));
    // Which ends bind may be decided by the last digits: the friction there must be known to them.
    free.set_flow_options({.tolerance = {.relative = 1e-13, .absolute = 1e-13}});
    if (const std::string why = change(free.evaluate(y_).arcs()); !why.empty()) return failed(why);
  }
  for (int stage = 0; stage < most_stages; ++stage) {
    Scene here = scene_;
    here.friction = friction_;
    Shooting shooting(make_problem(here, arcs_));
    const Monitor outgrown = [&](const Eigen::VectorXd& y, const std::vector<double>& p) {
      return !fits(shooting.evaluate(y), y, p[friction_place]);
    };
    const Followed path = follow(shooting, y_, parameters(scene_, true), {}, outgrown);
    y_ = path.y;
    friction_ = path.parameters[friction_place];
    cost_.newton_iterations += path.newton_iterations;
    Solution solution;
    std::string why;
    if (path.stopped) {
      why = change(shooting.evaluate(y_).arcs());
    } else if (path.reached) {
      solution = solve(shooting, y_, options_);
      cost_.newton_iterations += solution.cost.newton_iterations;
    } else if (path.points > 0 || !try_smaller_birth()) {
      why = path.message;
    }
    cost_.add(shooting.statistics());
    if (!why.empty()) return failed(why);
    if (path.reached && !path.stopped) return solution;
  }
  return failed(fmt::format("the structure changed {} times on the way", most_stages));
}

std::string StructureSearch::change(const std::vector<ArcRecord>& records) {
  before_.emplace(Before{arcs_, y_, friction_, records});
  birth_ = largest_birth;
  return restructure(records);
}

bool StructureSearch::try_smaller_birth() {
  birth_ /= 4.0;
  if (!before_ || birth_ < smallest_birth) return false;
  arcs_ = before_->arcs;
  y_ = before_->y;
  friction_ = before_->friction;
  return restructure(before_->records).empty();
}

std::string StructureSearch::restructure(const std::vector<ArcRecord>& records) {
  const std::size_t i = index_of_free(arcs_);
  if (i == arcs_.size()) return "an arc without free motion has no duration left";
  const auto free = std::find_if(records.begin(), records.end(),
                                 [&](const ArcRecord& record) { return record.arc == static_cast<int>(i); });
  for (std::size_t j = 0; j < arcs_.size(); ++j) {
    if (j != i && duration(y_, j) <= 0.0) return fmt::format("arc {} has no duration left", j + 1);
  }
  if (duration(y_, i) <= 0.0) {
    if (arcs_.size() != 3 || i != 1) return "the free arc has no duration left";
    drop_free_arc(*free);
    return {};
  }
  if (free->state[1] <= 0.0 || free->end_state[1] <= 0.0) {
    return "the friction limit binds where the unlimited motion turns against its end heading";
  }
  const FreePoint start(*free, free->state[0]), end(*free, free->end_state[0]);
  const std::size_t before = arcs_.size();
  if (arcs_.size() == 1 && start.A * end.A < 0.0) {
    insert_inside(*free);
  } else {
    insert_at_ends(*free);
  }
  return arcs_.size() > before ? "" : "the friction limit binds in more than one place inside the free arc";
}

void StructureSearch::insert_at_ends(const ArcRecord& free) {
  const std::size_t i = index_of_free(arcs_);
  const FreePoint start(free, free.state[0]), end(free, free.end_state[0]);
  const double d = duration(y_, i);
  const bool starts = i == 0, ends = i + 1 == arcs_.size();
  const bool start_leads = starts && (!ends || start.friction() >= end.friction());
  const FreePoint& leading = start_leads ? start : end;
  const double cap = leading.friction() - birth_ * d * std::abs(leading.friction_rate()) / 1.5;
  const double limit = std::min(friction_, std::max(*scene_.friction, unit_ * cap)) / unit_;

  const auto birth = [&](const FreePoint& p) {
    return p.friction() > limit ? 1.5 * (p.friction() - limit) / std::abs(p.friction_rate()) : 0.0;
  };
  const double before = starts ? birth(start) : 0.0;
  const double after = ends ? birth(end) : 0.0;

  const FreePoint anchor(free, start.phi + before * start.Omega);
  const bool inside = i > 0 || before > 0.0;
  std::vector<double> y;
  if (inside) y.push_back(anchor.phi);
  y.push_back(anchor.speed_angle());
  y.push_back(anchor.B);
  for (std::size_t j = 0; j < arcs_.size(); ++j) {
    if (j == i && before > 0.0) y.push_back(before);
    y.push_back(j == i ? d - before - after : duration(y_, j));
    if (j == i && after > 0.0) y.push_back(after);
  }
  if (after > 0.0) arcs_.push_back({ArcKind::saturated, end.sign()});
  if (before > 0.0) arcs_.insert(arcs_.begin(), {ArcKind::saturated, start.sign()});
  y_ = vector(y);
  friction_ = unit_ * limit;
}

void StructureSearch::insert_inside(const ArcRecord& free) {
  const FreePoint start(free, free.state[0]);
  const double lambda = start.lambda();
  const double d = duration(y_, 0);
  // Friction is largest where A = 0: there Ω = 1 and A' = B Ω = ±|λ|.
  const double toward = start.A < 0.0 ? -std::numbers::pi / 2 : std::numbers::pi / 2;
  const double middle = start.phi + std::remainder(std::atan2(free.parameter[1], free.parameter[0]) + toward - start.phi,
                                                   2.0 * std::numbers::pi);
  double time = 0.0;  // ∫ dφ/Ω by the midpoint rule: a guess is all that is needed
  constexpr int cells = 64;
  for (int j = 0; j < cells; ++j) {
    const double step = (middle - start.phi) / cells;
    time += step / FreePoint(free, start.phi + (j + 0.5) * step).Omega;
  }
  const double largest = birth_ * d / std::numbers::sqrt3 * lambda;
  const double limit = std::max(*scene_.friction / unit_, lambda * std::sqrt(1.0 - largest * largest));
  const double ratio = limit / lambda;
  const double half_width = std::numbers::sqrt3 * std::sqrt(1.0 - ratio * ratio) / lambda;
  y_ = vector({start.speed_angle(), start.B, time - half_width, 2.0 * half_width, d - time - half_width});
  arcs_ = {{ArcKind::free}, {ArcKind::saturated, FreePoint(free, middle).sign()}, {ArcKind::free}};
  friction_ = unit_ * limit;
}

void StructureSearch::drop_free_arc(const ArcRecord& free) {
  const double half = 0.5 * duration(y_, 1);
  const FreePoint junction(free, 0.5 * (free.state[0] + free.end_state[0]));
  y_ = vector({junction.phi, junction.A, junction.A, junction.B, duration(y_, 0) + half, duration(y_, 2) + half});
  arcs_ = {arcs_[0], arcs_[2]};
}

}  // namespace costate::disk
