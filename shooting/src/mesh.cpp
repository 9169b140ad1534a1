#include "mesh.hpp"

#include <costate/error.hpp>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace costate {

namespace {

/// A node: where, and (z, w) there.
struct Node {
  double fraction;
  Eigen::VectorXd value;
};

/// The nodes of every call.
using Nodes = std::vector<std::vector<Node>>;

Mesh mesh_of(const Nodes& nodes) {
  Mesh mesh;
  std::vector<double> values;
  for (const auto& arc : nodes) {
    std::vector<double> fractions;
    for (const Node& node : arc) {
      fractions.push_back(node.fraction);
      mesh.sizes.push_back(static_cast<int>(node.value.size()));
      values.insert(values.end(), node.value.begin(), node.value.end());
    }
    mesh.cuts.push_back(std::move(fractions));
  }
  if (mesh.sizes.empty()) mesh.cuts.clear();
  mesh.nodes = Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
  return mesh;
}

Eigen::VectorXd joined(const Eigen::VectorXd& state, const Eigen::VectorXd& quadrature) {
  Eigen::VectorXd value(state.size() + quadrature.size());
  value << state, quadrature;
  return value;
}

Eigen::VectorXd scale_of(const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
  return a.cwiseAbs().cwiseMax(b.cwiseAbs()).cwiseMax(1.0);
}

double growth(const Eigen::MatrixXd& transition, const Eigen::VectorXd& scale) {
  if (transition.size() == 0) return 0.0;
  return (scale.cwiseInverse().asDiagonal() * transition * scale.asDiagonal()).cwiseAbs().maxCoeff();
}

/// A part of an arc with the derivatives of its end with respect to the state at its start.
struct Part {
  Eigen::VectorXd end, quadrature;
  Eigen::MatrixXd transition;
  double growth;
};

Part integrate(Shooting& shooting, const ArcRecord& arc, double from, double to, const Eigen::VectorXd& state) {
  const Eigen::Index n = state.size();
  const auto at = [&](double fraction) { return arc.t0 + fraction * (arc.t1 - arc.t0); };
  const Directions directions{Eigen::MatrixXd::Identity(n, n), Eigen::MatrixXd::Zero(arc.parameter.size(), n)};
  const FlowEnd& end = shooting.flows()[*arc.field].run(at(from), at(to), state, arc.parameter, directions);
  return {end.state, end.quadrature, end.state_directions, growth(end.state_directions, scale_of(state, end.state))};
}

/// The segments of one call at y, in order.
std::vector<std::vector<ArcRecord>> segments_by_call(const Shot& shot) {
  std::vector<std::vector<ArcRecord>> calls;
  for (const ArcRecord& record : shot.arcs()) {
    calls.resize(std::max(calls.size(), record.place.call + 1));
    calls[record.place.call].push_back(record);
  }
  return calls;
}

/// Fractions at which segment j of a call begins and ends.
std::pair<double, double> span(const Cuts& cuts, std::size_t call, std::size_t segment) {
  static const std::vector<double> whole;
  const auto& fractions = call < cuts.size() ? cuts[call] : whole;
  return {segment == 0 ? 0.0 : fractions[segment - 1], segment < fractions.size() ? fractions[segment] : 1.0};
}

/// Steps of the integrator that a trial may take: one that needs more is a segment too long.
constexpr long trial_steps = 2000;

class ShortTrials {
 public:
  explicit ShortTrials(Shooting& shooting) : shooting_(shooting), options_(shooting.flow_options()) {
    FlowOptions short_ones = options_;
    short_ones.max_steps = std::min(short_ones.max_steps, trial_steps);
    shooting_.flows().set_options(short_ones);
  }
  ShortTrials(const ShortTrials&) = delete;
  ShortTrials& operator=(const ShortTrials&) = delete;
  ~ShortTrials() { shooting_.flows().set_options(options_); }

 private:
  Shooting& shooting_;
  FlowOptions options_;
};

std::vector<Node> nodes_along_guess(Shooting& shooting, const Start& start, const ArcRecord& arc,
                                    const MeshOptions& options) {
  constexpr double far = 100.0, shortest = 1.0 / 512.0;
  std::vector<Node> nodes;
  Eigen::VectorXd state = arc.state, quadrature = arc.quadrature;
  double at = 0.0, length = 1.0;
  while (at < 1.0) {
    length = std::min(length, 1.0 - at);
    const double next = at + length < 1.0 ? at + length : 1.0;
    const Eigen::VectorXd guess = *start.state(arc.arc, next);
    bool good = false;
    Eigen::VectorXd passed = Eigen::VectorXd::Zero(quadrature.size());
    try {
      const Part part = integrate(shooting, arc, at, next, state);
      const Eigen::VectorXd off = (part.end - guess).cwiseQuotient(scale_of(state, guess));
      good = part.growth <= options.growth && (off.size() == 0 || off.cwiseAbs().maxCoeff() <= far);
      passed = part.quadrature;
    } catch (const LeftDomain&) {
      // Too long, as far as one can tell.
    }
    if (!good && length > shortest && nodes.size() < static_cast<std::size_t>(options.max_segments)) {
      length *= 0.5;
      continue;
    }
    at = next;
    quadrature += passed;
    state = guess;
    if (at < 1.0) nodes.push_back({at, joined(state, quadrature)});
    length *= 2.0;
  }
  return nodes;
}

}  // namespace

