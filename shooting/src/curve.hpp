/// \file
/// The curve of solutions u = (y, p) of one shooting problem. Private to the shooting library.
#pragma once

#include <costate/shooting/branch.hpp>

namespace costate {

/// What singles out one point of the curve: a plane across it, a value of the parameter, or a value of a guard.
struct Constraint {
  enum class Kind { plane, parameter, guard };
  Kind kind = Kind::plane;
  Eigen::VectorXd normal{};  ///< of the plane through the prediction, scaled
  double value = 0.0;        ///< of the parameter or the guard
  std::size_t guard = 0;
};

/// A solution, and what is known of the curve there. `u` is scaled.
struct CurvePoint {
  Eigen::VectorXd u, tangent;
  Eigen::VectorXd guards;       ///< values
  Eigen::VectorXd guard_rates;  ///< along the tangent
  std::vector<BranchReport> reports;
  std::optional<Shot> shot;  ///< evaluated within the last correction of u
  int iterations = 0;
  double first_correction = 0.0, contraction = 0.0, last_correction = 0.0;
  double parameter_correction = 0.0;  ///< the last, of p itself
  std::optional<double> landed;       ///< the value of the parameter that was asked for, if one was
};

/// Newton's method from a prediction to the curve.
struct CorrectorOptions {
  double tolerance = 1e-9;  ///< of the last correction, scaled
  int max_iterations = 8;
  bool far = false;  ///< the prediction may be rough: corrections are limited and need not contract at once
};

class Curve {
 public:
  /// `parameter_scale` is the length in p that counts as much as the scale of an unknown.
  Curve(std::shared_ptr<const Problem> problem, const std::vector<double>& parameters, std::size_t place,
        double parameter_scale, const FlowOptions& flow);

  [[nodiscard]] const Problem& problem() const { return shooting_.problem(); }
  [[nodiscard]] std::shared_ptr<const Problem> shared_problem() const { return shooting_.shared_problem(); }
  [[nodiscard]] const std::vector<double>& parameters() const { return shooting_.parameters(); }
  [[nodiscard]] std::size_t place() const { return place_; }
  [[nodiscard]] Statistics statistics() const { return shooting_.statistics(); }

  [[nodiscard]] Eigen::VectorXd scaled(const Eigen::VectorXd& y, double parameter) const;
  [[nodiscard]] Eigen::VectorXd unknowns(const Eigen::VectorXd& u) const {
    return u.head(size()).cwiseProduct(scales_.head(size()));
  }
  [[nodiscard]] double parameter(const Eigen::VectorXd& u) const { return u[size()] * scales_[size()]; }
  [[nodiscard]] Eigen::Index size() const { return shooting_.size(); }
  [[nodiscard]] const std::string& parameter_name() const { return problem().parameters()[place_].name; }
  /// Place of a named guard, as the problem sets it at u. Nothing if there is none, or the problem cannot be evaluated there.
  [[nodiscard]] std::optional<std::size_t> guard_place(const std::string& name, const Eigen::VectorXd& u);
  [[nodiscard]] double parameter_scale() const { return scales_[size()]; }

  /// Tolerance of the integrations from here on.
  void set_flow_options(const FlowOptions& options) { shooting_.set_flow_options(options); }

  /// The point that fulfils the constraint, from the prediction u; its tangent has an angle below 90° with `forward`. Nothing if
  /// Newton's method does not get there; then failure() says why.
  [[nodiscard]] std::optional<CurvePoint> correct(Eigen::VectorXd u, const Constraint& constraint,
                                                  const Eigen::VectorXd& forward, const CorrectorOptions& options);
  [[nodiscard]] const std::string& failure() const { return failure_; }
  [[nodiscard]] long newton_iterations() const { return newton_iterations_; }

 private:
  struct Linearised;
  [[nodiscard]] Linearised linearise(const Eigen::VectorXd& u);
  [[nodiscard]] Eigen::RowVectorXd gradient(const Jet& jet) const;
  void describe(const Linearised& at, const Eigen::VectorXd& correction, const Eigen::VectorXd& forward,
                CurvePoint& point) const;

  Shooting shooting_;
  std::size_t place_;
  Eigen::VectorXd scales_;  ///< of y and p
  std::vector<double> path_;
  std::string failure_;
  long newton_iterations_ = 0;
};

/// Place of a named parameter. \throws BadInput listing the names there are.
[[nodiscard]] std::size_t parameter_place(const Problem& problem, const std::string& name);

}  // namespace costate
