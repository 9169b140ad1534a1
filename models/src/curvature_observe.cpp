/// What can be seen of a solution with curvature-coupled friction: trajectory columns and path checks.
#include "curvature_problem.hpp"

namespace costate::curvature {

namespace {

/// The problem's constants of motion, as given to Shot::complete.
struct Motion {
  double lambda_x, lambda_y, mu, beta, speed;
  explicit Motion(const ArcRecord& record)
      : lambda_x(record.constants[0]),
        lambda_y(record.constants[1]),
        mu(record.constants[2]),
        beta(record.constants[3]),
        speed(record.constants[4]) {}
};

}  // namespace

std::vector<Column> CurvatureProblem::columns() const {
  return {{"x", "m"},     {"y", "m"},          {"v", "m/s"},        {"theta", "rad"},      {"u", "rad/s"},
          {"h", "m/s^2"}, {"lambda_x", "s/m"}, {"lambda_y", "s/m"}, {"lambda_v", "s^2/m"}, {"lambda_theta", "s/rad"}};
}

std::vector<double> CurvatureProblem::observe(const ArcPoint& point, const std::vector<double>& p) const {
  const Motion motion(*point.record);
  const Observed at = observed(point);
  const double g = p[gravity_place], V = motion.speed, time = V / g;
  return {point.quadrature[0] * V * time,
          point.quadrature[1] * V * time,
          at.v * V,
          at.theta,
          (at.eta - std::cos(at.theta)) / (at.v * time),
          at.eta * g,
          motion.lambda_x / V,
          motion.lambda_y / V,
          at.lambda_v / g,
          at.lambda_theta * time};
}

std::vector<PathCheck> CurvatureProblem::check(const ArcPoint& point, const std::vector<double>&) const {
  const Observed at = observed(point);
  // λv > 0 makes H concave in h: with it H_u = 0 (contact), or H_h ≤ 0 at h = 0 (ballistic), is the maximum over all h ≥ 0.
  std::vector<PathCheck> checks{{"Hamiltonian over the size of its terms", PathCheck::Kind::zero, at.hamiltonian},
                                {"lambda_v (Legendre-Clebsch)", PathCheck::Kind::nonnegative, at.lambda_v * at.v}};
  if (arcs_[static_cast<std::size_t>(point.record->arc)].kind == ArcKind::contact) {
    checks.push_back({"normal force on a contact arc", PathCheck::Kind::nonnegative, at.eta});
  } else {
    checks.push_back({"mu lambda_v v - lambda_theta on a ballistic arc", PathCheck::Kind::nonnegative,
                      Motion(*point.record).mu * at.lambda_v * at.v - at.lambda_theta});
  }
  return checks;
}

Observed CurvatureProblem::observed(const ArcPoint& point) const {
  const ArcRecord& record = *point.record;
  const Motion motion(record);
  Observed at{};
  if (record.field == &ballistic_) {
    const double elapsed = point.quadrature[2] - record.quadrature[2];
    const Eigen::VectorXd& p = record.parameter;
    const double v_x = p[0], v_y = p[1] - elapsed, to_x = p[5] - p[3] * elapsed, to_y = p[6] - p[4] * elapsed;
    at.v = std::hypot(v_x, v_y);
    at.theta = p[2] + std::atan2(v_x * (v_y - p[1]), v_x * v_x + v_y * p[1]);
    at.lambda_v = (to_x * v_x + to_y * v_y) / at.v;
    at.lambda_theta = to_y * v_x - to_x * v_y;
  } else {
    const bool series = record.field == &end_;
    const Eigen::VectorXd z = series ? point.quadrature.tail(4) : point.state;
    at.v = std::exp(z[0]);
    at.theta = z[1];
    at.eta = z[2];
    at.lambda_v = z[3] * at.v;
    at.lambda_theta = -at.lambda_v * at.v * (3.0 * motion.beta * at.eta * at.eta - motion.mu);
  }
  const double cosine = std::cos(at.theta), sine = std::sin(at.theta);
  const double k = at.eta * (motion.beta * at.eta * at.eta - motion.mu);
  // Of the size of its terms: near the start of a fast bead they are large and cancel.
  const double along = at.v * (motion.lambda_x * cosine + motion.lambda_y * sine), push = at.lambda_v * (k - sine);
  const double turn = at.lambda_theta * (at.eta - cosine) / at.v;
  at.hamiltonian = (along + push + turn - 1.0) / (1.0 + std::abs(along) + std::abs(push) + std::abs(turn));
  return at;
}

}  // namespace costate::curvature
