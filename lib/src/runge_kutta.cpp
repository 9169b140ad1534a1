/// Verner's Runge–Kutta pair 8(7) as an integrator.
#include "integrator.hpp"
#include "runge_kutta_step.hpp"

#include <costate/error.hpp>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>

namespace costate {

namespace {

constexpr double epsilon = std::numeric_limits<double>::epsilon();
constexpr double exponent = 1.0 / verner::order;
constexpr double safety = 0.9;                         // of the step that would just pass
constexpr double least_factor = 0.2, most_factor = 6;  // from one step to the next
constexpr double retreat = 0.25;                       // after a right-hand side that is not finite
constexpr int most_retreats = 10;                      // in a row
// The step is stretched by a tenth to reach the end: the error grows by (1.1)⁸ = 2.1, and safety⁻⁸ = 2.3 are in hand.
constexpr double stretch = 1.1;
static_assert(safety * stretch < 1.0, "a stretched step that is refused must not be stretched to the same again");
constexpr double samples = 8.0;  // the parts of a step between which the right-hand side is evaluated
constexpr int stiff_steps = 15;  // in a row that stability has limited
// Stages are summed with coefficients of about this size.
constexpr double amplification = 32.0;

/// From values and slopes (times length) at −1, −⅔, −⅓ of a step, the end's being 0, to the powers 2 … 7 of the polynomial through them.
Eigen::Matrix<double, 6, 6> make_hermite() {
  Eigen::Matrix<long double, 6, 6> conditions;
  for (int node = 0; node < 3; ++node) {
    const long double s = -1.0L + static_cast<long double>(node) / 3.0L;
    for (int power = 2; power <= 7; ++power) {
      conditions(node, power - 2) = std::pow(s, power);
      conditions(3 + node, power - 2) = power * std::pow(s, power - 1);
    }
  }
  return Eigen::Matrix<long double, 6, 6>(conditions.fullPivLu().inverse()).cast<double>();
}

class RungeKutta final : public Integrator {
 public:
  RungeKutta(const Field& field, int directions)
      : field_(field),
        directions_(directions),
        columns_(static_cast<std::size_t>(1 + directions + directions % 2)),
        step_(make_runge_kutta_step(field, static_cast<int>(columns_) - 1)),
        parameter_(static_cast<std::size_t>(field.parameters()) * columns_) {
    step_->set_parameter(parameter_);
  }

  [[nodiscard]] Method method() const override { return Method::runge_kutta; }
  [[nodiscard]] int directions() const override { return directions_; }

  void advance(const InitialValue& start, const FlowOptions& options, std::span<double> end,
               Statistics& statistics) override {
    begin(start, options);
    integrate(
        start, options, statistics, [](double, double) { return true; }, false);
    repack(step_->state(), columns_, end, given_columns());
  }

  void record(const InitialValue& start, const Eigen::VectorXd& w0, const FlowOptions& options, Trajectory& trajectory,
              Statistics& statistics) override {
    begin(start, options);
    if (!inner_) inner_ = make_runge_kutta_step(field_, 0);
    inner_->set_parameter(parameter_);
    const long before = inner_->evaluations();
    const auto keep = [&](double t, double h) {
      Eigen::MatrixXd taylor(field_.states() + field_.quadratures(), 8);
      if (!interpolate(t, h, taylor)) return false;
      taylor.col(0).tail(w0.size()) += w0;
      trajectory.append({h == start.t1 - t ? start.t1 : t + h, std::move(taylor)});
      return true;
    };
    const auto count_inner = [&] { statistics.rhs_evaluations += inner_->evaluations() - before; };
    try {
      integrate(start, options, statistics, keep, true);
    } catch (...) {
      count_inner();
      throw;
    }
    count_inner();
  }

 private:
  [[nodiscard]] std::size_t given_columns() const { return static_cast<std::size_t>(1 + directions_); }

  /// Copies rows of numbers; columns that only the target has stay as they are.
  static void repack(std::span<const double> from, std::size_t from_columns, std::span<double> to, std::size_t to_columns) {
    if (from_columns == to_columns) {
      std::copy_n(from.begin(), std::min(from.size(), to.size()), to.begin());
      return;
    }
    const std::size_t columns = std::min(from_columns, to_columns);
    for (std::size_t i = 0, j = 0; i < from.size() && j < to.size(); i += from_columns, j += to_columns) {
      for (std::size_t c = 0; c < columns; ++c) to[j + c] = from[i + c];
    }
  }

