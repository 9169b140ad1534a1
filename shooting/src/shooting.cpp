#include "staircase.hpp"

#include <costate/error.hpp>
#include <costate/shooting/shooting.hpp>

#include <algorithm>
#include <fmt/format.h>
#include <fmt/ranges.h>

namespace costate {

namespace {

template <class List>
std::string names(const List& list) {
  std::vector<std::string> names;
  for (const auto& item : list) names.push_back(item.name);
  return fmt::format("{} ({})", names.size(), fmt::join(names, ", "));
}

}  // namespace

Shooting::Shooting(std::shared_ptr<const Problem> problem) : problem_(std::move(problem)) {
  if (problem_->unknowns().size() != problem_->rows().size()) {
    throw BadInput(fmt::format("the problem has the unknowns {} and the rows {}; shooting needs as many rows as unknowns",
                               names(problem_->unknowns()), names(problem_->rows())));
  }
  for (const Parameter& parameter : problem_->parameters()) parameters_.push_back(parameter.value);
}

Shooting::~Shooting() = default;

/// The shots are of other parameters or another mesh.
void Shooting::forget() {
  shot_ = {};
  values_ = {};
}

void Shooting::set_parameters(const std::vector<double>& values) {
  if (values.size() != problem_->parameters().size()) {
    throw BadInput(
        fmt::format("{} parameter values given, the problem has {}", values.size(), problem_->parameters().size()));
  }
  parameters_ = values;
  shot_.current = false;
  for (Kept* kept : {&shot_, &values_}) {
    if (!kept->shot) continue;
    for (std::size_t i = 0; i < values.size(); ++i) {
      kept->shot->set_parameter(i, Jet(values[i], kept->shot->parameter(i).gradient()));
    }
  }
}

void Shooting::set_flow_options(const FlowOptions& options) {
  if (options == flows_.options()) return;
  flows_.set_options(options);
  shot_.current = false;
}

void Shooting::set_mesh(const Mesh& mesh) {
  Eigen::Index total = 0;
  std::size_t cuts = 0;
  for (const int size : mesh.sizes) total += size;
  for (const auto& fractions : mesh.cuts) cuts += fractions.size();
  if (total != mesh.nodes.size() || cuts != mesh.sizes.size()) {
    throw BadInput(fmt::format("{} cuts with {} nodes of together {} values are given {} values", cuts, mesh.sizes.size(),
                               total, mesh.nodes.size()));
  }
  if (cuts == 0 && node_sizes_.empty()) return;
  cuts_ = mesh.cuts;
  node_sizes_ = mesh.sizes;
  node_scales_.resize(total);
  forget();
  // A component is as large as it gets on its arc; below 1 the integration's absolute tolerance is what counts.
  Eigen::Index first = 0;
  std::size_t node = 0;
  for (const auto& fractions : cuts_) {
    if (fractions.empty()) continue;
    const Eigen::Index size = node_sizes_[node], count = static_cast<Eigen::Index>(fractions.size());
    const auto values = mesh.nodes.segment(first, size * count).reshaped(size, count);
    const Eigen::VectorXd scale = values.cwiseAbs().rowwise().maxCoeff().cwiseMax(1.0);
    node_scales_.segment(first, size * count) = scale.replicate(count, 1);
    first += size * count;
    node += fractions.size();
  }
}

std::vector<ArcRecord> Shooting::sketch(const Start& start) {
  const Eigen::VectorXd& y = start.unknowns;
  Shot shot(flows_, std::vector<Jet>(y.begin(), y.begin() + border()),
            std::vector<Jet>(parameters_.begin(), parameters_.end()), problem_->rows().size());
  shot.sketch([&](int arc) { return start.state ? start.state(arc, 1.0) : std::nullopt; });
  problem_->shoot(shot);
  return shot.arcs();
}

void Shooting::check_size(const Eigen::VectorXd& y) const {
  if (y.size() == size()) return;
  throw BadInput(fmt::format("the point has {} values, the shooting {} unknowns, {} of them at nodes", y.size(), size(),
                             size() - border()));
}

const Shot& Shooting::evaluate(const Eigen::VectorXd& y, const std::vector<double>& path, Extent extent) {
  check_size(y);
  if (path != path_) {
    shot_ = {};
    path_ = path;
  }
  if (!shot_.current || y != point_) {
    fit(shot_, true);
    point_ = y;
    shoot(shot_, y, extent);
  } else if (extent == Extent::everything && !shot_.shot->wants_reports()) {
    shot_.current = false;
    shot_.shot->replay();
    problem_->shoot(*shot_.shot);
    shot_.current = true;
  }
  return *shot_.shot;
}

const Shot& Shooting::values(const Eigen::VectorXd& y, Extent extent) {
  check_size(y);
  fit(values_, false);
  shoot(values_, y, extent);
  return *values_.shot;
}

/// Makes a shot where there is none.
void Shooting::fit(Kept& kept, bool differentiated) {
  if (kept.shot) return;
  const auto variable = [&](Eigen::Index i) {
    return differentiated ? Jet::variable(0.0, static_cast<int>(i)) : Jet(0.0);
  };
  std::vector<Jet> unknowns, nodes, parameters;
  for (Eigen::Index i = 0; i < size(); ++i) (i < border() ? unknowns : nodes).push_back(variable(i));
  for (std::size_t i = 0; i < parameters_.size(); ++i) {
    const double rate = differentiated && !path_.empty() ? path_[i] : 0.0;
    parameters.push_back(rate == 0.0 ? Jet(parameters_[i]) : Jet::variable(parameters_[i], static_cast<int>(size()), rate));
  }
  kept.shot.emplace(flows_, std::move(unknowns), std::move(parameters), problem_->rows().size());
  kept.shot->cut(cuts_, std::move(nodes));
}

void Shooting::check_step_limit() const {
  if (statistics().steps >= step_limit_) throw BudgetSpent(fmt::format("{} integration steps are spent", step_limit_));
}

void Shooting::shoot(Kept& kept, const Eigen::VectorXd& y, Extent extent) {
  check_step_limit();
  kept.current = false;
  kept.shot->restart({y.data(), static_cast<std::size_t>(y.size())}, extent == Extent::everything);
  try {
    problem_->shoot(*kept.shot);
  } catch (const LeftDomain&) {
    failed_place_ = kept.shot->place();
    throw;
  }
  kept.shot->finish();
  kept.current = true;
}

const Jet& Shooting::row(const Shot& shot, Eigen::Index i) const {
  return i < border() ? shot.rows()[static_cast<std::size_t>(i)] : shot.matches()[static_cast<std::size_t>(i - border())];
}

std::string Shooting::node_name(Eigen::Index component) const {
  std::size_t node = 0;
  for (std::size_t call = 0; call < cuts_.size(); ++call) {
    for (const double fraction : cuts_[call]) {
      const int size = node_sizes_[node++];
      if (component < size) return fmt::format("component {} at {:.3g} of arc {}", component + 1, fraction, call + 1);
      component -= size;
    }
  }
  return "";
}

std::string Shooting::row_name(Eigen::Index i) const {
  if (i < border()) return problem_->rows()[static_cast<std::size_t>(i)].name;
  return "continuity of " + node_name(i - border());
}

std::string Shooting::unknown_name(Eigen::Index j) const {
  if (j < border()) return problem_->unknowns()[static_cast<std::size_t>(j)].name;
  return node_name(j - border());
}

void Shooting::residual(const Eigen::VectorXd& y, Eigen::VectorXd& r) { r = residual(evaluate(y, {}, Extent::equations)); }

void Shooting::jacobian(const Eigen::VectorXd& y, Eigen::MatrixXd& j) { j = jacobian(evaluate(y, {}, Extent::equations)); }

Eigen::VectorXd Shooting::residual(const Shot& shot) const {
  Eigen::VectorXd r(size());
  for (Eigen::Index i = 0; i < size(); ++i) r[i] = row(shot, i).value;
  return r;
}

Eigen::MatrixXd Shooting::jacobian(const Shot& shot) const {
  Eigen::MatrixXd j = Eigen::MatrixXd::Zero(size(), size());
  for (Eigen::Index i = 0; i < size(); ++i) {
    for (const auto& entry : row(shot, i).gradient()) {
      if (entry.column < size()) j(i, entry.column) = entry.derivative;
    }
  }
  return j;
}

Eigen::VectorXd Shooting::path_derivative(const Shot& shot) const {
  Eigen::VectorXd d(size());
  for (Eigen::Index i = 0; i < size(); ++i) {
    d[i] = row(shot, i).derivative(static_cast<int>(size()));
  }
  return d;
}

Staircase Shooting::decompose(const Shot& shot) const {
  std::vector<Jet::Gradient> rows;
  for (Eigen::Index i = 0; i < size(); ++i) {
    rows.push_back(row(shot, i).gradient());
    if (!rows.back().empty() && rows.back().back().column == size()) rows.back().pop_back();  // the path's
  }
  return {rows, {.border = static_cast<int>(border()), .blocks = node_sizes_}, row_scales(), unknown_scales()};
}

bool Shooting::factorise(const Eigen::VectorXd& y) {
  newton_ = std::make_unique<Staircase>(decompose(evaluate(y, {}, Extent::equations)));
  return !newton_->singular();
}

void Shooting::solve(const Eigen::VectorXd& r, Eigen::VectorXd& x) const { x = newton_->solve(r); }

double Shooting::correction(const Eigen::VectorXd& y) {
  const Shot& shot = evaluate(y, {}, Extent::equations);
  const Eigen::VectorXd step = decompose(shot).solve(residual(shot));
  return step.cwiseQuotient(unknown_scales()).cwiseAbs().maxCoeff();
}

Eigen::VectorXd Shooting::unknown_scales() const {
  Eigen::VectorXd s(size());
  for (Eigen::Index i = 0; i < border(); ++i) s[i] = problem_->unknowns()[static_cast<std::size_t>(i)].scale;
  s.tail(node_scales_.size()) = node_scales_;
  return s;
}

Eigen::VectorXd Shooting::row_scales() const {
  Eigen::VectorXd s(size());
  for (Eigen::Index i = 0; i < border(); ++i) s[i] = problem_->rows()[static_cast<std::size_t>(i)].scale;
  s.tail(node_scales_.size()) = node_scales_;
  return s;
}

}  // namespace costate
