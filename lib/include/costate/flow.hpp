/// \file
/// The flow of one arc: initial state → end state, with exact sensitivities in the directions asked for.
///
/// The sensitivities are solutions of the variational equations s' = f_z s + f_p σ, integrated together with the state under
/// error control of their own, by CVODES (Hindmarsh et al., ACM TOMS 31 (2005) 363–396; Serban & Hindmarsh, 2005) or by a
/// Runge–Kutta method.
#pragma once

#include <costate/field.hpp>
#include <costate/trajectory.hpp>

#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace costate {

/// Error control of an integration: the local error per step in component i is kept below relative·|zᵢ| + absolute.
struct Tolerance {
  double relative = 1e-10;
  double absolute = 1e-12;
  bool operator==(const Tolerance&) const = default;
};

/// A linear multistep method of CVODES: Adams–Moulton, orders 1–12 with fixed-point iteration (non-stiff), or BDF, orders 1–5 with
/// Newton's method and the exact Jacobian (stiff). Or a one-step method: the Runge–Kutta pair of orders 8 and 7 by J. H. Verner
/// (Numer. Algorithms 53 (2010) 383–396; 13 stages), which costs least where the field is smooth and not stiff.
enum class Method { adams, bdf, runge_kutta };

/// How CVODES integrates the variational equations. All three keep the state and each direction under the same error control: the
/// largest of their weighted root mean square norms.
enum class Sensitivities {
  augmented,     ///< state and directions are one system, corrected together; its Newton matrix is that of the state alone
  simultaneous,  ///< CVODES' forward sensitivities, corrected together with the state (Maly & Petzold, 1996)
  staggered      ///< CVODES' forward sensitivities, corrected after the state (Feehery, Tolsma & Barton, 1997)
};

struct FlowOptions {
  Tolerance tolerance;
  Method method = Method::adams;
  long max_steps = 20000;  ///< per arc; exceeding it is LeftDomain
  /// Longest step, as a share of the arc; 0: any. Error control knows of a right-hand side what it samples: a step across a short load
  /// sees nothing of it. A step of the Runge–Kutta method samples it at ten places and may be eight times as long.
  double longest_step = 0.0;
  /// None: augmented with Adams' method, simultaneous with BDF. Augmented takes about half the time of the others with either.
  std::optional<Sensitivities> sensitivities = std::nullopt;
  bool operator==(const FlowOptions&) const = default;
};

/// What integrations have cost.
struct Statistics {
  long integrations = 0;
  long steps = 0;
  long rhs_evaluations = 0;          ///< of f
  long sensitivity_evaluations = 0;  ///< of all directions at once
  long error_test_failures = 0;
  long exhausted = 0;  ///< integrations that ended at max_steps
  Statistics& operator+=(const Statistics& other);
  Statistics& operator-=(const Statistics& other);
  friend Statistics operator-(Statistics a, const Statistics& b) { return a -= b; }
};

/// Where an arc ends.
struct FlowEnd {
  Eigen::VectorXd state;                  ///< z₁ (n)
  Eigen::VectorXd quadrature;             ///< w₁ − w₀ (k)
  Eigen::MatrixXd state_directions;       ///< ∂z₁ in the given directions (n × d)
  Eigen::MatrixXd quadrature_directions;  ///< ∂(w₁ − w₀) in the given directions (k × d)
  Eigen::VectorXd state_rate;             ///< f(t₁, z₁) = ∂z₁/∂t₁
  Eigen::VectorXd quadrature_rate;        ///< q(t₁, z₁)
};

/// A method for one field and one number of directions; private to lib.
class Integrator;

/// Integrates one Field over and over. Memory is allocated at the first use of a number of directions and reused after.
class Flow {
 public:
  /// The field must outlive the flow. \throws BadInput for an option out of range, as set_options does
  explicit Flow(const Field& field, FlowOptions options = {});
  ~Flow();
  Flow(Flow&&) noexcept;
  Flow& operator=(Flow&&) noexcept;

  void set_options(const FlowOptions& options);
  [[nodiscard]] const FlowOptions& options() const { return options_; }
  [[nodiscard]] const Field& field() const { return *field_; }
  [[nodiscard]] const Statistics& statistics() const { return statistics_; }

  /// From z(t0) = z0 to t1 (which may lie before t0), quadratures from 0. The reference is valid until the next call.
  /// \throws LeftDomain if the solution cannot be continued to t1; the message names the time reached.
  const FlowEnd& run(double t0, double t1, const Eigen::VectorXd& z0, const Eigen::VectorXd& p,
                     const Directions& directions);
  /// The same on contiguous numbers, each followed by its d derivatives (see Field::variation): z0 has n (1 + d) entries and p
  /// m (1 + d). Returns z₁ and w₁ − w₀, (n + k)(1 + d) entries that are valid until the next call. \throws LeftDomain as above, BadInput if
  /// the sizes are others
  std::span<const double> advance(double t0, double t1, std::span<const double> z0, std::span<const double> p, int d);
  /// The same without sensitivities, keeping dense output; w starts at w0.
  Trajectory record(double t0, double t1, const Eigen::VectorXd& z0, const Eigen::VectorXd& w0, const Eigen::VectorXd& p);

 private:
  Integrator& integrator(int directions);

  const Field* field_;
  FlowOptions options_;
  Statistics statistics_;
  FlowEnd end_;
  std::vector<double> lifted_end_;
  std::vector<std::unique_ptr<Integrator>> integrators_;
};

}  // namespace costate
