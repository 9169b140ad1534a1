/// \file
/// An independent way to solve two-point problems, for references: collocation at the three Gauss points of every cell of a mesh,
/// in long double, order 6 at the nodes. Nothing of it integrates an initial-value problem.
///
/// Ascher, Mattheij & Russell, Numerical Solution of Boundary Value Problems for Ordinary Differential Equations, SIAM 1995,
/// §5.4 (collocation), §7.2 (the recursion by orthogonal steps, stable wherever the problem is well conditioned).
#pragma once

#include <costate/dual.hpp>
#include <costate/vec.hpp>

#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

namespace costate::collocation {

using Real = long double;
using Vector = Eigen::Matrix<Real, Eigen::Dynamic, 1>;
using Matrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;

/// Values at the nodes of a mesh, one column a node.
struct Grid {
  std::vector<Real> x;
  Matrix y;
};

/// y' = f(x, y, p) with values given at the ends; F is a right-hand side as TwoPoint takes it.
template <class F>
class Collocation {
 public:
  static constexpr int n = F::states;
  using Ends = std::array<std::pair<std::optional<double>, std::optional<double>>, static_cast<std::size_t>(n)>;

  Collocation(Vec<Real, F::parameters> p, const Ends& ends) : p_(p) {
    for (int i = 0; i < n; ++i) {
      const auto& [start, end] = ends[static_cast<std::size_t>(i)];
      if (start) start_.emplace_back(i, *start);
      if (end) end_.emplace_back(i, *end);
    }
  }

  /// Newton's method from the values of the grid; steps are halved as long as the residual grows.
  /// \throws std::runtime_error where it does not converge.
  void solve(Grid& grid) const {
    const auto cells = static_cast<Eigen::Index>(grid.x.size()) - 1;
    std::vector<Matrix> k;  // rates at the Gauss points of each cell
    for (Eigen::Index c = 0; c < cells; ++c) {
      const Vector slope = (grid.y.col(c + 1) - grid.y.col(c)) / (grid.x[at(c) + 1] - grid.x[at(c)]);
      k.emplace_back(slope.replicate(1, 3));
    }
    Real size = residual(grid, k);
    for (int iteration = 0; iteration < 60; ++iteration) {
      const Grid before = grid;
      const std::vector<Matrix> rates = k;
      auto [dy, dk] = step(grid, k);
      Real damping = 1.0L;
      for (int halving = 0;; ++halving, damping *= 0.5L) {
        grid.y = before.y + damping * dy;
        for (std::size_t c = 0; c < k.size(); ++c) k[c] = rates[c] + damping * dk[c];
        const Real next = residual(grid, k);
        if (next < size || dy.cwiseAbs().maxCoeff() < 1e-15L * (1.0L + grid.y.cwiseAbs().maxCoeff())) {
          size = next;
          break;
        }
        if (halving == 12) throw std::runtime_error("collocation: no step reduces the residual");
      }
      if (dy.cwiseAbs().maxCoeff() < 1e-15L * (1.0L + grid.y.cwiseAbs().maxCoeff())) return;
    }
    throw std::runtime_error("collocation: Newton's method does not converge");
  }

 private:
  static std::size_t at(Eigen::Index i) { return static_cast<std::size_t>(i); }

  /// Butcher's table of the three-stage Gauss formula.
  struct Table {
    Matrix a{3, 3};
    Vector b{3}, c{3};
    Table() {
      const Real r = std::sqrt(15.0L);
      a << 5.0L / 36, 2.0L / 9 - r / 15, 5.0L / 36 - r / 30, 5.0L / 36 + r / 24, 2.0L / 9, 5.0L / 36 - r / 24,
          5.0L / 36 + r / 30, 2.0L / 9 + r / 15, 5.0L / 36;
      b << 5.0L / 18, 4.0L / 9, 5.0L / 18;
      c << 0.5L - r / 10, 0.5L, 0.5L + r / 10;
    }
  };

  /// f and, if wanted, f_y.
  Vector rates(Real x, const Vector& y, Matrix* jacobian = nullptr) const {
    using D = Dual<Real, n>;
    Vec<D, n> point;
    for (int i = 0; i < n; ++i) point[static_cast<std::size_t>(i)] = D::variable(y[i], i);
    const auto r = F{}.rates(D(x), point, lift<D>(p_));
    Vector f(n);
    for (int i = 0; i < n; ++i) {
      f[i] = r[static_cast<std::size_t>(i)].value;
      for (int j = 0; jacobian != nullptr && j < n; ++j) {
        (*jacobian)(i, j) = r[static_cast<std::size_t>(i)].gradient[static_cast<std::size_t>(j)];
      }
    }
    return f;
  }

  Vector stage(const Grid& grid, const Matrix& k, Eigen::Index cell, int s, Real h) const {
    return grid.y.col(cell) + h * (k * table_.a.row(s).transpose());
  }

