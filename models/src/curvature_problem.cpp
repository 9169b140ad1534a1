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
  return theta1 +
         Jet::chain(along, across, std::atan2(across.value, along.value), -across.value / square, along.value / square);
}

constexpr int time_in_w = 2;

/// k' = 3β̂η² − μ.
template <class S>
S friction_slope(const S& eta, const S& mu, const S& beta) {
  return 3.0 * beta * eta * eta - mu;
}

}  // namespace

CurvatureProblem::CurvatureProblem(const Scene& scene, const Plan& plan)
    : arcs_(plan.arcs), slope_given_(scene.slope.has_value()) {
  if (arcs_.empty()) throw BadInput("the arc structure is empty: at least one arc is needed");
  for (std::size_t i = 0; i + 1 < arcs_.size(); ++i) {
    if (arcs_[i].kind == arcs_[i + 1].kind) {
      throw BadInput(fmt::format("arcs {} and {} of the structure are both {}: contact and ballistic arcs must alternate",
                                 i + 1, i + 2, name_of(arcs_[i].kind)));
    }
  }
  name_everything(scene, plan);
}

/// Unknowns and rows in the order in which shoot() meets them.
void CurvatureProblem::name_everything(const Scene& scene, const Plan& plan) {
  unknowns_.push_back({"theta_end"});
  unknowns_.push_back(last_in_contact() ? Unknown{"eta_end", plan.eta_end, 0.0} : Unknown{"slope_end"});
  unknowns_.push_back({"log_speed_ratio"});
  for (std::size_t i = 0; i < arcs_.size(); ++i) {
    unknowns_.push_back({fmt::format("length_{}", i + 1), arcs_[i].length, 0.0});
    structure_.emplace_back(name_of(arcs_[i].kind));
  }
  if (starts_freely_in_flight()) unknowns_.push_back({"theta_start"});
  for (std::size_t i = arcs_.size(); i-- > 0;) {
    double most = i + 1 == arcs_.size() ? plan.eta_end : 0.0;
    for (const Node& node : arcs_[i].nodes) most = std::max(most, node.eta);
    for (std::size_t j = 0; j < arcs_[i].nodes.size(); ++j) {
      const Node& node = arcs_[i].nodes[j];
      // Where η is small the motion is nearly a fall, and θ matters to the same digits.
      const double eta = std::max(0.1 * most, node.eta);
      const std::pair<const char*, double> parts[] = {{"theta", std::min(1.0, eta)}, {"eta", eta}, {"n", node.n}};
      for (const auto& [name, scale] : parts) {
        unknowns_.push_back({fmt::format("{}_{}_{}", name, i + 1, j + 1), scale});
        rows_.push_back({fmt::format("arc {} node {} continuity of {}", i + 1, j + 1, name), scale});
      }
    }
    if (i == 0) break;
    rows_.push_back({arcs_[i].kind == ArcKind::contact ? fmt::format("arc {} start: normal force h = 0", i + 1)
                                                       : fmt::format("arc {} start: lambda_theta = mu lambda_v v", i + 1)});
  }
  if (arcs_[0].kind == ArcKind::contact) {
    rows_.push_back({"start speed (logarithm)"});
    rows_.push_back({slope_given_ ? "start slope" : "start: normal force h = 0"});
  } else {
    rows_.push_back({"arc 1 end: speed (logarithm)"});
    rows_.push_back({"arc 1 end: slope"});
    if (!slope_given_) rows_.push_back({"start: lambda_theta = 0"});
  }
  const double distance = std::hypot(scene.x, scene.y);
  rows_.push_back({"end x", distance});
  rows_.push_back({"end y", distance});
  const std::vector<double> values = curvature::parameters(scene);
  const std::vector<std::pair<const char*, const char*>> names{{"x", "m"},      {"y", "m"},          {"speed", "m/s"},
                                                               {"mu", "1"},     {"beta", "s^4/m^2"}, {"gravity", "m/s^2"},
                                                               {"slope", "rad"}};
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
  std::size_t unknown = first_node(), row = 0;
  std::vector<Jet> junctions;  // their times, the latest first
  for (std::size_t i = arcs_.size(); i-- > 0;) {
    const bool in_contact = arcs_[i].kind == ArcKind::contact;
    if (in_contact) {
      contact(shot, constants, i, at, unknown, row);
    } else if (i > 0) {
      ballistic(shot, constants, i, at);
    } else {
      first_flight(shot, constants, at, row);
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
double CurvatureProblem::end_segment(Shot& shot, std::size_t i, double most, const Constants& constants,
                                     ChainPoint& at) const {
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

/// The flight whose later end is where the chain has come: its velocity there, and the costates of the velocity's components.
CurvatureProblem::Flight CurvatureProblem::flight_to(const Constants& constants, std::size_t i, const ChainPoint& at) const {
  const Jet v = exp(at.log_v), cosine = cos(at.theta), sine = sin(at.theta);
  const Jet along = i + 1 == arcs_.size() ? Jet(0.0) : at.n * v * v;
  const Jet turn = constants.mu * along;  // h = 0 at a junction
  return {v * cosine, v * sine, (along * cosine - turn * sine) / v, (along * sine + turn * cosine) / v};
}

/// Integrates a flight from where it is given over `d` in t, for those who observe it: it is known in closed form.
void CurvatureProblem::show_flight(Shot& shot, const Constants& constants, std::size_t i, const Flight& flight,
                                   const ChainPoint& at, double d) const {
  shot.arc({.arc = static_cast<int>(i),
            .field = &ballistic_,
            .t1 = d,
            .quadrature = {at.x.value, at.y.value, at.t.value},
            .parameter = {flight.v_x.value, flight.v_y.value, at.theta.value, constants.lambda_x.value,
                          constants.lambda_y.value, flight.to_x.value, flight.to_y.value},
            .time_quadrature = time_in_w});
}

/// A flight between two contact arcs or at the end, from its later end to its start.
void CurvatureProblem::ballistic(Shot& shot, const Constants& constants, std::size_t i, ChainPoint& at) const {
  const Flight end = flight_to(constants, i, at);
  const Jet& d = length(shot, i);
  show_flight(shot, constants, i, end, at, -d.value);
  at.x -= end.v_x * d;
  at.y -= (end.v_y + 0.5 * d) * d;
  at.t -= d;
  const Flight start{end.v_x, end.v_y + d, end.to_x + constants.lambda_x * d, end.to_y + constants.lambda_y * d};
  at.log_v = 0.5 * log(start.v_x * start.v_x + start.v_y * start.v_y);
  at.theta = direction_from(at.theta, end.v_x, end.v_y, start.v_x, start.v_y);
  at.lambda_along = start.along();
  at.lambda_turn = start.turn();
}

/// The flight with which the motion starts: from its start, where speed and direction are known, for a long fall has forgotten
/// them. Sets the rows that join it to the chain.
void CurvatureProblem::first_flight(Shot& shot, const Constants& constants, ChainPoint& at, std::size_t& row) const {
  const Flight end = flight_to(constants, 0, at);
  const Jet& d = length(shot, 0);
  const Jet speed = exp(-shot.unknown(log_ratio_place));
  const Jet theta = slope_given_ ? shot.parameter(slope_place) : shot.unknown(first_length + arcs_.size());
  const Flight start{speed * cos(theta), speed * sin(theta), end.to_x + constants.lambda_x * d,
                     end.to_y + constants.lambda_y * d};
  const Jet arriving_v_y = start.v_y - d;
  shot.row(row++, at.log_v - 0.5 * log(start.v_x * start.v_x + arriving_v_y * arriving_v_y));
  shot.row(row++, at.theta - direction_from(theta, start.v_x, start.v_y, start.v_x, arriving_v_y));
  at.x -= start.v_x * d;
  at.y -= (start.v_y - 0.5 * d) * d;
  at.t -= d;
  at.log_v = -shot.unknown(log_ratio_place);
  at.theta = theta;
  at.lambda_along = start.along();
  at.lambda_turn = start.turn();
  // μ λv v − λθ is quadratic in t and 0 at the end of the flight; this is the other factor.
  at.switching = constants.mu * (constants.lambda_x * start.v_x + constants.lambda_y * start.v_y + start.to_y) -
                 constants.lambda_y * start.v_x + constants.lambda_x * start.v_y + start.to_x -
                 d * (constants.mu * constants.lambda_y + constants.lambda_x);
  show_flight(shot, constants, 0, start, at, d.value);
  if (!slope_given_) shot.row(row++, at.lambda_turn);
}

void CurvatureProblem::finish(Shot& shot, const Constants& constants, const ChainPoint& at,
                              const std::vector<Jet>& junctions, std::size_t row) const {
  const Jet& gravity = shot.parameter(gravity_place);
  const Jet& log_ratio = shot.unknown(log_ratio_place);
  const Jet speed = shot.parameter(speed_place) * exp(log_ratio);  // v_f
  const Jet time = speed / gravity, distance = speed * time;
  const bool in_contact = arcs_[0].kind == ArcKind::contact;
  const Jet along = in_contact ? at.n * exp(2.0 * at.log_v) : at.lambda_along;
  const Jet turn = in_contact ? -along * friction_slope(at.eta, constants.mu, constants.beta) : at.lambda_turn;
  if (in_contact) {
    shot.row(row++, at.log_v + log_ratio);
    shot.row(row++, slope_given_ ? at.theta - shot.parameter(slope_place) : at.eta);
  }
  shot.row(row++, -at.x * distance - shot.parameter(x_place));
  shot.row(row++, -at.y * distance - shot.parameter(y_place));

  for (std::size_t i = 0; i < arcs_.size(); ++i) {
    shot.guard(EventKind::arc_death, length_of_arc(i), length(shot, i));
  }
  // In flight the bead must not want to be pressed on the wire: μ λv v − λθ ≥ 0. That is a quadratic in t, and vanishes where the flight
  // joins a contact arc: what holds at its ends holds inside. At the end of the motion λθ/(λv v) → B_θ/B.
  if (last_in_contact())
    shot.guard(EventKind::arc_birth, end_force, shot.unknown(1));
  else
    shot.guard(EventKind::arc_birth, end_switching, constants.mu - shot.unknown(1));
  // A free slope leaves nothing to guard: λθ(0) = 0 < μ λv v, or η(0) = 0, are rows. Before a flight η starts from 0 backward: by the length
  // of the arc it does not vanish with that.
  if (slope_given_) {
    if (in_contact)
      shot.guard(EventKind::arc_birth, start_force, arcs_.size() > 1 ? at.eta / length(shot, 0) : at.eta);
    else
      shot.guard(EventKind::arc_birth, start_switching, at.switching);
  }
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

Eigen::VectorXd unknowns(const Scene& scene, const Plan& plan) {
  std::vector<double> y{plan.theta_end, plan.arcs.back().kind == ArcKind::contact ? plan.eta_end : plan.slope_end,
                        plan.log_speed_ratio};
  for (const ArcPlan& arc : plan.arcs) y.push_back(arc.length);
  if (plan.arcs.front().kind == ArcKind::ballistic && !scene.slope) y.push_back(plan.theta_start);
  for (auto arc = plan.arcs.rbegin(); arc != plan.arcs.rend(); ++arc) {
    for (const Node& node : arc->nodes) y.insert(y.end(), {node.theta, node.eta, node.n});
  }
  return Eigen::Map<const Eigen::VectorXd>(y.data(), static_cast<Eigen::Index>(y.size()));
}

Plan CurvatureProblem::plan(const Eigen::VectorXd& y) const {
  Plan plan;
  plan.arcs = arcs_;
  plan.theta_end = y[0];
  (last_in_contact() ? plan.eta_end : plan.slope_end) = y[1];
  plan.log_speed_ratio = y[log_ratio_place];
  for (std::size_t i = 0; i < arcs_.size(); ++i) plan.arcs[i].length = y[static_cast<Eigen::Index>(first_length + i)];
  auto next = static_cast<Eigen::Index>(first_node());
  if (starts_freely_in_flight()) plan.theta_start = y[next - 1];
  for (auto arc = plan.arcs.rbegin(); arc != plan.arcs.rend(); ++arc) {
    for (Node& node : arc->nodes) {
      for (double* part : {&node.theta, &node.eta, &node.n}) *part = y[next++];
    }
  }
  return plan;
}

Plan plan_of(const Problem& problem, const Eigen::VectorXd& y) {
  const auto* own = dynamic_cast<const CurvatureProblem*>(&problem);
  if (own == nullptr) throw BadInput("the problem is not one of a bead with curvature-coupled friction");
  if (y.size() != static_cast<Eigen::Index>(problem.unknowns().size())) {
    throw BadInput(fmt::format("the problem has {} unknowns, not {}", problem.unknowns().size(), y.size()));
  }
  return own->plan(y);
}

std::string length_of_arc(std::size_t i) { return fmt::format("length of arc {}", i + 1); }

std::vector<double> parameters(const Scene& scene) {
  std::vector<double> values{scene.x, scene.y, scene.speed, scene.mu, scene.beta, scene.gravity};
  if (scene.slope) values.push_back(*scene.slope);
  return values;
}

}  // namespace costate::curvature
