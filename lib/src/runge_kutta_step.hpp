/// \file
/// One step of the pair of runge_kutta_tableau.hpp, for a field and its variational equations. Private to lib.
///
/// The system is y = (z, w) with every number followed by its derivatives, as Field::variation has it. Its loops run over a fixed
/// number of entries, the true number rounded up, so that the compiler unrolls them; entries beyond the true number stay zero.
#pragma once

#include "runge_kutta_tableau.hpp"

#include <costate/field.hpp>

#include <array>
#include <cmath>
#include <memory>
#include <span>
#include <vector>

namespace costate {

/// What a step must keep its error below, entry by entry: relative·|yᵢ| + absoluteᵢ + rounding·|h yᵢ'|.
struct ErrorScale {
  double relative = 0.0;
  double rounding = 0.0;
};

class RungeKuttaStep {
 public:
  RungeKuttaStep(const Field& field, int directions)
      : field_(field),
        columns_(1 + directions),
        states_(static_cast<std::size_t>(field.states() * columns_)),
        entries_(static_cast<std::size_t>((field.states() + field.quadratures()) * columns_)) {}
  RungeKuttaStep(const RungeKuttaStep&) = delete;
  RungeKuttaStep& operator=(const RungeKuttaStep&) = delete;
  virtual ~RungeKuttaStep() = default;

  /// Numbers and their derivatives together.
  [[nodiscard]] std::size_t entries() const { return entries_; }
  /// p, each number followed by its derivatives; must outlive the steps.
  void set_parameter(std::span<const double> parameter) { parameter_ = parameter; }
  [[nodiscard]] long evaluations() const { return evaluations_; }

  /// y at the start of the step.
  virtual std::span<double> state() = 0;
  /// y' there, as `evaluate_start` or the last accepted step left it.
  virtual std::span<double> rate() = 0;
  /// y at the end of the step, which `take` makes, and y' there, which `evaluate_end` does.
  virtual std::span<const double> end() const = 0;
  virtual std::span<const double> end_rate() const = 0;
  virtual std::span<double> absolute() = 0;

  // False where the right-hand side is no finite number.
  virtual bool evaluate_start(double t) = 0;
  virtual bool evaluate_end(double t) = 0;
  /// Makes the end. Where the right-hand side is no finite number at some stage, nor is the error.
  virtual void take(double t, double h) = 0;
  /// The end becomes the start.
  virtual void accept() = 0;

  /// Error of the step just taken: the largest of the root mean squares of the numbers and of each direction, 1 being what is allowed.
  [[nodiscard]] virtual double error(double h, const ErrorScale& scale) = 0;
  /// The same norm of y, of y', and of the change of y' from start to end.
  struct Sizes {
    double state, rate, change;
  };
  [[nodiscard]] virtual Sizes sizes(const ErrorScale& scale) = 0;
  /// The end by Euler's method.
  virtual void take_euler(double h) = 0;
  /// An estimate of h |λ| for the largest eigenvalue of f_z, from the last two stages of the step just taken: they differ only in y.
  [[nodiscard]] virtual double stiffness(double h) const = 0;

 protected:
  bool evaluate(double t, const double* y, double* rate) {
    ++evaluations_;
    return field_.variation(t, {y, states_}, parameter_, columns_ - 1, {rate, entries_});
  }
  void evaluate_stage(double t, const double* y, double* rate) {
    ++evaluations_;
    field_.unchecked_variation(t, {y, states_}, parameter_, columns_ - 1, {rate, entries_});
  }
  /// Largest root mean square of a column; squares are as entries are.
  [[nodiscard]] double norm(const double* squares) const {
    const auto columns = static_cast<std::size_t>(columns_);
    double largest = 0.0;
    for (std::size_t j = 0; j < columns; ++j) {
      double sum = 0.0;
      for (std::size_t i = j; i < entries_; i += columns) sum += squares[i];
      // What is not a number must not be lost.
      if (sum > largest || std::isnan(sum)) largest = sum;
    }
    return std::sqrt(largest * static_cast<double>(columns) / static_cast<double>(entries_));
  }

 private:
  const Field& field_;
  int columns_;
  std::size_t states_, entries_;
  std::span<const double> parameter_;
  long evaluations_ = 0;
};

/// Steps for a field in a number of directions, compiled for their size if that is not too large.
[[nodiscard]] std::unique_ptr<RungeKuttaStep> make_runge_kutta_step(const Field& field, int directions);

}  // namespace costate
