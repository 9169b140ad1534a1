/// \file
/// What integrates one field in one number of directions. Private to lib.
#pragma once

#include <costate/flow.hpp>

namespace costate {

/// An initial value problem. Numbers are followed by their derivatives, see Field::variation.
struct InitialValue {
  double t0 = 0.0, t1 = 0.0;
  std::span<const double> state;      ///< z₀
  std::span<const double> parameter;  ///< p
};

class Integrator {
 public:
  Integrator() = default;
  Integrator(const Integrator&) = delete;
  Integrator& operator=(const Integrator&) = delete;
  virtual ~Integrator() = default;

  [[nodiscard]] virtual Method method() const = 0;
  [[nodiscard]] virtual int directions() const = 0;
  /// From t0 to t1 ≠ t0, quadratures from 0: `end` becomes (z₁, w₁). \throws LeftDomain
  virtual void advance(const InitialValue& start, const FlowOptions& options, std::span<double> end,
                       Statistics& statistics) = 0;
  /// The same without directions, keeping dense output; w starts at w0. Pieces are appended to the trajectory. \throws LeftDomain
  virtual void record(const InitialValue& start, const Eigen::VectorXd& w0, const FlowOptions& options,
                      Trajectory& trajectory, Statistics& statistics) = 0;
};

/// Adams–Moulton or BDF by CVODES.
[[nodiscard]] std::unique_ptr<Integrator> make_cvodes(const Field& field, Method method, int directions);

/// A one-step method: Verner's Runge–Kutta pair of orders 8 and 7.
[[nodiscard]] std::unique_ptr<Integrator> make_runge_kutta(const Field& field, int directions);

}  // namespace costate
