/// \file
/// The shooting problem of the bead with curvature-coupled friction. Private to the models library.
#pragma once

#include <costate/models/curvature.hpp>

#include <cmath>

namespace costate::curvature {

/// The regular end of a contact arc as power series in s = ω_f − ω, coefficients 0 … end_order, and how far they reach.
struct EndArc {
  enum Series : std::size_t { x, y, t, log_v, theta, eta, n, count };
  std::vector<Jet> coefficient[count];
  double reach = 0.0;  ///< s up to which what is left out is below rounding
  [[nodiscard]] Jet at(Series series, double s) const;
};

/// The series for v_f = 1, x_f = y_f = t_f = 0. \throws LeftDomain unless η_f > 0.
[[nodiscard]] EndArc end_arc(const Jet& theta, const Jet& eta, const Jet& mu, const Jet& beta);

/// A point of the chain of arcs, in units of v_f and g; place and time relative to the end.
struct ChainPoint {
  Jet x, y, t, log_v, theta;
  Jet eta, n;                     ///< on a contact arc
  Jet lambda_along, lambda_turn;  ///< on a ballistic one: n v², λθ
  Jet switching;                  ///< at the start of a first flight: (μ λv v − λθ) by its duration, which does not vanish with it
};

/// What holds throughout: the constant costates and the friction.
struct Constants {
  Jet lambda_x, lambda_y, mu, beta;
};

/// Everything known at a point of an arc, in units of v_f and g.
struct Observed {
  double v, theta, eta, lambda_v, lambda_theta;
  double hamiltonian;  ///< over the size of its terms
};

/// See make_problem.
class CurvatureProblem final : public Problem {
 public:
  CurvatureProblem(const Scene& scene, const Plan& plan);

  /// See plan_of.
  [[nodiscard]] Plan plan(const Eigen::VectorXd& y) const;

  void shoot(Shot& shot) const override;
  [[nodiscard]] std::vector<Column> columns() const override;
  [[nodiscard]] std::vector<double> observe(const ArcPoint& point, const std::vector<double>& p) const override;
  [[nodiscard]] std::vector<PathCheck> check(const ArcPoint& point, const std::vector<double>& p) const override;

 private:
  static constexpr std::size_t log_ratio_place = 2, first_length = 3;  ///< among the unknowns

  /// A flight at one of its ends: velocity, and the costates of its components, which are linear in t.
  struct Flight {
    Jet v_x, v_y, to_x, to_y;
    [[nodiscard]] Jet along() const { return to_x * v_x + to_y * v_y; }  ///< λv v
    [[nodiscard]] Jet turn() const { return to_y * v_x - to_x * v_y; }   ///< λθ
  };

  [[nodiscard]] bool starts_freely_in_flight() const { return !slope_given_ && arcs_.front().kind == ArcKind::ballistic; }
  [[nodiscard]] std::size_t first_node() const { return first_length + arcs_.size() + (starts_freely_in_flight() ? 1 : 0); }
  [[nodiscard]] bool last_in_contact() const { return arcs_.back().kind == ArcKind::contact; }
  [[nodiscard]] const Jet& length(const Shot& shot, std::size_t i) const { return shot.unknown(first_length + i); }
  void name_everything(const Scene& scene, const Plan& plan);
  void contact(Shot& shot, const Constants& constants, std::size_t i, ChainPoint& at, std::size_t& unknown,
               std::size_t& row) const;
  double end_segment(Shot& shot, std::size_t i, double most, const Constants& constants, ChainPoint& at) const;
  void segment(Shot& shot, std::size_t i, const Jet& from, const Jet& to, const Constants& constants, ChainPoint& at) const;
  [[nodiscard]] Flight flight_to(const Constants& constants, std::size_t i, const ChainPoint& at) const;
  void show_flight(Shot& shot, const Constants& constants, std::size_t i, const Flight& flight, const ChainPoint& at,
                   double d) const;
  void first_flight(Shot& shot, const Constants& constants, ChainPoint& at, std::size_t& row) const;
  void ballistic(Shot& shot, const Constants& constants, std::size_t i, ChainPoint& at) const;
  void finish(Shot& shot, const Constants& constants, const ChainPoint& at, const std::vector<Jet>& junctions,
              std::size_t row) const;
  [[nodiscard]] Observed observed(const ArcPoint& point) const;

  std::vector<ArcPlan> arcs_;
  bool slope_given_;
  FieldOf<ContactArc> contact_;
  FieldOf<BallisticArc> ballistic_;
  FieldOf<EndSeries> end_;
};

}  // namespace costate::curvature