  /// The largest defect: of the stages, times the cell, of the cells' joints and of the ends.
  Real residual(const Grid& grid, const std::vector<Matrix>& k) const {
    Real worst = 0.0L;
    for (const auto& [i, value] : start_) worst = std::max(worst, std::abs(grid.y(i, 0) - value));
    for (const auto& [i, value] : end_) worst = std::max(worst, std::abs(grid.y(i, grid.y.cols() - 1) - value));
    for (Eigen::Index c = 0; c + 1 < grid.y.cols(); ++c) {
      const Real h = grid.x[at(c) + 1] - grid.x[at(c)];
      for (int s = 0; s < 3; ++s) {
        const Vector f = rates(grid.x[at(c)] + h * table_.c[s], stage(grid, k[at(c)], c, s, h));
        worst = std::max(worst, h * (k[at(c)].col(s) - f).cwiseAbs().maxCoeff());
      }
      worst = std::max(worst, (grid.y.col(c) + h * k[at(c)] * table_.b - grid.y.col(c + 1)).cwiseAbs().maxCoeff());
    }
    return std::isfinite(worst) ? worst : std::numeric_limits<Real>::infinity();
  }

  /// Newton's step. The stages of a cell are eliminated in it, which leaves dy₊ = A dy + r; the cells are then joined by orthogonal
  /// steps that keep, of the equations so far, n between the first node and the present one.
  std::pair<Matrix, std::vector<Matrix>> step(const Grid& grid, const std::vector<Matrix>& k) const {
    const Eigen::Index cells = grid.y.cols() - 1;
    struct Cell {
      Matrix sensitivity;            // of the stages' rates to the cell's first node (3n × n)
      Vector defect;                 // their step where that node stays (3n)
      Matrix diagonal, first, next;  // diagonal dy_c + first dy_0 + next dy_{c+1} = right
      Vector right;
    };
    std::vector<Cell> all(at(cells));
    Matrix to_first = Matrix::Zero(n, n), to_here = Matrix::Zero(n, n);
    Vector known = Vector::Zero(n);
    for (Eigen::Index c = 0; c < cells; ++c) {
      Cell& cell = all[at(c)];
      const Real h = grid.x[at(c) + 1] - grid.x[at(c)];
      Matrix system = Matrix::Identity(3 * n, 3 * n);
      Matrix right(3 * n, n + 1);
      for (int s = 0; s < 3; ++s) {
        Matrix j(n, n);
        const Vector f = rates(grid.x[at(c)] + h * table_.c[s], stage(grid, k[at(c)], c, s, h), &j);
        for (int q = 0; q < 3; ++q) system.block(s * n, q * n, n, n) -= h * table_.a(s, q) * j;
        right.block(s * n, 0, n, n) = j;
        right.block(s * n, n, n, 1) = f - k[at(c)].col(s);
      }
      const Matrix solved = system.partialPivLu().solve(right);
      cell.sensitivity = solved.leftCols(n);
      cell.defect = solved.col(n);
      Matrix a = Matrix::Identity(n, n);
      Vector r = grid.y.col(c) - grid.y.col(c + 1) + h * k[at(c)] * table_.b;
      for (int s = 0; s < 3; ++s) {
        a += h * table_.b[s] * cell.sensitivity.middleRows(s * n, n);
        r += h * table_.b[s] * cell.defect.segment(s * n, n);
      }
      // a dy_c − dy_{c+1} = −r joins what is known so far: to_first dy_0 + to_here dy_c = known.
      if (c == 0) {
        to_first = a;
        to_here = -Matrix::Identity(n, n);
        known = -r;
        continue;
      }
      Matrix here(2 * n, n), others(2 * n, 2 * n + 1);
      here << to_here, a;
      others << to_first, Matrix::Zero(n, n), known, Matrix::Zero(n, n), -Matrix::Identity(n, n), -r;
      const Eigen::HouseholderQR<Matrix> qr(here);
      const Matrix turned = qr.householderQ().adjoint() * others;
      cell.diagonal = qr.matrixQR().topRows(n).template triangularView<Eigen::Upper>();
      cell.first = turned.topLeftCorner(n, n);
      cell.next = turned.block(0, n, n, n);
      cell.right = turned.topRightCorner(n, 1);
      to_first = turned.bottomLeftCorner(n, n);
      to_here = turned.block(n, n, n, n);
      known = turned.bottomRightCorner(n, 1);
    }
    Matrix ends = Matrix::Zero(2 * n, 2 * n);
    Vector values = Vector::Zero(2 * n);
    ends.topRows(n) << to_first, to_here;
    values.head(n) = known;
    Eigen::Index row = n;
    for (const auto& [i, value] : start_) {
      ends(row, i) = 1.0L;
      values[row++] = value - grid.y(i, 0);
    }
    for (const auto& [i, value] : end_) {
      ends(row, n + i) = 1.0L;
      values[row++] = value - grid.y(i, cells);
    }
    const Vector both = ends.fullPivLu().solve(values);
    Matrix dy(n, cells + 1);
    dy.col(0) = both.head(n);
    dy.col(cells) = both.tail(n);
    for (Eigen::Index c = cells - 1; c > 0; --c) {
      const Cell& cell = all[at(c)];
      dy.col(c) = cell.diagonal.template triangularView<Eigen::Upper>().solve(cell.right - cell.first * dy.col(0) -
                                                                              cell.next * dy.col(c + 1));
    }
    std::vector<Matrix> dk;
    for (Eigen::Index c = 0; c < cells; ++c) {
      const Vector flat = all[at(c)].sensitivity * dy.col(c) + all[at(c)].defect;
      dk.emplace_back(Eigen::Map<const Matrix>(flat.data(), n, 3));
    }
    return {dy, dk};
  }

