/// Roots along a parameter.
#include "curve.hpp"
#include "factors.hpp"
#include "locating.hpp"
#include "newton.hpp"

#include <costate/error.hpp>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>

namespace costate {

namespace {

/// The last few points of a curve, and where polynomials through them lead: Newton's form by divided differences, the newest point first.
class Extrapolation {
 public:
  explicit Extrapolation(std::size_t most) : most_(most) {}

  /// Is there a point here, or too near for a difference of values to tell a slope?
  [[nodiscard]] bool knows(double at) const {
    constexpr double too_near = 1e-6;  // of the distance to the farthest
    double nearest = std::numeric_limits<double>::infinity(), farthest = 0.0;
    for (std::size_t k = 0; k < count_; ++k) {
      nearest = std::min(nearest, std::abs(at - at_[k]));
      farthest = std::max(farthest, std::abs(at - at_[k]));
    }
    return nearest <= too_near * farthest;
  }
  /// A point where one is known is left out.
  void add(double at, const Eigen::VectorXd& value) {
    if (knows(at)) return;
    difference_ = value;
    if (differences_.rows() != value.size()) differences_.resize(value.size(), static_cast<Eigen::Index>(most_));
    count_ = std::min(count_ + 1, most_);
    double place = at;
    for (std::size_t k = 0; k < count_; ++k) {
      // f[x, x₀ … xₖ₋₁] takes the place of f[x₀ … xₖ], from which the next one is made.
      std::swap(at_[k], place);
      double* old = differences_.col(static_cast<Eigen::Index>(k)).data();
      const double inverse = k + 1 < count_ ? 1.0 / (at - place) : 0.0;
      for (Eigen::Index i = 0; i < difference_.size(); ++i) {
        const double before = std::exchange(old[i], difference_[i]);
        difference_[i] = inverse * (difference_[i] - before);
      }
    }
  }
  void clear() { count_ = 0; }
  [[nodiscard]] std::size_t count() const { return count_; }

  /// The value at a place, by the polynomial of the degree whose last term is least. \pre there is a point
  const Eigen::VectorXd& operator()(double at) {
    best_ = sum_ = differences_.col(0);
    doubt_.setConstant(sum_.size(), std::numeric_limits<double>::infinity());
    term_.resize(sum_.size());
    double least = std::numeric_limits<double>::infinity(), product = 1.0;
    std::size_t degree = 0;
    for (std::size_t k = 1; k < count_; ++k) {
      product *= at - at_[k - 1];
      const double* difference = differences_.col(static_cast<Eigen::Index>(k)).data();
      double largest = 0.0;
      for (Eigen::Index i = 0; i < sum_.size(); ++i) {
        term_[i] = product * difference[i];
        sum_[i] += term_[i];
        largest = std::max(largest, std::abs(term_[i]));
      }
      const bool less = largest < least;
      if (less || k == degree + 1) doubt_ = term_;
      if (!less) continue;
      least = largest;
      best_ = sum_;
      degree = k;
    }
    return best_;
  }
  /// What the last value may be off by: the first term that is left out, or if none is known the last that is not. Infinite from one point.
  [[nodiscard]] const Eigen::VectorXd& doubt() const { return doubt_; }

 private:
  static constexpr std::size_t room = 8;

  std::size_t most_;  ///< points kept, at most the room there is
  std::array<double, room> at_{};
  Eigen::MatrixXd differences_;  ///< f[x₀ … xₖ] in column k
  Eigen::VectorXd difference_, sum_, best_, term_, doubt_;
  std::size_t count_ = 0;
};

/// From root to root as a parameter moves. Roots are predicted by extrapolation and corrected once: by the Jacobian there, or by one
/// extrapolated like the roots, for which the states alone are integrated. How good an extrapolated Jacobian is shows each time the true
/// one is known.
class Pursuit {
 public:
  Pursuit(Shooting& shooting, std::size_t place, const LocateOptions& options)
      : shooting_(shooting),
        options_(options),
        locator_(shooting, options),
        place_(place),
        parameters_(shooting.parameters()),
        row_scales_(shooting.row_scales()),
        unknown_scales_(shooting.unknown_scales()),
        bounds_(Bounds::of(shooting)),
        residual_(shooting.size()),
        entries_(shooting.size() * shooting.size()) {}

