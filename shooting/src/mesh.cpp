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

/// How large the states of an arc get: what their growth is measured in. One that stays at 0 is measured in its own unit.
class Magnitude {
 public:
  explicit Magnitude(Eigen::Index n) : largest_(Eigen::VectorXd::Zero(n)) {}
  void include(const Eigen::VectorXd& state) { largest_ = largest_.cwiseMax(state.cwiseAbs()); }
  [[nodiscard]] Eigen::VectorXd scale() const {
    constexpr double nothing = 1e-8;
    return (largest_.array() > nothing).select(largest_, 1.0);
  }

 private:
  Eigen::VectorXd largest_;
};

double growth(const Eigen::MatrixXd& transition, const Eigen::VectorXd& scale) {
  if (transition.size() == 0) return 0.0;
  return (scale.cwiseInverse().asDiagonal() * transition * scale.asDiagonal()).cwiseAbs().maxCoeff();
}

/// A part of an arc with the derivatives of its end with respect to the state at its start.
struct Part {
  Eigen::VectorXd end, quadrature;
  Eigen::MatrixXd transition;
};

Part integrate(Shooting& shooting, const ArcRecord& arc, double from, double to, const Eigen::VectorXd& state) {
  shooting.check_step_limit();
  const Eigen::Index n = state.size();
  const auto at = [&](double fraction) { return arc.t0 + fraction * (arc.t1 - arc.t0); };
  const Directions directions{Eigen::MatrixXd::Identity(n, n), Eigen::MatrixXd::Zero(arc.parameter.size(), n)};
  const FlowEnd& end = shooting.flows()[*arc.field].run(at(from), at(to), state, arc.parameter, directions);
  return {end.state, end.quadrature, end.state_directions};
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

/// An arc along the states of a start.
class GuessedArc {
 public:
  GuessedArc(Shooting& shooting, const Start& start, const ArcRecord& arc)
      : shooting_(shooting), start_(start), arc_(arc), state_(arc.state), quadrature_(arc.quadrature) {
    Magnitude magnitude(state_.size());
    magnitude.include(state_);
    for (const double fraction : {0.0, 0.25, 0.5, 0.75, 1.0}) magnitude.include(guess(fraction));
    scale_ = magnitude.scale();
  }

  [[nodiscard]] static bool known(const Start& start, const ArcRecord& arc) {
    return arc.state.size() > 0 && start.state && start.state(arc.arc, 0.0);
  }

  /// Goes on to a fraction of the arc along its flow, and there back to the guessed states; false, and stays, if it grows or goes astray too much.
  bool advance(double to, const MeshOptions& options) {
    constexpr double far = 100.0;
    const Eigen::VectorXd goal = guess(to);
    try {
      const Part part = integrate(shooting_, arc_, at_, to, state_);
      const Eigen::VectorXd off = (part.end - goal).cwiseQuotient(scale_.cwiseMax(1.0));
      if (!(growth(part.transition, scale_) <= options.growth && off.cwiseAbs().maxCoeff() <= far)) return false;
      quadrature_ += part.quadrature;
    } catch (const LeftDomain&) {
      return false;  // too long, as far as one can tell
    }
    move(to, goal);
    return true;
  }
  void jump(double to) { move(to, guess(to)); }
  [[nodiscard]] double at() const { return at_; }
  [[nodiscard]] Node node() const { return {at_, joined(state_, quadrature_)}; }

 private:
  [[nodiscard]] Eigen::VectorXd guess(double fraction) const {
    if (auto state = start_.state(arc_.arc, fraction)) return *std::move(state);
    throw LeftDomain(fmt::format("no state is known at {:.3g} of arc {}", fraction, arc_.arc + 1));
  }
  void move(double to, const Eigen::VectorXd& state) {
    at_ = to;
    state_ = state;
  }

  Shooting& shooting_;
  const Start& start_;
  const ArcRecord& arc_;
  double at_ = 0.0;
  Eigen::VectorXd state_, quadrature_, scale_;
};

std::vector<Node> nodes_along(GuessedArc arc, const MeshOptions& options) {
  constexpr double shortest = 1.0 / 512.0;
  std::vector<Node> nodes;
  for (double length = 1.0; arc.at() < 1.0; length *= 2.0) {
    length = std::min(length, 1.0 - arc.at());
    const auto end = [&] { return arc.at() + length < 1.0 ? arc.at() + length : 1.0; };
    const bool enough = nodes.size() >= static_cast<std::size_t>(options.max_segments);
    while (!enough && length > shortest && !arc.advance(end(), options)) length *= 0.5;
    if (enough || length <= shortest) arc.jump(end());
    if (arc.at() < 1.0) nodes.push_back(arc.node());
  }
  return nodes;
}

}  // namespace