  Table table_;
  Vec<Real, F::parameters> p_;
  std::vector<std::pair<int, double>> start_, end_;
};

/// A mesh of as many cells, a third of them spread evenly and the others where the components change; the
/// values are carried over linearly.
inline Grid adapted(const Grid& grid, int cells) {
  const Vector range = (grid.y.rowwise().maxCoeff() - grid.y.rowwise().minCoeff()).cwiseMax(1e-12L);
  const Real length = grid.x.back() - grid.x.front();
  std::vector<Real> change{0.0L};
  for (Eigen::Index c = 1; c < grid.y.cols(); ++c) {
    change.push_back(change.back() + (grid.y.col(c) - grid.y.col(c - 1)).cwiseAbs().cwiseQuotient(range).sum());
  }
  const Real total = change.back() > 0.0L ? change.back() : 1.0L;
  std::vector<Real> mass;
  for (std::size_t i = 0; i < grid.x.size(); ++i) {
    mass.push_back(change[i] / total + 0.5L * (grid.x[i] - grid.x.front()) / length);
  }
  Grid next{{}, Matrix(grid.y.rows(), cells + 1)};
  for (int i = 0; i <= cells; ++i) {
    const Real wanted = mass.back() * i / cells;
    const auto after = std::clamp<std::ptrdiff_t>(std::upper_bound(mass.begin(), mass.end(), wanted) - mass.begin(), 1,
                                                  static_cast<std::ptrdiff_t>(mass.size()) - 1);
    const auto right = static_cast<std::size_t>(after);
    const Real part = std::clamp((wanted - mass[right - 1]) / (mass[right] - mass[right - 1]), 0.0L, 1.0L);
    next.x.push_back(grid.x[right - 1] + part * (grid.x[right] - grid.x[right - 1]));
    next.y.col(i) = (1.0L - part) * grid.y.col(after - 1) + part * grid.y.col(after);
  }
  next.x.front() = grid.x.front();
  next.x.back() = grid.x.back();
  return next;
}

/// The mesh with every cell halved.
inline Grid halved(const Grid& grid) {
  Grid next{{}, Matrix(grid.y.rows(), 2 * grid.y.cols() - 1)};
  for (std::size_t i = 0; i < grid.x.size(); ++i) {
    const auto c = static_cast<Eigen::Index>(i);
    if (i > 0) {
      next.x.push_back(0.5L * (grid.x[i - 1] + grid.x[i]));
      next.y.col(2 * c - 1) = 0.5L * (grid.y.col(c - 1) + grid.y.col(c));
    }
    next.x.push_back(grid.x[i]);
    next.y.col(2 * c) = grid.y.col(c);
  }
  return next;
}

/// The solution's values at both ends, and how far they are known: what halving every cell has changed.
struct Reference {
  Vector start, end;
  Real error = 0.0L;
};

/// Solves a problem P of one parameter for each of the values in turn, from the solution before, and refines the last.
template <class P>
Reference reference(const std::vector<double>& parameters, int cells) {
  Grid grid{{P::a, P::b}, Matrix(P::states, 2)};
  const auto ends = P::ends(parameters.front());
  for (int i = 0; i < P::states; ++i) {
    const auto& [start, end] = ends[static_cast<std::size_t>(i)];
    grid.y(i, 0) = start.value_or(end.value_or(0.0));
    grid.y(i, 1) = end.value_or(start.value_or(0.0));
  }
  for (const double parameter : parameters) {
    grid = adapted(grid, cells);
    const Collocation<P> problem({static_cast<Real>(parameter)}, P::ends(parameter));
    for (int pass = 0; pass < 3; ++pass) {
      problem.solve(grid);
      grid = adapted(grid, cells);
    }
    problem.solve(grid);
  }
  const Collocation<P> problem({static_cast<Real>(parameters.back())}, P::ends(parameters.back()));
  const Grid coarse = grid;
  grid = halved(grid);
  problem.solve(grid);
  Reference r{grid.y.col(0), grid.y.rightCols(1), 0.0L};
  for (const auto& [fine, rough] : {std::pair{r.start, Vector(coarse.y.col(0))}, {r.end, Vector(coarse.y.rightCols(1))}}) {
    r.error = std::max(r.error, ((fine - rough).cwiseAbs().array() / (1.0L + fine.cwiseAbs().array())).maxCoeff());
  }
  return r;
}

}  // namespace costate::collocation
