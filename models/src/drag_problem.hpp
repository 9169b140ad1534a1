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
  [[nodiscard]] Arcs arcs() const { return arcs_; }

  void shoot(Shot& shot) const override;
  [[nodiscard]] std::vector<Column> columns() const override;
  [[nodiscard]] std::vector<double> observe(const ArcPoint& point, const std::vector<double>& p) const override;
  [[nodiscard]] std::vector<PathCheck> check(const ArcPoint& point, const std::vector<double>& p) const override;

 private:
  /// A kind of arc on either side of the place nearest to a steady motion.
  template <template <class> class Orbit>
  struct Sides {
    FieldOf<OrbitArc<Orbit>> before, after;
    explicit Sides(const SpeedMap& map = {}) : before({-1.0, map}), after({1.0, map}) {}
  };

  template <class Orbit, class Fields>
  void travel(Shot& shot, const Scaled<Jet>& scene, const Fields& fields, const Orbit& orbit,
              const std::array<Jet, 2>& constants_of_orbit, const Jet& start) const;
  [[nodiscard]] double side_of(const ArcRecord& record) const;
  [[nodiscard]] OrbitPoint<double> orbit_point(const ArcPoint& point) const;

  Family family_;
  SpeedMap map_;
  Arcs arcs_ = Arcs::from_start;
  Sides<TurningOrbit> turning_;
  Sides<PassingOrbit> passing_;
  Sides<MonotoneOrbit> monotone_;
};

}  // namespace costate::drag
