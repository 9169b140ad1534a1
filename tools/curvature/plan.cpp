#include "curvature/plan.hpp"

#include <costate/trajectory.hpp>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace costate::curvature {

namespace {

/// A motion as the shooting problem sees it: units of v_f and g.
struct Sample {
  double tau, time, theta, eta, n;
  double excess;  ///< λθ/(λv v) − μ
};

std::vector<Sample> samples_of(const ScaledScene& scene, const Transcribed& motion) {
  std::vector<Sample> samples;
  const double final_log_v = motion.nodes.back().log_v, speed = std::exp(final_log_v);
  for (const TranscribedNode& node : motion.nodes) {
    samples.push_back({node.tau, node.time / speed, node.theta, node.eta,
                       node.along / speed * std::exp(2.0 * (final_log_v - node.log_v)), node.turn / node.along - scene.mu});
  }
  // Beside a flight the barrier still holds η down; λθ says better what it is.
  for (std::size_t i = 0; i + 3 < samples.size(); ++i) {
    if (samples[i].excess > 0.0) samples[i].eta = std::sqrt(samples[i].excess / (-3.0 * scene.beta));
  }
  // At the end itself the quotient is 0/0, and the transcription keeps η constant over the last cell: it goes on as it did before.
  const std::size_t last = samples.size() - 1;
  Sample &end = samples[last], &before = samples[last - 1];
  const Sample& earlier = samples[last - 2];
  end.excess = before.excess;
  if (before.excess > 0.0 && earlier.excess > 0.0) {
    const double length = end.tau - before.tau;
    const double more = length * (before.eta - earlier.eta) / (before.tau - earlier.tau);
    end.eta = std::max(0.5 * before.eta, before.eta + more);
    end.theta += 0.5 * more * length;
  }
  return samples;
}

/// The sample at which the excess vanishes between two of different sign.
Sample junction(const Sample& a, const Sample& b) {
  const double part = a.excess / (a.excess - b.excess);
  const auto between = [&](double from, double to) { return std::lerp(from, to, part); };
  return {between(a.tau, b.tau), between(a.time, b.time), between(a.theta, b.theta), 0.0, between(a.n, b.n), 0.0};
}

/// Largest rate in ω at which backward integration amplifies a disturbance of (θ, η, n).
double growth_rate(const Field& field, const Eigen::VectorXd& constants, double theta, double eta, double n) {
  Eigen::MatrixXd whole(4, 4);
  if (!field.jacobian(0.0, Eigen::Vector4d(0.0, theta, eta, n), constants, whole)) return 0.0;
  return std::max(0.0, -whole.bottomRightCorner<3, 3>().eval().eigenvalues().real().minCoeff());
}

/// Plans a contact arc from its samples in order of time.
ArcPlan contact_plan(const std::vector<Sample>& samples, const Eigen::VectorXd& constants, double growth) {
  static const FieldOf<ContactArc> field;
  ArcPlan arc{ArcKind::contact, 0.0, {}};
  // η² is nearly linear where the arc meets a flight, and dω = dτ/η.
  const auto stretch = [&](std::size_t i) {
    return 2.0 * (samples[i].tau - samples[i - 1].tau) / std::max(1e-12, samples[i].eta + samples[i - 1].eta);
  };
  for (std::size_t i = 1; i < samples.size(); ++i) arc.length += stretch(i);
  double from_end = 0.0, amplified = 0.0;
  for (std::size_t i = samples.size() - 1; i > 1; --i) {
    from_end += stretch(i);
    const Sample& at = samples[i - 1];
    if (at.n <= 0.0 || at.eta <= 0.0) continue;
    amplified += stretch(i) * growth_rate(field, constants, at.theta, at.eta, at.n);
    if (amplified < std::log(growth)) continue;
    arc.nodes.push_back({from_end / arc.length, at.theta, at.eta, at.n});
    amplified = 0.0;
  }
  return arc;
}

}  // namespace

Plan make_plan(const ScaledScene& scene, const Transcribed& motion, double growth) {
  const std::vector<Sample> samples = samples_of(scene, motion);
  const double speed = std::exp(motion.nodes.back().log_v);
  const double lambda_x = motion.lambda_x * speed, lambda_y = motion.lambda_y * speed;
  const Eigen::Vector4d constants(lambda_x, lambda_y, scene.mu, scene.beta);
  Plan plan;
  std::vector<Sample> arc{samples.front()};
  const auto close = [&](bool in_contact) {
    if (in_contact) {
      plan.arcs.push_back(contact_plan(arc, constants, growth));
    } else {
      plan.arcs.push_back({ArcKind::ballistic, arc.back().time - arc.front().time, {}});
    }
  };
  for (std::size_t i = 1; i < samples.size(); ++i) {
    const bool before = samples[i - 1].excess > 0.0, after = samples[i].excess > 0.0;
    if (before != after) {
      const Sample at = junction(samples[i - 1], samples[i]);
      arc.push_back(at);
      close(before);
      arc.assign(1, at);
    }
    arc.push_back(samples[i]);
  }
  close(samples.back().excess > 0.0);
  const Sample& end = samples.back();
  const double cosine = std::cos(end.theta), sine = std::sin(end.theta);
  plan.theta_start = samples.front().theta;
  plan.theta_end = end.theta;
  plan.log_speed_ratio = motion.nodes.back().log_v;
  plan.eta_end = end.eta;
  plan.slope_end = (lambda_y * cosine - lambda_x * sine) / (lambda_x * cosine + lambda_y * sine);
  return plan;
}

Plan with_new_nodes(Plan plan, const Shot& shot, double growth) {
  constexpr int cells = 50;  // of a segment
  for (ArcPlan& arc : plan.arcs) arc.nodes.clear();
  std::vector<double> amplified(plan.arcs.size(), 0.0);
  for (const ArcRecord& record : shot.arcs()) {  // from the end of the motion to its start
    const auto i = static_cast<std::size_t>(record.arc);
    ArcPlan& arc = plan.arcs.at(i);
    if (arc.kind != ArcKind::contact || record.state.size() != ContactArc::states) continue;
    const Trajectory path =
        Flow(*record.field).record(record.t0, record.t1, record.state, record.quadrature, record.parameter);
    for (int j = 1; j <= cells; ++j) {
      const double omega = std::lerp(record.t0, record.t1, static_cast<double>(j) / cells);
      const Eigen::VectorXd at = path.at(omega);
      amplified[i] += std::abs(record.t1 - record.t0) / cells *
                      growth_rate(*record.field, record.parameter, at[1], at[2], at[3]);
      if (amplified[i] < std::log(growth) || -omega >= arc.length) continue;
      arc.nodes.push_back({-omega / arc.length, at[1], at[2], at[3]});
      amplified[i] = 0.0;
    }
  }
  return plan;
}

}  // namespace costate::curvature