  Located first(double value, const Eigen::Ref<const Eigen::VectorXd>& start) {
    move_to(value);
    return kept(value, locator_.find(start));
  }

  Located next(double value) {
    const Eigen::VectorXd last = y_;
    move_to(value);
    y_ = roots_(value);
    // A prediction beyond a limit would not see it.
    step_ = y_ - last;
    Located root;
    root.termination = Termination::stalled;
    if (bounds_.share(last, step_) == 1.0) root = Factors::small(shooting_) ? correct(value) : locator_.correct(y_);
    if (!root.converged()) {
      // The curve is not as smooth as that: what was learnt of it is forgotten.
      roots_.clear();
      jacobians_.clear();
      root = locator_.find(last);
    }
    return kept(value, std::move(root));
  }

 private:
  void move_to(double value) {
    parameters_[place_] = value;
    shooting_.set_parameters(parameters_);
  }
  Located kept(double value, Located root) {
    y_ = root.y;
    tolerance_ = root.tolerance;
    if (root.converged()) roots_.add(value, root.y);
    return root;
  }

  Located correct(double value) {
    constexpr double margin = 0.25, slowest = 0.3;
    shooting_.set_flow_options(flow_options(options_, tolerance_));
    const Statistics before = shooting_.statistics();
    Located root{.termination = Termination::stalled, .y = y_, .tolerance = tolerance_};
    bool exact = jacobians_.count() < least_known || since_ >= spacing_ || !(rate_ <= slowest);
    double rate = rate_, previous = std::numeric_limits<double>::infinity();
    if (!exact) {
      // What the last extrapolation was worth says little of a longer one, or one into a bend.
      const double doubt = extrapolate(value);
      exact = !(doubt <= slowest);
      rate = std::max(rate, doubt);
    }
    bool second_order = exact;  // of the error that the last correction has left
    try {
      for (bool first = true; root.iterations < most_corrections; first = false) {
        if (exact) {
          differentiate(value);
        } else {
          shoot(shooting_.values(y_, Extent::equations));
        }
        factors_.correction(residual_, step_);
        root.correction = length(step_);
        if (!(root.correction < 0.5 * previous) || bounds_.share(y_, step_) < 1.0) break;
        if (!first && root.correction > 3.0 * tolerance_) {
          if (second_order) curvature_ = std::max(curvature_, root.correction / (previous * previous));
          if (!exact) rate = std::max(rate, root.correction / previous);
        }
        // Where the Jacobian was exact what is left is of second order: the curvature is as large as it was found to be.
        second_order = exact;
        const double error = ((exact ? 0.0 : rate) + curvature_ * root.correction) * root.correction;
        if (exact) rate = curvature_ * root.correction;
        y_ += step_;
        ++root.iterations;
        if (error <= margin * options_.accuracy) {
          root.termination = Termination::converged;
          root.error = error + options_.accuracy;  // of the integration as much as was asked for
          ++since_;
          break;
        }
        previous = root.correction;
        constexpr double long_step = 1e-4;  // after which another one by the same Jacobian would gain little
        exact = exact ? root.correction > long_step : rate > slowest;
      }
    } catch (const LeftDomain& left) {
      root.termination = Termination::left_domain;
      root.message = left.what();
    }
    root.y = y_;
    root.statistics = shooting_.statistics() - before;
    return root;
  }

