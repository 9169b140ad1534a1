/// \file
/// The shooting problem of the bead with drag. Private to the models library.
#pragma once

#include <costate/models/drag.hpp>

namespace costate::drag {

/// See make_problem.
class DragProblem final : public Problem {
 public:
  DragProblem(const Scene& scene, const Guess& guess);

  [[nodiscard]] Family family() const { return family_; }
  [[nodiscard]] const SpeedMap& map() const { return map_; }

  void shoot(Shot& shot) const override;
  [[nodiscard]] std::vector<Column> columns() const override;
  [[nodiscard]] std::vector<double> observe(const ArcPoint& point, const std::vector<double>& p) const override;
  [[nodiscard]] std::vector<PathCheck> check(const ArcPoint& point, const std::vector<double>& p) const override;

 private:
  enum class Arcs { from_start, from_end, from_both };

  template <class Orbit>
  void travel(Shot& shot, const Scaled<Jet>& scene, const Field& field, const Orbit& orbit, const Jet& start,
              const Jet& end) const;
  [[nodiscard]] OrbitPoint<double> orbit_point(const ArcPoint& point) const;

  Family family_;
  SpeedMap map_;
  Arcs arcs_ = Arcs::from_start;
  FieldOf<OrbitArc<TurningOrbit>> turning_;
  FieldOf<OrbitArc<PassingOrbit>> passing_;
  FieldOf<OrbitArc<MonotoneOrbit>> monotone_;
};

}  // namespace costate::drag
