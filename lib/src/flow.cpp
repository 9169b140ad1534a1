#include "integrator.hpp"

#include <costate/error.hpp>
#include <costate/flow.hpp>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace costate {

Statistics& Statistics::operator+=(const Statistics& other) {
  integrations += other.integrations;
  steps += other.steps;
  rhs_evaluations += other.rhs_evaluations;
  sensitivity_evaluations += other.sensitivity_evaluations;
  error_test_failures += other.error_test_failures;
  exhausted += other.exhausted;
  return *this;
}

Statistics& Statistics::operator-=(const Statistics& other) {
  integrations -= other.integrations;
  steps -= other.steps;
  rhs_evaluations -= other.rhs_evaluations;
  sensitivity_evaluations -= other.sensitivity_evaluations;
  error_test_failures -= other.error_test_failures;
  exhausted -= other.exhausted;
  return *this;
}

namespace {

void check(const FlowOptions& options) {
  const auto admit = [](bool good, const char* name, double value, const char* range) {
    if (!good) throw BadInput(fmt::format("{} = {:g} is not admissible: {}", name, value, range));
  };
  const Tolerance& tolerance = options.tolerance;
  admit(tolerance.relative >= 0.0 && std::isfinite(tolerance.relative), "tolerance.relative", tolerance.relative,
        "a finite number, 0 or more");
  admit(tolerance.absolute > 0.0 && std::isfinite(tolerance.absolute), "tolerance.absolute", tolerance.absolute,
        "a positive number");
  admit(options.max_steps >= 1, "max_steps", static_cast<double>(options.max_steps), "1 or more");
  admit(options.longest_step >= 0.0 && std::isfinite(options.longest_step), "longest_step", options.longest_step,
        "a finite number, 0 or more");
}

void check_size(std::size_t size, int count, int directions, const char* what) {
  const auto wanted = static_cast<std::size_t>(count) * static_cast<std::size_t>(1 + directions);
  if (size != wanted) {
    throw BadInput(fmt::format("an arc of {} {} in {} directions is given {} numbers for them, not {}", count, what,
                               directions, size, wanted));
  }
}

}  // namespace

Flow::Flow(const Field& field, FlowOptions options) : field_(&field), options_(options) { check(options); }
Flow::~Flow() = default;
Flow::Flow(Flow&&) noexcept = default;
Flow& Flow::operator=(Flow&&) noexcept = default;

void Flow::set_options(const FlowOptions& options) {
  check(options);
  options_ = options;
}

Integrator& Flow::integrator(int directions) {
  const auto found = std::find_if(integrators_.begin(), integrators_.end(), [&](const auto& integrator) {
    return integrator->directions() == directions && integrator->method() == options_.method;
  });
  if (found != integrators_.end()) return **found;
  return *integrators_.emplace_back(options_.method == Method::runge_kutta
                                        ? make_runge_kutta(*field_, directions)
                                        : make_cvodes(*field_, options_.method, directions));
}

std::span<const double> Flow::advance(double t0, double t1, std::span<const double> z0, std::span<const double> p, int d) {
  check_size(z0.size(), field_->states(), d, "states");
  check_size(p.size(), field_->parameters(), d, "parameters");
  lifted_end_.resize(static_cast<std::size_t>((field_->states() + field_->quadratures()) * (1 + d)));
  if (t0 == t1) {
    std::fill(std::copy(z0.begin(), z0.end(), lifted_end_.begin()), lifted_end_.end(), 0.0);
  } else {
    integrator(d).advance({t0, t1, z0, p}, options_, lifted_end_, statistics_);
  }
  return lifted_end_;
}

namespace {

/// Rows of a number and its derivatives.
using Lifted = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

Lifted lifted(const Eigen::VectorXd& values, const Eigen::MatrixXd& directions) {
  Lifted rows(values.size(), 1 + directions.cols());
  rows << values, directions;
  return rows;
}

std::span<const double> numbers(const Lifted& rows) { return {rows.data(), static_cast<std::size_t>(rows.size())}; }
std::span<const double> numbers(const Eigen::VectorXd& v) { return {v.data(), static_cast<std::size_t>(v.size())}; }

}  // namespace

const FlowEnd& Flow::run(double t0, double t1, const Eigen::VectorXd& z0, const Eigen::VectorXd& p,
                         const Directions& directions) {
  const Eigen::Index n = field_->states(), k = field_->quadratures(), d = directions.count();
  const auto reached = advance(t0, t1, numbers(lifted(z0, directions.state)), numbers(lifted(p, directions.parameter)),
                               static_cast<int>(d));
  const Eigen::Map<const Lifted> rows(reached.data(), n + k, 1 + d);
  end_.state = rows.col(0).head(n);
  end_.quadrature = rows.col(0).tail(k);
  end_.state_directions = rows.topRightCorner(n, d);
  end_.quadrature_directions = rows.bottomRightCorner(k, d);
  end_.state_rate.resize(n);
  end_.quadrature_rate.resize(k);
  if (!field_->rates(t1, end_.state, p, end_.state_rate, end_.quadrature_rate)) {
    throw LeftDomain(fmt::format("the right-hand side is not finite at t = {:.6g}", t1));
  }
  return end_;
}

Trajectory Flow::record(double t0, double t1, const Eigen::VectorXd& z0, const Eigen::VectorXd& w0,
                        const Eigen::VectorXd& p) {
  Eigen::VectorXd start(z0.size() + w0.size());
  start << z0, w0;
  check_size(numbers(z0).size(), field_->states(), 0, "states");
  check_size(numbers(p).size(), field_->parameters(), 0, "parameters");
  check_size(numbers(w0).size(), field_->quadratures(), 0, "quadratures");
  Trajectory trajectory(t0, std::move(start));
  if (t0 != t1) integrator(0).record({t0, t1, numbers(z0), numbers(p)}, w0, options_, trajectory, statistics_);
  return trajectory;
}

}  // namespace costate