Mesh mesh_along_guess(Shooting& shooting, const Start& start, const MeshOptions& options) {
  const ShortTrials trials(shooting);
  Nodes nodes;
  for (const ArcRecord& arc : shooting.sketch(start)) {
    const bool known = arc.state.size() > 0 && start.state && start.state(arc.arc, 0.0);
    nodes.push_back(known ? nodes_along_guess(shooting, start, arc, options) : std::vector<Node>{});
  }
  return mesh_of(nodes);
}

Mesh remesh(Shooting& shooting, const Eigen::VectorXd& y, const MeshOptions& options) {
  const Shot shot = shooting.evaluate(y);
  Nodes nodes;
  for (const auto& segments : segments_by_call(shot)) {
    std::vector<Node>& kept = nodes.emplace_back();
    Eigen::MatrixXd passed;  // from the last node kept to the segment
    for (std::size_t j = 0; j < segments.size(); ++j) {
      const ArcRecord& segment = segments[j];
      if (segment.state.size() == 0) continue;
      const auto [from, to] = span(shooting.cuts(), segment.place.call, j);
      const Part whole = integrate(shooting, segment, 0.0, 1.0, segment.state);
      const Eigen::VectorXd scale = scale_of(segment.state, whole.end);
      const bool first = passed.size() == 0;
      if (!first && growth(whole.transition * passed, scale) <= options.growth) {
        passed = whole.transition * passed;
        continue;
      }
      if (!first) kept.push_back({from, joined(segment.state, segment.quadrature)});
      passed = whole.transition;
      if (whole.growth <= options.growth) continue;
      const int pieces = 1 + static_cast<int>(std::log(whole.growth) / std::log(options.growth));
      for (int k = 1; k < pieces; ++k) {
        const double fraction = static_cast<double>(k) / pieces;
        const Part part = integrate(shooting, segment, 0.0, fraction, segment.state);
        kept.push_back({std::lerp(from, to, fraction), joined(part.end, segment.quadrature + part.quadrature)});
      }
    }
  }
  Mesh mesh = mesh_of(nodes);
  if (mesh.sizes.size() > static_cast<std::size_t>(options.max_segments)) {
    throw LeftDomain(fmt::format("{} segments would be needed, {} are the most", mesh.sizes.size(), options.max_segments));
  }
  return mesh;
}

Mesh split(Shooting& shooting, const Eigen::VectorXd& y, const SegmentPlace& place) {
  const Shot shot = shooting.evaluate(y);
  Nodes nodes;
  for (const auto& segments : segments_by_call(shot)) {
    std::vector<Node>& kept = nodes.emplace_back();
    for (std::size_t j = 0; j < segments.size(); ++j) {
      const ArcRecord& segment = segments[j];
      const auto [from, to] = span(shooting.cuts(), segment.place.call, j);
      if (j > 0) kept.push_back({from, joined(segment.state, segment.quadrature)});
      if (segment.place.call != place.call || segment.place.segment != place.segment) continue;
      const Part half = integrate(shooting, segment, 0.0, 0.5, segment.state);
      kept.push_back({0.5 * (from + to), joined(half.end, segment.quadrature + half.quadrature)});
    }
  }
  return mesh_of(nodes);
}

double largest_growth(Shooting& shooting, const Eigen::VectorXd& y) {
  const Shot shot = shooting.evaluate(y);
  double largest = 0.0;
  for (const ArcRecord& segment : shot.arcs())
    largest = std::max(largest, integrate(shooting, segment, 0.0, 1.0, segment.state).growth);
  return largest;
}

void apply(const Mesh& mesh, Shooting& shooting, Eigen::VectorXd& y) {
  shooting.set_mesh(mesh);
  Eigen::VectorXd whole(shooting.border() + mesh.nodes.size());
  whole << y.head(shooting.border()), mesh.nodes;
  y = std::move(whole);
}

}  // namespace costate
