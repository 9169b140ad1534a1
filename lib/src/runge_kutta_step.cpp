/// Steps of the Runge–Kutta pair, compiled for each size.
#include "runge_kutta_step.hpp"

#include <algorithm>
#include <utility>

namespace costate {

namespace {

constexpr std::size_t any_size = 0;
/// The sizes compiled are the multiples of `granularity` up to the largest.
constexpr std::size_t granularity = 4, largest_compiled = 40;

/// The stages that have no weight in the error.
constexpr verner::Row others = [] {
  verner::Row row{};
  for (std::size_t s = 0; s < verner::stages; ++s) row[s] = verner::errors[s] == 0.0 ? 1.0 : 0.0;
  return row;
}();

/// Which combination of stages: one of the matrix's rows, or one of these.
constexpr std::size_t result = verner::stages, estimate = result + 1, unweighted = estimate + 1;
constexpr verner::Row coefficients(std::size_t row) {
  switch (row) {
    case result: return verner::weights;
    case estimate: return verner::errors;
    case unweighted: return others;
    default: return verner::matrix[row];
  }
}

template <std::size_t size>
class SizedStep final : public RungeKuttaStep {
 public:
  SizedStep(const Field& field, int directions) : RungeKuttaStep(field, directions) {
    if constexpr (size == any_size) {
      for (Row* row : {&y_, &stage_, &end_, &end_rate_, &absolute_, &squares_}) row->resize(entries());
      for (Row& row : k_) row.resize(entries());
    }
    // Entries beyond the true number are divided too.
    std::fill(absolute_.begin(), absolute_.end(), 1.0);
  }

  std::span<double> state() override { return {y_.data(), entries()}; }
  std::span<double> rate() override { return {k_[0].data(), entries()}; }
  std::span<const double> end() const override { return {end_.data(), entries()}; }
  std::span<const double> end_rate() const override { return {end_rate_.data(), entries()}; }
  std::span<double> absolute() override { return {absolute_.data(), entries()}; }

  bool evaluate_start(double t) override { return evaluate(t, y_.data(), k_[0].data()); }
  bool evaluate_end(double t) override { return evaluate(t, end_.data(), end_rate_.data()); }
  void take(double t, double h) override {
    stages_from<1>(t, h);
    for (std::size_t i = 0; i < count(); ++i) end_[i] = y_[i] + h * combined<result>(i);
  }
  void take_euler(double h) override {
    for (std::size_t i = 0; i < count(); ++i) end_[i] = y_[i] + h * k_[0][i];
  }
  void accept() override {
    y_ = end_;
    k_[0] = end_rate_;
  }

  double error(double h, const ErrorScale& scale) override {
    for (std::size_t i = 0; i < count(); ++i) {
      // A product with zero is zero, or not a number.
      const double sum = combined<estimate>(i) + 0.0 * combined<unweighted>(i);
      const double allowed = scale.relative * std::abs(y_[i]) + absolute_[i] + scale.rounding * std::abs(h * k_[0][i]);
      squares_[i] = h * sum / allowed * (h * sum / allowed);
    }
    return norm(squares_.data());
  }

  Sizes sizes(const ErrorScale& scale) override {
    const auto measure = [&](auto value) {
      for (std::size_t i = 0; i < count(); ++i) {
        const double weighted = value(i) / (scale.relative * std::abs(y_[i]) + absolute_[i]);
        squares_[i] = weighted * weighted;
      }
      return norm(squares_.data());
    };
    return {measure([&](std::size_t i) { return y_[i]; }), measure([&](std::size_t i) { return k_[0][i]; }),
            measure([&](std::size_t i) { return end_rate_[i] - k_[0][i]; })};
  }

  double stiffness(double h) const override {
    double rates = 0.0, states = 0.0;
    for (std::size_t i = 0; i < count(); ++i) {
      constexpr std::size_t last = verner::stages - 1;
      const double rate = k_[last][i] - k_[last - 1][i];
      const double state = combined<last>(i) - combined<last - 1>(i);
      rates += rate * rate;
      states += h * state * (h * state);
    }
    return states > 0.0 ? std::abs(h) * std::sqrt(rates / states) : 0.0;
  }

 private:
  using Row = std::conditional_t<size == any_size, std::vector<double>, std::array<double, size>>;

  [[nodiscard]] constexpr std::size_t count() const { return size == any_size ? entries() : size; }

  /// Σ coefficients[s] k[s] of entry i, over those that are not zero.
  template <std::size_t row>
  [[nodiscard]] double combined(std::size_t i) const {
    return [&]<std::size_t... s>(std::index_sequence<s...>) {
      double sum = 0.0;
      const auto add = [&]<std::size_t stage>() {
        constexpr double coefficient = coefficients(row)[stage];
        if constexpr (coefficient != 0.0) sum += coefficient * k_[stage][i];
      };
      (add.template operator()<s>(), ...);
      return sum;
    }
    (std::make_index_sequence<verner::stages>());
  }

  template <std::size_t stage>
  void stages_from(double t, double h) {
    if constexpr (stage < verner::stages) {
      for (std::size_t i = 0; i < count(); ++i) stage_[i] = y_[i] + h * combined<stage>(i);
      evaluate_stage(t + verner::nodes[stage] * h, stage_.data(), k_[stage].data());
      stages_from<stage + 1>(t, h);
    }
  }

  Row y_{}, stage_{}, end_{}, end_rate_{}, absolute_{}, squares_{};
  std::array<Row, verner::stages> k_{};
};

template <std::size_t size>
std::unique_ptr<RungeKuttaStep> of_size(const Field& field, int directions, std::size_t entries) {
  if constexpr (size > largest_compiled) {
    return std::make_unique<SizedStep<any_size>>(field, directions);
  } else {
    if (entries <= size) return std::make_unique<SizedStep<size>>(field, directions);
    return of_size<size + granularity>(field, directions, entries);
  }
}

}  // namespace

std::unique_ptr<RungeKuttaStep> make_runge_kutta_step(const Field& field, int directions) {
  const int entries = (field.states() + field.quadratures()) * (1 + directions);
  return of_size<granularity>(field, directions, static_cast<std::size_t>(entries));
}

}  // namespace costate
