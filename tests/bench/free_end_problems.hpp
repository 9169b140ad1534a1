/// \file
/// Problems of one free arc with the unknowns (t_f, λx, λy), stated as a user of the library would.
#pragma once

#include <costate/models/disk.hpp>
#include <costate/models/drag.hpp>

namespace costate::bench {

/// One arc, no observers.
class OneArcProblem : public Problem {
 public:
  [[nodiscard]] std::vector<Column> columns() const override { return {}; }
  [[nodiscard]] std::vector<double> observe(const ArcPoint&, const std::vector<double>&) const override { return {}; }
  [[nodiscard]] std::vector<PathCheck> check(const ArcPoint&, const std::vector<double>&) const override { return {}; }

 protected:
  OneArcProblem() { unknowns_ = {{.name = "final_time", .lower = 0.0}, {.name = "lambda_x"}, {.name = "lambda_y"}}; }
};

/// The rolling disk without a friction limit, in its own units, from the origin to (x, y) and the heading π/2.
class DiskTransfer final : public OneArcProblem {
 public:
  DiskTransfer() {
    rows_ = {{"end heading"}, {"end x"}, {"end y"}};
    parameters_ = {{"x", "m", 1.0}, {"y", "m", 1.0}};
    structure_ = {"free"};
  }
  void shoot(Shot& shot) const override {
    const Jet &lambda_x = shot.unknown(1), &lambda_y = shot.unknown(2);
    const ArcEnd end = shot.arc({.field = &field_,
                                 .t0 = 0.0,
                                 .t1 = shot.unknown(0),
                                 .state = {0.0, sqrt(1.0 - lambda_x * lambda_x)},  // H = 0
                                 .quadrature = {0.0, 0.0},
                                 .parameter = {lambda_x, lambda_y}});
    shot.row(0, end.state[0] - std::numbers::pi / 2);
    shot.row(1, end.quadrature[0] - shot.parameter(0));
    shot.row(2, end.quadrature[1] - shot.parameter(1));
  }

 private:
  FieldOf<disk::FreeArc> field_;
};

/// The bead with speed-dependent friction, SI units, from the origin to (6, −1).
class BeadTransfer final : public OneArcProblem {
 public:
  BeadTransfer() {
    rows_ = {{"end lambda_v"}, {"end x"}, {"end y"}};
    parameters_ = {{"mu", "1/s", 0.3}};
    structure_ = {"flight"};
  }
  void shoot(Shot& shot) const override {
    constexpr double beta = 0.004, gravity = 9.8, speed = 2.0;
    const Jet &lambda_x = shot.unknown(1), &lambda_y = shot.unknown(2), &mu = shot.parameter(0);
    // H = 0: the larger root of (g² − K²) l² + 2 (K − g v λy) l + v² (λx² + λy²) − 1 = 0.
    const Jet K = speed * (beta * speed * speed - mu);
    const Jet a = gravity * gravity - K * K, b = K - gravity * speed * lambda_y;
    const Jet c = speed * speed * (lambda_x * lambda_x + lambda_y * lambda_y) - 1.0;
    const Jet lambda_v = (sqrt(b * b - a * c) - b) / a;
    const ArcEnd end = shot.arc({.field = &field_,
                                 .t0 = 0.0,
                                 .t1 = shot.unknown(0),
                                 .state = {speed, lambda_v},
                                 .quadrature = {0.0, 0.0},
                                 .parameter = {lambda_x, lambda_y, mu, beta, gravity}});
    shot.row(0, end.state[1]);
    shot.row(1, end.quadrature[0] - 6.0);
    shot.row(2, end.quadrature[1] + 1.0);
  }

 private:
  FieldOf<drag::Flight> field_;
};

}  // namespace costate::bench