Mesh mesh_along_guess(Shooting& shooting, const Start& start, const MeshOptions& options) {
  const ShortTrials trials(shooting);
  Nodes nodes;
  for (const ArcRecord& arc : shooting.sketch(start)) {
    nodes.push_back(GuessedArc::known(start, arc) ? nodes_along({shooting, start, arc}, options) : std::vector<Node>{});
  }
  return mesh_of(nodes);
}

bool can_stay_whole(Shooting& shooting, const Start& start, const MeshOptions& options) {
  const ShortTrials trials(shooting);
  const std::vector<ArcRecord> arcs = shooting.sketch(start);
  return std::all_of(arcs.begin(), arcs.end(), [&](const ArcRecord& arc) {
    return !GuessedArc::known(start, arc) || GuessedArc(shooting, start, arc).advance(1.0, options);
  });
}

Mesh remesh(Shooting& shooting, const Eigen::VectorXd& y, const MeshOptions& options) {
  const Shot shot = shooting.evaluate(y);
  Nodes nodes;
  for (const auto& segments : segments_by_call(shot)) {
    std::vector<Node>& kept = nodes.emplace_back();
    Magnitude magnitude(segments.front().state.size());
    for (const ArcRecord& segment : segments) {
      magnitude.include(segment.state);
      magnitude.include(segment.end_state);
    }
    const Eigen::VectorXd scale = magnitude.scale();
    Eigen::MatrixXd passed;  // from the last node kept to the segment
    for (std::size_t j = 0; j < segments.size(); ++j) {
      const ArcRecord& segment = segments[j];
      if (segment.state.size() == 0) continue;
      const auto [from, to] = span(shooting.cuts(), segment.place.call, j);
      const Part whole = integrate(shooting, segment, 0.0, 1.0, segment.state);
      const bool first = passed.size() == 0;
      if (!first && growth(whole.transition * passed, scale) <= options.growth) {
        passed = whole.transition * passed;
        continue;
      }
      if (!first) kept.push_back({from, joined(segment.state, segment.quadrature)});
      passed = whole.transition;
      const double grown = growth(whole.transition, scale);
      if (grown <= options.growth) continue;
      if (!std::isfinite(grown)) throw LeftDomain("an arc grows beyond all bounds");
      const int pieces = 1 + static_cast<int>(std::log(grown) / std::log(options.growth));
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
  for (const ArcRecord& segment : shot.arcs()) {
    const Part whole = integrate(shooting, segment, 0.0, 1.0, segment.state);
    Magnitude magnitude(segment.state.size());
    magnitude.include(segment.state);
    magnitude.include(whole.end);
    largest = std::max(largest, growth(whole.transition, magnitude.scale()));
  }
  return largest;
}

void apply(const Mesh& mesh, Shooting& shooting, Eigen::VectorXd& y) {
  shooting.set_mesh(mesh);
  Eigen::VectorXd whole(shooting.border() + mesh.nodes.size());
  whole << y.head(shooting.border()), mesh.nodes;
  y = std::move(whole);
}

}  // namespace costate
