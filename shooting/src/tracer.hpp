/// \file
/// Pseudo-arclength continuation through folds and changes of structure. Private to the shooting library.
#pragma once

#include "curve.hpp"

namespace costate {

class Tracer {
 public:
  Tracer(std::shared_ptr<const Problem> problem, const std::vector<double>& parameters, std::size_t place, double to,
         const TraceOptions& options, const Restructure& restructure);

  /// From the solution near y, towards `to`, or in the given direction in scaled unknowns.
  Branch run(const Eigen::VectorXd& y, const std::optional<Eigen::VectorXd>& direction);

 private:
  enum class Step { goes_on, done };
  enum class Entry { closed, rigid, open, ended };

  /// The point where something happens within a step, at the arclength `s` from its start.
  struct Incident {
    double s = 0.0;
    EventKind kind = EventKind::fold;
    std::size_t guard = 0;
    bool sure = true;          ///< the point is a zero to the tolerance of Newton's method
    double error_bound = 0.0;  ///< of its parameter
    std::optional<CurvePoint> point{};
  };

  bool begin(const Eigen::VectorXd& y, const std::optional<Eigen::VectorXd>& direction);
  Step step();
  [[nodiscard]] std::optional<CurvePoint> advance(double& used);
  [[nodiscard]] bool stays_on_branch(const CurvePoint& next) const;
  Step accept(CurvePoint next);
  Step arrive(const CurvePoint& point);
  /// Values to land on that lie at an incident, as far as its place is known, are shown there.
  Step land_at(const Incident& incident);
  [[nodiscard]] double known_to(const Incident& incident) const;
  Step pass_fold(const Incident& fold);
  Step change_structure(const Incident& zero);
  Step approach(const Incident& zero);
  void record(const Incident& zero, EventKind kind);
  Step stop_at_rigid();
  Entry enter(const Incident& zero, const Successor& successor, std::size_t event);
  void locate_from_beyond(const CurvePoint& first, const Successor& successor, std::size_t event);
  [[nodiscard]] std::optional<CurvePoint> first_point(Curve& curve, const Successor& successor, double parameter) const;
  [[nodiscard]] std::optional<std::vector<CurvePoint>> landings_between(Curve& curve, double event, const CurvePoint& first);
  Step give_up();
  Step end(std::string message);

  [[nodiscard]] std::optional<double> next_landing(double from, double to) const;
  [[nodiscard]] std::optional<Incident> first_incident(const CurvePoint& next);
  /// Does the parameter run the other way at a point than at the present one?
  [[nodiscard]] bool turns_back(const CurvePoint& next) const;
  /// Do a fold and a zero lie in one step, so that a shorter one is wanted to tell them apart?
  [[nodiscard]] bool entangled(const CurvePoint& next) const;
  [[nodiscard]] std::optional<CurvePoint> landing_before(const Incident& incident);
  [[nodiscard]] std::optional<Incident> locate_fold(const CurvePoint& next);
  [[nodiscard]] Incident locate_zero(const CurvePoint& next, std::size_t guard);
  /// The point at the arclength s from the present one along its tangent.
  [[nodiscard]] std::optional<CurvePoint> at(double s, const CurvePoint& next);
  [[nodiscard]] std::vector<std::size_t> zeros_at(const Incident& zero) const;

  [[nodiscard]] CorrectorOptions corrector() const;
  [[nodiscard]] FlowOptions flow_options(double factor = 1.0) const;
  /// The same incident with tighter integrations: a better place, and from the difference how well it is known.
  void sharpen(Incident& incident);
  [[nodiscard]] double bound_from(const CurvePoint& loose, const CurvePoint& tight) const;
  [[nodiscard]] BranchPoint describe(const CurvePoint& point) const;
  void keep(const CurvePoint& point);
  void open_stretch();
  void adapt(const CurvePoint& next, double used);
  void add_cost(const Curve& curve);

  TraceOptions options_;
  const Restructure& restructure_;
  double from_, to_;
  std::unique_ptr<Curve> curve_;
  Branch branch_;
  CurvePoint here_;
  std::optional<Eigen::VectorXd> curvature_;  ///< d(tangent)/ds, from the last two points
  double step_;
  std::optional<double> landed_at_event_;  ///< the last value that was landed on at an incident of this stretch
  int folds_in_place_ = 0;                 ///< in a row
  int dead_ends_ = 0;                      ///< times this stretch was found to end without a successor
  long integration_steps_ = 0;             ///< of curves that are left behind
};

}  // namespace costate