  void begin(const InitialValue& start, const FlowOptions& options) {
    repack(start.parameter, given_columns(), parameter_, columns_);
    const auto y = step_->state();
    std::fill(y.begin(), y.end(), 0.0);
    repack(start.state, given_columns(), y, columns_);
    scale_ = {options.tolerance.relative, amplification * epsilon};
    // A direction of size |s₀| carries an error |s₀| times that of a unit direction: its absolute tolerance follows.
    const auto absolute = step_->absolute();
    for (std::size_t j = 0; j < columns_; ++j) {
      double size = 1.0;
      for (std::size_t i = j; j > 0 && i < y.size(); i += columns_) size = std::max(size, std::abs(y[i]));
      for (std::size_t i = j; j > 0 && i < parameter_.size(); i += columns_) size = std::max(size, std::abs(parameter_[i]));
      for (std::size_t i = j; i < absolute.size(); i += columns_) absolute[i] = options.tolerance.absolute * size;
    }
    reason_.clear();
    taken_ = rejected_ = 0;
    evaluated_ = step_->evaluations();
  }

  /// Runs an evaluation of the field: false where it is no finite number, and why is kept.
  template <class Body>
  bool finite(Body&& body) {
    try {
      return body();
    } catch (const LeftDomain& failure) {
      reason_ = failure.what();
      return false;
    }
  }

  /// Steps from t0 to t1. Before a step of length h from t is accepted it is shown to `keep(t, h)`, which is false where the step is to be
  /// tried again shorter; `dense`: the rates at t1 are known then, too.
  template <class Keep>
  void integrate(const InitialValue& start, const FlowOptions& options, Statistics& statistics, const Keep& keep,
                 bool dense) {
    double t = start.t0;
    const double length = std::abs(start.t1 - t);
    const double longest = options.longest_step > 0.0 ? std::min(1.0, samples * options.longest_step) * length : length;
    if (!finite([&] { return step_->evaluate_start(t); })) stop(t, not_finite(), statistics);
    check_tolerance(t, options.tolerance, statistics);
    double size = first_step(t, start.t1, options.tolerance);
    bool warm = false;  // is the next integration's first step known?
    double most = most_factor;
    int retreats = 0, stiff = 0;
    while (t != start.t1) {
      if (taken_ + rejected_ >= options.max_steps) exhaust(t, "the step limit is exhausted", statistics);
      const double h = fitted(std::min(size, longest), start.t1 - t);
      const bool last = h == start.t1 - t;
      const double next = last ? start.t1 : t + h;
      double error = std::numeric_limits<double>::quiet_NaN();
      const bool good = finite([&] {
        step_->take(t, h);
        error = step_->error(h, scale_);
        if (!std::isfinite(error)) return false;
        return error > 1.0 || (((last && !dense) || step_->evaluate_end(next)) && keep(t, h));
      });
      const double factor = std::clamp(safety * std::pow(error, -exponent), least_factor, most);
      if (good && error <= 1.0) {
        size = std::abs(h) * factor;
        if (!warm) remember(size, options.tolerance);
        warm = true;
        stiff = stability_limits(h, start.t1 - next, options) ? stiff + 1 : 0;
        if (stiff == stiff_steps) exhaust(t, "the arc is stiff: the step limit would be exhausted", statistics);
        t = next;
        ++taken_;
        step_->accept();
        check_tolerance(t, options.tolerance, statistics);
        most = most_factor;
        retreats = 0;
        continue;
      }
      ++rejected_;
      retreats = good ? 0 : retreats + 1;
      size = std::abs(h) * (good ? factor : retreat);
      most = 1.0;
      if (size < 4.0 * epsilon * std::max(std::abs(t), std::abs(start.t1)) || retreats == most_retreats) {
        stop(t, good ? "the step size is exhausted" : not_finite(), statistics);
      }
    }
    count(statistics);
  }

  /// The step to take where `size` is wanted and `remaining` is left: no tiny one is left for the end.
  [[nodiscard]] static double fitted(double size, double remaining) {
    if (std::abs(remaining) <= stretch * size) return remaining;
    if (std::abs(remaining) <= 2.0 * size) return 0.5 * remaining;
    return std::copysign(size, remaining);
  }

  /// The first step of the last integration, or else one guessed from the sizes of y' and y''.
  [[nodiscard]] double first_step(double t0, double t1, const Tolerance& tolerance) {
    if (first_step_ > 0.0)
      return first_step_ * std::pow((tolerance.relative + tolerance.absolute) / first_tolerance_, exponent);
    const double length = std::abs(t1 - t0);
    const auto start = step_->sizes(scale_);
    const double probe = std::copysign(
        0.01 * (start.state > 0.0 && start.rate > 0.0 ? std::min(length, start.state / start.rate) : length), t1 - t0);
    step_->take_euler(probe);
    if (!finite([&] { return step_->evaluate_end(t0 + probe); })) return std::abs(probe);
    const auto moved = step_->sizes(scale_);
    // The j-th derivative is as large as y' ρ^(j−1) if nothing else is known, and a step's error what its seventh order leaves over.
    const double rho = moved.change / (moved.rate * std::abs(probe));
    if (!(rho > 0.0) || !std::isfinite(rho)) return moved.change > 0.0 ? 0.1 * length : length;
    constexpr double one_over_factorial = 1.0 / 40320.0;
    return 0.7 / rho * std::pow(one_over_factorial * moved.rate / rho, -exponent);
  }
  void remember(double size, const Tolerance& tolerance) {
    first_step_ = size;
    first_tolerance_ = tolerance.relative + tolerance.absolute;
  }