  /// R and J at y. The spacing of the places where J is known follows how well it would have been extrapolated here.
  void differentiate(double value) {
    const Shot& shot = shooting_.evaluate(y_, {}, Extent::equations);
    shoot(shot);
    const Eigen::Index n = y_.size();
    entries_.setZero();
    for (Eigen::Index i = 0; i < n; ++i) {
      for (const auto& [column, derivative] : shooting_.row(shot, i).gradient()) {
        if (column < n) entries_[i * n + column] = derivative;
      }
    }
    // At a place that is known an extrapolation is no test of what it is worth elsewhere.
    if (jacobians_.count() >= least_known && !jacobians_.knows(value)) {
      constexpr double poor = 0.03, good = 0.003;
      const Eigen::VectorXd& extrapolated = jacobians_(value);
      factors_.decompose(extrapolated, row_scales_, unknown_scales_);
      const double quality = relative(entries_ - extrapolated);
      if (quality > poor) spacing_ = std::max(1, spacing_ / 2);
      if (quality < good) spacing_ = std::min(widest, 2 * spacing_);
      rate_ = 2.0 * quality;
    }
    factors_.decompose(entries_, row_scales_, unknown_scales_);
    jacobians_.add(value, entries_);
    since_ = 0;
  }

  /// Decomposes an extrapolated Jacobian J̃. At which rate its corrections contract if it is as wrong as is to be feared.
  double extrapolate(double value) {
    factors_.decompose(jacobians_(value), row_scales_, unknown_scales_);
    return relative(jacobians_.doubt());
  }

  /// ‖J̃⁻¹E‖ of the J̃ decomposed last and an E: with E = J − J̃ the rate at which corrections by J̃ contract.
  double relative(const Eigen::VectorXd& e) {
    const Eigen::Index n = y_.size();
    column_.resize(n);
    sums_.setZero(n);
    for (Eigen::Index j = 0; j < n; ++j) {
      const double unit = std::max(unknown_scales_[j], std::abs(y_[j]));
      for (Eigen::Index i = 0; i < n; ++i) column_[i] = e[i * n + j] * unit;
      factors_.correction(column_, step_);
      sums_ += step_.cwiseAbs();
    }
    return length(sums_);
  }

  void shoot(const Shot& shot) { read_residual(shooting_, shot, residual_); }
  [[nodiscard]] double length(const Eigen::VectorXd& v) const { return scaled_length(v, unknown_scales_, y_); }

  static constexpr std::size_t least_known = 3;  ///< Jacobians, before one is extrapolated
  static constexpr int most_corrections = 6, widest = 10;

  Shooting& shooting_;
  LocateOptions options_;
  Locator locator_;
  std::size_t place_;
  std::vector<double> parameters_;
  Eigen::VectorXd row_scales_, unknown_scales_;
  Bounds bounds_;
  Eigen::VectorXd residual_, entries_, y_, step_, column_, sums_;
  Extrapolation roots_{8}, jacobians_{4};
  Factors factors_;
  int spacing_ = 2, since_ = 0;  ///< points from one known Jacobian to the next
  double tolerance_ = 0.0;       ///< of the integrations: what it was for the last root that was searched for
  double curvature_ = 2.0;       ///< of R, in the unknowns' units of length: the largest seen
  double rate_ = std::numeric_limits<double>::infinity();
};

}  // namespace

std::vector<Located> locate_along(Shooting& shooting, const Eigen::Ref<const Eigen::VectorXd>& start,
                                  const std::string& parameter, std::span<const double> values,
                                  const LocateOptions& options) {
  const std::size_t place = parameter_place(shooting.problem(), parameter);
  if (!std::all_of(values.begin(), values.end(), [](double value) { return std::isfinite(value); }))
    throw BadInput(fmt::format("a value of {} is not a finite number", parameter));
  Pursuit pursuit(shooting, place, options);
  std::vector<Located> roots;
  roots.reserve(values.size());
  for (const double value : values) {
    roots.push_back(roots.empty() ? pursuit.first(value, start) : pursuit.next(value));
    if (!roots.back().converged()) break;
  }
  return roots;
}

}  // namespace costate
