/// \file
/// Two problems in their plainest formulation, all costates at the start and the final time unknown, for measuring from how
/// many random guesses a method arrives.
#pragma once

#include <costate/models/disk.hpp>
#include <costate/models/drag.hpp>

#include <limits>
#include <memory>
#include <numbers>
#include <utility>
#include <vector>

namespace costate::basin {

/// A disk rolls in minimum time from (0, 0), heading 0, to (1, 1), heading π/2, with r = √6 m and c₁ = 1 m/s (no friction
/// limit). Unknowns t_f, λx, λy; λφ(0) = √(1 − λx²) from H = 0. One extremal, t_f = 2.21170647166983626 (elliptic closed
/// form).
class DiskTransfer final : public Problem {
 public:
  static constexpr double final_time = 2.21170647166983626;
  DiskTransfer() {
    const double infinity = std::numeric_limits<double>::infinity();
    unknowns_ = {{.name = "final_time", .lower = 0.0, .upper = infinity, .guess = 1.0},
                 {.name = "lambda_x"},
                 {.name = "lambda_y"}};
    rows_ = {{"end x"}, {"end y"}, {"end heading"}};
    structure_ = {"free"};
  }
  void shoot(Shot& shot) const override {
    const Jet& lambda_x = shot.unknown(1);
    const Jet lambda_phi = sqrt(1.0 - lambda_x * lambda_x, "1 - lambda_x^2");
    const ArcEnd end = shot.arc({.field = &field_,
                                 .t0 = 0.0,
                                 .t1 = shot.unknown(0),
                                 .state = {0.0, lambda_phi},
                                 .quadrature = {0.0, 0.0},
                                 .parameter = {lambda_x, shot.unknown(2)}});
    shot.row(0, end.quadrature[0] - 1.0);
    shot.row(1, end.quadrature[1] - 1.0);
    shot.row(2, end.state[0] - std::numbers::pi / 2);
    shot.report("final_time", "s", shot.unknown(0));
  }
  [[nodiscard]] std::vector<Column> columns() const override { return {{"x", "m"}, {"y", "m"}, {"phi", "rad"}}; }
  [[nodiscard]] std::vector<double> observe(const ArcPoint& point, const std::vector<double>&) const override {
    return {point.quadrature[0], point.quadrature[1], point.state[0]};
  }
  [[nodiscard]] std::vector<PathCheck> check(const ArcPoint& point, const std::vector<double>&) const override {
    using Full = Pontryagin<disk::FreeRolling, disk::FastestRolling>;
    const Eigen::VectorXd& p = point.record->parameter;
    return {{"Hamiltonian", PathCheck::Kind::zero, Full().hamiltonian({point.state[0], point.state[1]}, {p[0], p[1]})}};
  }

 private:
  FieldOf<disk::FreeArc> field_;
};

/// A bead on a wire through a resisting medium, from (0, 0) at 2 m/s to (6, −1) m in minimum time (the default scene of
/// drag.hpp). Unknowns t_f and the three costates at the start; rows x, y, λv at the end and H at the start. Two extremals,
/// t_f = 1.4687921521171958 and, a deep dive, 1.860214189843321 (collocation in extended precision), and roots with v < 0,
/// which are no motions.
class DragTransfer final : public Problem {
 public:
  static constexpr double final_time = 1.4687921521171958, dive_time = 1.860214189843321;
  DragTransfer() {
    const double infinity = std::numeric_limits<double>::infinity();
    unknowns_ = {{.name = "final_time", .lower = 0.0, .upper = infinity, .guess = 1.0},
                 {.name = "lambda_x"},
                 {.name = "lambda_y"},
                 {.name = "lambda_v0"}};
    rows_ = {{"end x"}, {"end y"}, {"end lambda_v"}, {"Hamiltonian"}};
    structure_ = {"flight"};
  }
  void shoot(Shot& shot) const override {
    const Jet& lambda_x = shot.unknown(1);
    const Jet& lambda_y = shot.unknown(2);
    const Jet& lambda_v = shot.unknown(3);
    const double v = scene_.speed;
    const ArcEnd end = shot.arc({.field = &field_,
                                 .t0 = 0.0,
                                 .t1 = shot.unknown(0),
                                 .state = {v, lambda_v},
                                 .quadrature = {0.0, 0.0},
                                 .parameter = {lambda_x, lambda_y, scene_.mu, scene_.beta, scene_.gravity}});
    shot.row(0, end.quadrature[0] - scene_.x);
    shot.row(1, end.quadrature[1] - scene_.y);
    shot.row(2, end.state[1]);
    const Jet along = v * lambda_x, across = v * lambda_y - scene_.gravity * lambda_v;
    shot.row(3, sqrt(along * along + across * across) + lambda_v * scene_.friction().force(v) - 1.0);
    shot.report("final_time", "s", shot.unknown(0));
  }
  [[nodiscard]] std::vector<Column> columns() const override { return {{"x", "m"}, {"y", "m"}, {"v", "m/s"}}; }
  [[nodiscard]] std::vector<double> observe(const ArcPoint& point, const std::vector<double>&) const override {
    return {point.quadrature[0], point.quadrature[1], point.state[0]};
  }
  [[nodiscard]] std::vector<PathCheck> check(const ArcPoint& point, const std::vector<double>&) const override {
    const Eigen::VectorXd& p = point.record->parameter;
    return {{"speed", PathCheck::Kind::nonnegative, point.state[0]},
            {"Hamiltonian", PathCheck::Kind::zero,
             drag::Flight().hamiltonian({point.state[0], point.state[1]}, {p[0], p[1], p[2], p[3], p[4]})}};
  }

 private:
  drag::Scene scene_;
  FieldOf<drag::Flight> field_;
};

}  // namespace costate::basin