  /// Would the steps to come be too many, and is it stability that keeps them short?
  [[nodiscard]] bool stability_limits(double h, double remaining, const FlowOptions& options) const {
    const double to_come = std::abs(remaining / h);
    return to_come > static_cast<double>(options.max_steps - taken_ - rejected_) &&
           step_->stiffness(h) > 0.8 * verner::real_stability;
  }

  // A relative tolerance above the rounding error is never too small.
  void check_tolerance(double t, const Tolerance& tolerance, Statistics& statistics) {
    if (tolerance.relative >= epsilon) return;
    const double size = step_->sizes(scale_).state;
    if (!(size * epsilon <= 1.0)) stop(t, "the tolerance is below what double precision can hold", statistics);
  }

  /// The polynomial of degree 7 that has values and slopes of the step at four equidistant points, as powers of the time from its end.
  bool interpolate(double t, double h, Eigen::MatrixXd& taylor) {
    static const Eigen::Matrix<double, 6, 6> hermite = make_hermite();
    using Vector = Eigen::Map<const Eigen::VectorXd>;
    const auto view = [](std::span<const double> s) { return Vector(s.data(), static_cast<Eigen::Index>(s.size())); };
    taylor.col(0) = view(step_->end());
    taylor.col(1) = h * view(step_->end_rate());
    Eigen::MatrixXd data(taylor.rows(), 6);
    std::copy(step_->state().begin(), step_->state().end(), inner_->state().begin());
    std::copy(step_->rate().begin(), step_->rate().end(), inner_->rate().begin());
    for (int node = 0; node < 3; ++node) {
      const double s = -1.0 + node / 3.0, inner_t = t + node * h / 3.0;
      if (node > 0) {
        inner_->take(inner_t - h / 3.0, h / 3.0);
        if (!inner_->evaluate_end(inner_t)) return false;
        inner_->accept();
      }
      data.col(node) = view(inner_->state()) - taylor.col(0) - s * taylor.col(1);
      data.col(3 + node) = h * view(inner_->rate()) - taylor.col(1);
    }
    taylor.rightCols(6).noalias() = data * hermite.transpose();
    double power = 1.0;
    for (Eigen::Index j = 1; j < taylor.cols(); ++j) {
      power *= h;
      // What is left of so short a step is nothing.
      if (std::abs(power) < std::numeric_limits<double>::min()) {
        taylor.rightCols(taylor.cols() - j).setZero();
        break;
      }
      if (!std::isfinite(power)) return false;
      taylor.col(j) /= power;
    }
    return taylor.allFinite();
  }

  [[nodiscard]] std::string not_finite() const {
    return "the right-hand side is not finite" + (reason_.empty() ? "" : ": " + reason_);
  }
  [[noreturn]] void stop(double t, const std::string& reason, Statistics& statistics) {
    count(statistics);
    throw LeftDomain(fmt::format("integration stopped at t = {:.6g}: {}", t, reason));
  }
  [[noreturn]] void exhaust(double t, const std::string& reason, Statistics& statistics) {
    ++statistics.exhausted;
    stop(t, reason, statistics);
  }
  void count(Statistics& statistics) const {
    const long evaluations = step_->evaluations() - evaluated_;
    statistics += {.integrations = 1,
                   .steps = taken_,
                   .rhs_evaluations = evaluations,
                   .sensitivity_evaluations = directions_ > 0 ? evaluations : 0,
                   .error_test_failures = rejected_};
  }

  const Field& field_;
  int directions_;
  std::size_t columns_;  // of a number and its directions, to which an idle one is added if they are odd
  std::unique_ptr<RungeKuttaStep> step_, inner_;
  std::vector<double> parameter_;
  ErrorScale scale_;
  std::string reason_;
  long taken_ = 0, rejected_ = 0, evaluated_ = 0;
  double first_step_ = 0.0, first_tolerance_ = 0.0;  // of the last integration
};

}  // namespace

std::unique_ptr<Integrator> make_runge_kutta(const Field& field, int directions) {
  return std::make_unique<RungeKutta>(field, directions);
}

}  // namespace costate
