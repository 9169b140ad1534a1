#include "curvature_problem.hpp"

#include <costate/error.hpp>

#include <algorithm>
#include <fmt/format.h>

namespace costate::curvature {

namespace {

const char* name_of(ArcKind kind) { return kind == ArcKind::contact ? "contact" : "ballistic"; }

/// The direction of (x, y), followed from that of (x₁, y₁) = angle θ₁, less than half a turn away.
Jet direction_from(const Jet& theta1, const Jet& x1, const Jet& y1, const Jet& x, const Jet& y) {
  const Jet along = x1 * x + y1 * y, across = x1 * y - y1 * x;
  const double square = along.value * along.value + across.value * across.value;
  return theta1 + Jet::chain(along, across, std::atan2(across.value, along.value), -across.value / square, along.value / square);
}

constexpr int time_in_w = 2;

/// k' = 3β̂η² − μ.
template <class S>
S friction_slope(const S& eta, const S& mu, const S& beta) {
  return 3.0 * beta * eta * eta - mu;
}

}  // namespace

CurvatureProblem::CurvatureProblem(const Scene& scene, const Plan& plan) : arcs_(plan.arcs), slope_given_(scene.slope.has_value()) {
  if (arcs_.empty()) throw BadInput("the arc structure is empty: at least one arc is needed");
  for (std::size_t i = 0; i + 1 < arcs_.size(); ++i) {
    if (arcs_[i].kind == arcs_[i + 1].kind) {
      throw BadInput(fmt::format("arcs {} and {} of the structure are both {}: contact and ballistic arcs must alternate", i + 1,
                                 i + 2, name_of(arcs_[i].kind)));
    }
  }
  name_everything(scene, plan);
}

/// Unknowns and rows in the order in which shoot() meets them.
void CurvatureProblem::name_everything(const Scene& scene, const Plan& plan) {
  unknowns_.push_back({"theta_end"});
  unknowns_.push_back(last_in_contact() ? Unknown{"eta_end", std::max(1.0, plan.eta_end), 0.0} : Unknown{"slope_end"});
  unknowns_.push_back({"log_speed_ratio"});
  for (std::size_t i = 0; i < arcs_.size(); ++i) {
    unknowns_.push_back({fmt::format("length_{}", i + 1), arcs_[i].length, 0.0});
    structure_.emplace_back(name_of(arcs_[i].kind));
  }
  for (std::size_t i = arcs_.size(); i-- > 0;) {
    for (std::size_t j = 0; j < arcs_[i].nodes.size(); ++j) {
      const Node& node = arcs_[i].nodes[j];
      const std::pair<const char*, double> parts[] = {{"theta", 1.0}, {"eta", std::max(1.0, node.eta)}, {"n", node.n}};
      for (const auto& [name, scale] : parts) {
        unknowns_.push_back({fmt::format("{}_{}_{}", name, i + 1, j + 1), scale});
        rows_.push_back({fmt::format("arc {} node {} continuity of {}", i + 1, j + 1, name), scale});
      }
    }
    if (i == 0) break;
    rows_.push_back({arcs_[i].kind == ArcKind::contact ? fmt::format("arc {} start: normal force h = 0", i + 1)
                                                       : fmt::format("arc {} start: lambda_theta = mu lambda_v v", i + 1)});
  }
  const double distance = std::hypot(scene.x, scene.y);
  rows_.push_back({"end x", distance});
  rows_.push_back({"end y", distance});
  rows_.push_back({"start speed (logarithm)"});
  rows_.push_back({slope_given_ ? "start slope" : arcs_[0].kind == ArcKind::contact ? "start: normal force h = 0"
                                                                                  : "start: lambda_theta = 0"});
  const std::vector<double> values = curvature::parameters(scene);
  const std::vector<std::pair<const char*, const char*>> names{{"x", "m"},  {"y", "m"},          {"speed", "m/s"},     {"mu", "1"},
                                                               {"beta", "s^4/m^2"}, {"gravity", "m/s^2"}, {"slope", "rad"}};
  for (std::size_t i = 0; i < values.size(); ++i) parameters_.push_back({names[i].first, names[i].second, values[i]});
}

void CurvatureProblem::shoot(Shot& shot) const {
  const Jet &theta_end = shot.unknown(0), &second = shot.unknown(1);
  Constants constants;
  constants.mu = shot.parameter(mu_place);
  constants.beta = shot.parameter(beta_place) * shot.parameter(gravity_place) * shot.parameter(gravity_place);
  const Jet slope_end = last_in_contact() ? -friction_slope(second, constants.mu, constants.beta) : second;
  constants.lambda_x = cos(theta_end) - slope_end * sin(theta_end);
  constants.lambda_y = sin(theta_end) + slope_end * cos(theta_end);

  ChainPoint at;
  at.theta = theta_end;
  at.eta = last_in_contact() ? second : Jet(0.0);
  std::size_t unknown = first_length + arcs_.size(), row = 0;
  std::vector<Jet> junctions;  // their times, the latest first
  for (std::size_t i = arcs_.size(); i-- > 0;) {
    const bool in_contact = arcs_[i].kind == ArcKind::contact;
    if (in_contact) {
      contact(shot, constants, i, at, unknown, row);
    } else {
      ballistic(shot, constants, i, at);
    }
    if (i == 0) break;
    shot.row(row++, in_contact ? at.eta : at.lambda_turn - constants.mu * at.lambda_along);
    junctions.push_back(at.t);
  }
  finish(shot, constants, at, junctions, row);
}

/// Integrates contact arc i from its later end to its start, node by node.
void CurvatureProblem::contact(Shot& shot, const Constants& constants, std::size_t i, ChainPoint& at, std::size_t& unknown,
                               std::size_t& row) const {
  const std::vector<Node>& nodes = arcs_[i].nodes;
  const Jet& whole = length(shot, i);
  Jet from = 0.0;
  if (i + 1 == arcs_.size()) {
    const double first = nodes.empty() ? 1.0 : nodes.front().fraction;
    from = -end_segment(shot, i, 0.5 * first * whole.value, constants, at);
  } else {
    at.eta = 0.0;
    at.n = at.lambda_along * exp(-2.0 * at.log_v);
  }
  for (const Node& node : nodes) {
    const Jet to = -node.fraction * whole;
    segment(shot, i, from, to, constants, at);
    for (Jet* part : {&at.theta, &at.eta, &at.n}) {
      shot.row(row++, *part - shot.unknown(unknown));
      *part = shot.unknown(unknown++);
    }
    from = to;
  }
  segment(shot, i, from, -whole, constants, at);
}

/// The last piece of the motion, by its series, over at most `most` in ω; returns how long it is. What is integrated is the
/// series itself, for those who observe it.
double CurvatureProblem::end_segment(Shot& shot, std::size_t i, double most, const Constants& constants, ChainPoint& at) const {
  const EndArc end = end_arc(at.theta, at.eta, constants.mu, constants.beta);
  const double s = std::min(most, end.reach);
  ArcStart start{.arc = static_cast<int>(i), .field = &end_, .t1 = -s, .time_quadrature = time_in_w};
  for (const std::vector<Jet>& series : end.coefficient) {
    start.quadrature.emplace_back(series[0].value);
    for (std::size_t j = 1; j < series.size(); ++j) start.parameter.emplace_back(series[j].value);
  }
  shot.arc(start);
  at.x = end.at(EndArc::x, s);
  at.y = end.at(EndArc::y, s);
  at.t = end.at(EndArc::t, s);
  at.log_v = end.at(EndArc::log_v, s);
  at.theta = end.at(EndArc::theta, s);
  at.eta = end.at(EndArc::eta, s);
  at.n = end.at(EndArc::n, s);
  return s;
}

/// One segment of a contact arc. The speed it starts from scales it and nothing else, so no sensitivity to it is integrated.
void CurvatureProblem::segment(Shot& shot, std::size_t i, const Jet& from, const Jet& to, const Constants& constants,
                               ChainPoint& at) const {
  const ArcEnd end = shot.arc({.arc = static_cast<int>(i),
                               .field = &contact_,
                               .t0 = from,
                               .t1 = to,
                               .state = {at.log_v.value, at.theta, at.eta, at.n},
                               .quadrature = {at.x.value, at.y.value, at.t.value},
                               .parameter = {constants.lambda_x, constants.lambda_y, constants.mu, constants.beta},
                               .time_quadrature = time_in_w});
  const Jet faster = exp(at.log_v - at.log_v.value);
  at.x += faster * faster * (end.quadrature[0] - at.x.value);
  at.y += faster * faster * (end.quadrature[1] - at.y.value);
  at.t += faster * (end.quadrature[2] - at.t.value);
  at.log_v += end.state[0] - at.log_v.value;
  at.theta = end.state[1];
  at.eta = end.state[2];
  at.n = end.state[3];
}

/// Ballistic arc i from its later end to its start, in closed form; integrated for those who observe it.
void CurvatureProblem::ballistic(Shot& shot, const Constants& constants, std::size_t i, ChainPoint& at) const {
  const Jet v = exp(at.log_v), cosine = cos(at.theta), sine = sin(at.theta);
  const bool last = i + 1 == arcs_.size();
  const Jet along = last ? Jet(0.0) : at.n * v * v;
  const Jet turn = constants.mu * along;
  const Jet v_x = v * cosine, v_y = v * sine;
  const Jet to_x = (along * cosine - turn * sine) / v, to_y = (along * sine + turn * cosine) / v;  // costates of v_x and v_y
  const Jet& d = length(shot, i);
  shot.arc({.arc = static_cast<int>(i),
            .field = &ballistic_,
            .t1 = -d.value,
            .quadrature = {at.x.value, at.y.value, at.t.value},
            .parameter = {v_x.value, v_y.value, at.theta.value, constants.lambda_x.value, constants.lambda_y.value, to_x.value,
                          to_y.value},
            .time_quadrature = time_in_w});
  at.x -= v_x * d;
  at.y -= (v_y + 0.5 * d) * d;
  at.t -= d;
  const Jet start_v_y = v_y + d, start_to_x = to_x + constants.lambda_x * d, start_to_y = to_y + constants.lambda_y * d;
  at.log_v = 0.5 * log(v_x * v_x + start_v_y * start_v_y);
  at.theta = direction_from(at.theta, v_x, v_y, v_x, start_v_y);
  at.lambda_along = start_to_x * v_x + start_to_y * start_v_y;
  at.lambda_turn = start_to_y * v_x - start_to_x * start_v_y;
}

void CurvatureProblem::finish(Shot& shot, const Constants& constants, const ChainPoint& at, const std::vector<Jet>& junctions,
                              std::size_t row) const {
  const Jet& gravity = shot.parameter(gravity_place);
  const Jet& log_ratio = shot.unknown(2);
  const Jet speed = shot.parameter(speed_place) * exp(log_ratio);  // v_f
  const Jet time = speed / gravity, distance = speed * time;
  const bool in_contact = arcs_[0].kind == ArcKind::contact;
  const Jet along = in_contact ? at.n * exp(2.0 * at.log_v) : at.lambda_along;
  const Jet turn = in_contact ? -along * friction_slope(at.eta, constants.mu, constants.beta) : at.lambda_turn;
  shot.row(row++, -at.x * distance - shot.parameter(x_place));
  shot.row(row++, -at.y * distance - shot.parameter(y_place));
  shot.row(row++, at.log_v + log_ratio);
  shot.row(row++, slope_given_ ? at.theta - shot.parameter(slope_place) : in_contact ? at.eta : turn);

  for (std::size_t i = 0; i < junctions.size(); ++i) {
    shot.report(fmt::format("t{}", i + 1), "s", time * (junctions[junctions.size() - 1 - i] - at.t));
  }
  shot.report("final_time", "s", -at.t * time);
  shot.report("lambda_x", "s/m", constants.lambda_x / speed);
  shot.report("lambda_y", "s/m", constants.lambda_y / speed);
  shot.report("lambda_v0", "s^2/m", along * exp(-at.log_v) / gravity);
  shot.report("lambda_theta0", "s/rad", turn * time);
  shot.report("h0", "m/s^2", (in_contact ? at.eta : Jet(0.0)) * gravity);
  shot.report("theta1", "rad", at.theta);
  shot.report("theta2", "rad", shot.unknown(0));
  shot.report("v_f", "m/s", speed);
  shot.complete({-at.x.value, -at.y.value, -at.t.value},
                {constants.lambda_x.value, constants.lambda_y.value, constants.mu.value, constants.beta.value, speed.value},
                time.value);
}

std::shared_ptr<const Problem> make_problem(const Scene& scene, const Plan& plan) {
  return std::make_shared<CurvatureProblem>(scene, plan);
}

Eigen::VectorXd unknowns(const Plan& plan) {
  std::vector<double> y{plan.theta_end, plan.arcs.back().kind == ArcKind::contact ? plan.eta_end : plan.slope_end,
                        plan.log_speed_ratio};
  for (const ArcPlan& arc : plan.arcs) y.push_back(arc.length);
  for (auto arc = plan.arcs.rbegin(); arc != plan.arcs.rend(); ++arc) {
    for (const Node& node : arc->nodes) y.insert(y.end(), {node.theta, node.eta, node.n});
  }
  return Eigen::Map<const Eigen::VectorXd>(y.data(), static_cast<Eigen::Index>(y.size()));
}

std::vector<double> parameters(const Scene& scene) {
  std::vector<double> values{scene.x, scene.y, scene.speed, scene.mu, scene.beta, scene.gravity};
  if (scene.slope) values.push_back(*scene.slope);
  return values;
}

}  // namespace costate::curvature
