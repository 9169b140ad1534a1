/// \file
/// The shooting problem of the rolling disk. Private to the models library.
#pragma once

#include <costate/models/disk.hpp>

#include <cmath>

namespace costate::disk {

/// The scene in units of L = r/√6 and T = L/c₁, mirrored so that the disk turns left.
template <class S>
struct Scaled {
  S length, time, speed, x, y, heading, friction;
  double side;  ///< +1 turning left, −1 mirrored

  template <class Get>
  Scaled(const Get& get, bool limited) {
    length = get(radius_place) / std::sqrt(6.0);
    speed = get(speed_place);
    time = length / speed;
    side = primal(get(heading_place)) < 0.0 ? -1.0 : 1.0;
    x = get(x_place) / length;
    y = get(y_place) * side / length;
    heading = get(heading_place) * side;
    friction = limited ? get(friction_place) * get(gravity_place) * length / (speed * speed)
                       : S(std::numeric_limits<double>::infinity());
  }
};

/// A point of the chain of arcs, positions relative to the anchor. V' and G = A − λφ V/Ω are those of a saturated arc behind.
struct ChainPoint {
  Jet time, phi, V, lambda_phi, x, y, acceleration, G;
};

/// Both ends of an arc.
struct ArcEnds {
  ChainPoint begin, end;
};

[[nodiscard]] const char* kind_name(ArcKind kind);

/// Where the chain of a structure starts from: an arc of that kind, or if it is saturated the start of that arc.
struct AnchorPlace {
  ArcKind kind = ArcKind::free;
  std::size_t first_forward = 0;  ///< arcs from here on run forward from the anchor, those before it backward
  /// Is the anchor anywhere but at the very start?
  [[nodiscard]] bool inside() const { return first_forward > 0 || kind == ArcKind::boundary; }
};
[[nodiscard]] AnchorPlace anchor_of(const Structure& arcs);

/// Where the chain starts from, and the constant costates.
struct Anchor {
  Jet lambda_x, lambda_y;
  ChainPoint point;

  /// A = λx cos φ + λy sin φ.
  [[nodiscard]] Jet along(const Jet& phi) const { return lambda_x * cos(phi) + lambda_y * sin(phi); }
};

/// Everything known at a point of an arc, scaled. S is by its definition 1 − A V − λφ Ω, and on a saturated arc also by the
/// integral of its own rate; their difference is H. `slope` is G = A − λφ V/Ω.
struct Observed {
  double phi, V, Omega, acceleration, lambda_phi, switching, hamiltonian, slope;
};

/// What S starts from on a saturated arc: S₁ and G₁ = A − λφ V/Ω.
template <class S>
struct SwitchingStart {
  S switching, G;
  SwitchingStart(const S& A, const S& V, const S& Omega, const S& lambda_phi)
      : switching(1.0 - A * V - lambda_phi * Omega), G(A - lambda_phi * V / Omega) {}
  /// S, from the state ν and the quadratures q₁, q₂ of the arc.
  [[nodiscard]] S at(const S& nu, const S& q1, const S& q2, const S& scale) const {
    return switching - scale * (nu * G + scale * (nu * q1 - q2));
  }
};

/// See make_problem.
class DiskProblem final : public Problem {
 public:
  DiskProblem(const Scene& scene, Structure arcs);

  void shoot(Shot& shot) const override;
  [[nodiscard]] std::vector<Column> columns() const override;
  [[nodiscard]] std::vector<double> observe(const ArcPoint& point, const std::vector<double>& p) const override;
  [[nodiscard]] std::vector<PathCheck> check(const ArcPoint& point, const std::vector<double>& p) const override;

  [[nodiscard]] const Structure& arcs() const { return arcs_; }

 private:
  [[nodiscard]] ArcKind kind(std::size_t i) const { return arcs_[i].kind; }
  /// The arc after `i`, or before it, in the given direction; null if there is none.
  [[nodiscard]] const ArcType* beyond(std::size_t i, int direction) const;
  [[nodiscard]] const ArcType* before(std::size_t i, int direction) const { return beyond(i, -direction); }
  [[nodiscard]] static bool is(const ArcType* arc, ArcKind kind) { return arc != nullptr && arc->kind == kind; }
  [[nodiscard]] const Jet& duration(const Shot& shot, std::size_t i) const {
    return shot.unknown(unknowns_.size() - arcs_.size() + i);
  }

  void name_everything(const Scene& scene);
  void name_far_rows(std::size_t i, int direction);
  Anchor start_anchor(Shot& shot, const Scaled<Jet>& scene, std::size_t& next_row) const;
  void advance(Shot& shot, const Scaled<Jet>& scene, const Anchor& anchor, std::size_t i, int direction, ChainPoint& at,
               std::size_t& next_row) const;
  void advance_saturated(Shot& shot, const Scaled<Jet>& scene, const Anchor& anchor, ArcStart& start, int direction,
                         ChainPoint& at, std::size_t& next_row) const;
  /// V' with which a saturated arc leaves a point of the chain.
  [[nodiscard]] Jet departure(const Scaled<Jet>& scene, std::size_t i, int direction, const ChainPoint& at) const;
  void set_guards(Shot& shot, const Scaled<Jet>& scene, const Anchor& anchor, const std::vector<ArcEnds>& ends) const;
  [[nodiscard]] Jet guard(const GuardPlace& place, const Jet& friction, const Anchor& anchor, const ArcEnds& ends) const;
  void report(Shot& shot, const Scaled<Jet>& scene, const Anchor& anchor, const ChainPoint& left,
              const ChainPoint& right) const;
  [[nodiscard]] Observed observed(const ArcPoint& point) const;

  Structure arcs_;
  bool limited_ = false;
  AnchorPlace anchor_;
  std::vector<GuardPlace> guards_;
  FieldOf<FreeArc> free_;
  FieldOf<SaturatedArc> saturated_;
  FieldOf<BoundaryArc> boundary_;
};

}  // namespace costate::disk
