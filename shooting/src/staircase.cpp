#include "staircase.hpp"

#include <costate/error.hpp>

#include <Eigen/Householder>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <utility>

namespace costate {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Rounding error of a pivot, relative to its column.
constexpr double rounding = 8.0 * std::numeric_limits<double>::epsilon();
/// Singular values are iterated on until they change by less, relatively.
constexpr double standstill = 1e-4;
constexpr int most_iterations = 200;

constexpr std::size_t at(int i) { return static_cast<std::size_t>(i); }

/// A vector of unit length without a pattern that a matrix could share; the same on every platform.
VectorXd arbitrary(Index n) {
  std::mt19937 generator;
  VectorXd v(n);
  for (double& x : v) x = static_cast<double>(generator()) / 4294967296.0 - 0.5;
  return v.normalized();
}

/// (I - factor v vᵀ) w for v = (0, …, 0, 1, the k-th column of `reflectors` below the diagonal).
void reflect(const MatrixXd& reflectors, double factor, Index k, Eigen::Ref<VectorXd> w) {
  const Index below = w.size() - k - 1;
  const auto v = reflectors.col(k).tail(below);
  const double along = factor * (w[k] + v.dot(w.tail(below)));
  w[k] -= along;
  w.tail(below) -= along * v;
}

/// Largest singular value of M and its vectors, by power iteration: u ← M v, v ← Mᵀ u. Ends early where numbers overflow.
template <class Apply, class ApplyTransposed>
Staircase::Extreme dominant(Index n, const Apply& apply, const ApplyTransposed& apply_transposed) {
  Staircase::Extreme extreme{0.0, arbitrary(n), arbitrary(n)};
  for (int i = 0; i < most_iterations; ++i) {
    const VectorXd left = apply(extreme.right);
    if (!std::isfinite(left.norm()) || left.norm() == 0.0) break;
    extreme.left = left.normalized();
    const VectorXd right = apply_transposed(extreme.left);
    if (!std::isfinite(right.norm()) || right.norm() == 0.0) break;
    const double before = std::exchange(extreme.value, right.norm());
    extreme.right = right.normalized();
    if (std::abs(extreme.value - before) <= standstill * extreme.value) break;
  }
  return extreme;
}

}  // namespace

Staircase::Staircase(const std::vector<Jet::Gradient>& rows, const Layout& layout, const VectorXd& row_scales,
                     const VectorXd& column_scales)
    : row_scales_(row_scales), column_scales_(column_scales) {
  check(rows, layout);
  scale(rows);
  factorise(layout);
  name_pivots();
}

void Staircase::check(const std::vector<Jet::Gradient>& rows, const Layout& layout) const {
  const auto negative = [](int size) { return size < 0; };
  if (negative(layout.border)) throw BadInput(fmt::format("size of the border = {} is not in [0, ∞)", layout.border));
  const auto block = std::find_if(layout.blocks.begin(), layout.blocks.end(), negative);
  if (block != layout.blocks.end())
    throw BadInput(fmt::format("size of block {} = {} is not in [0, ∞)", block - layout.blocks.begin(), *block));
  const int columns = std::accumulate(layout.blocks.begin(), layout.blocks.end(), layout.border);
  if (std::ssize(rows) != columns)
    throw BadInput(fmt::format("number of rows = {}, but there are {} columns", rows.size(), columns));
  for (const auto* scales : {&row_scales_, &column_scales_}) {
    const char* name = scales == &row_scales_ ? "row" : "column";
    if (scales->size() != columns)
      throw BadInput(fmt::format("number of {} scales = {}, but there are {} {}s", name, scales->size(), columns, name));
    for (Index i = 0; i < columns; ++i)
      if (!((*scales)[i] > 0.0 && std::isfinite((*scales)[i])))
        throw BadInput(fmt::format("scale of {} {} = {} is not in (0, ∞)", name, i, (*scales)[i]));
  }
  for (std::size_t i = 0; i < rows.size(); ++i)
    for (const auto& entry : rows[i])
      if (entry.column < 0 || entry.column >= columns)
        throw BadInput(fmt::format("column of an entry in row {} = {} is not in [0, {})", i, entry.column, columns));
}

void Staircase::scale(const std::vector<Jet::Gradient>& rows) {
  std::vector<bool> column_occurs(rows.size(), false);
  begin_.push_back(0);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    for (const auto& [column, derivative] : rows[i]) {
      if (derivative == 0.0) continue;
      entries_.push_back({column, derivative * column_scales_[column] / row_scales_[static_cast<Index>(i)]});
      column_occurs[at(column)] = true;
    }
    if (entries_.size() == begin_.back() && !empty_row_) empty_row_ = static_cast<int>(i);
    begin_.push_back(entries_.size());
  }
  const auto missing = std::find(column_occurs.begin(), column_occurs.end(), false);
  if (missing != column_occurs.end()) empty_column_ = static_cast<int>(missing - column_occurs.begin());
}

void Staircase::factorise(const Layout& layout) {
  const int border = layout.border;
  const auto blocks = layout.blocks.size();
  std::vector<std::size_t> block_of;  // of a node's column
  for (std::size_t b = 0; b < blocks; ++b) block_of.insert(block_of.end(), at(layout.blocks[b]), b);

  // Rows wait at the first block they hold, those that hold none at the border.
  std::vector<std::vector<int>> own(blocks + 1);
  std::vector<std::vector<Carried>> carried(blocks + 1);
  const auto place = [&](int column) { return column < border ? blocks : block_of[at(column - border)]; };
  for (std::size_t i = 0; i + 1 < begin_.size(); ++i) {
    std::size_t first = blocks;
    for (auto e = begin_[i]; e < begin_[i + 1]; ++e) first = std::min(first, place(entries_[e].column));
    own[first].push_back(static_cast<int>(i));
  }

  const auto n = static_cast<std::size_t>(size());
  position_.assign(n, -1);
  pivot_row_.assign(n, -1);
  diagonal_ = VectorXd::Zero(size());
  fronts_.reserve(blocks + 1);
  int first = border;
  for (std::size_t b = 0; b < blocks; ++b) {
    Carried rest = eliminate(first, layout.blocks[b], border, own[b], carried[b]);
    if (!rest.rows.empty()) {
      const auto next = rest.columns.empty() ? blocks : place(rest.columns.front());
      carried[next].push_back(std::move(rest));
    }
    carried[b].clear();
    first += layout.blocks[b];
  }
  const Carried surplus = eliminate(0, border, border, own[blocks], carried[blocks]);

  // As many rows are left over as there are columns without a row; all that is left of them is their right-hand side.
  auto row = surplus.rows.begin();
  for (int& pivot : pivot_row_)
    if (pivot < 0) pivot = *row++;
}

Staircase::Carried Staircase::eliminate(int first, int count, int border, const std::vector<int>& own,
                                        const std::vector<Carried>& carried) {
  Front front{.count = count};
  auto& columns = front.columns;
  for (int j = first; j < first + count; ++j) columns.push_back(j);
  for (const int column : columns) position_[at(column)] = 0;
  const auto add = [&](int column) {
    if (position_[at(column)] >= 0) return;
    position_[at(column)] = 0;
    columns.push_back(column);
  };
  for (const int i : own)
    for (auto e = begin_[at(i)]; e < begin_[at(i) + 1]; ++e) add(entries_[e].column);
  for (const auto& part : carried)
    for (const int column : part.columns) add(column);
  // Nodes in the order of elimination, then the border.
  std::sort(columns.begin() + count, columns.end(),
            [&](int a, int b) { return std::pair(a < border, a) < std::pair(b < border, b); });
  for (std::size_t j = 0; j < columns.size(); ++j) position_[at(columns[j])] = static_cast<int>(j);

  auto& rows = front.rows;
  rows = own;
  for (const auto& part : carried) rows.insert(rows.end(), part.rows.begin(), part.rows.end());
  const auto m = std::ssize(rows), n = std::ssize(columns);
  MatrixXd dense = MatrixXd::Zero(m, n);
  for (std::size_t i = 0; i < own.size(); ++i)
    for (auto e = begin_[at(own[i])]; e < begin_[at(own[i]) + 1]; ++e)
      dense(static_cast<Index>(i), position_[at(entries_[e].column)]) += entries_[e].derivative;
  auto top = std::ssize(own);
  for (const auto& part : carried) {
    for (std::size_t j = 0; j < part.columns.size(); ++j)
      dense.col(position_[at(part.columns[j])]).segment(top, part.values.rows()) = part.values.col(static_cast<Index>(j));
    top += part.values.rows();
  }
  for (const int column : columns) position_[at(column)] = -1;

  const Index p = std::min<Index>(m, count);
  front.factors.resize(p);
  VectorXd workspace(n);
  for (Index k = 0; k < p; ++k) {
    double pivot;
    dense.col(k).tail(m - k).makeHouseholderInPlace(front.factors[k], pivot);
    dense.bottomRightCorner(m - k, n - k - 1)
        .applyHouseholderOnTheLeft(dense.col(k).tail(m - k - 1), front.factors[k], workspace.data());
    const int column = first + static_cast<int>(k);
    diagonal_[column] = pivot;
    pivot_row_[at(column)] = rows[static_cast<std::size_t>(k)];
  }
  front.reflectors = dense.leftCols(p);
  front.upper = dense.topRows(p);

  Carried rest{{rows.begin() + p, rows.end()},
               {columns.begin() + count, columns.end()},
               dense.bottomRightCorner(m - p, n - count)};
  fronts_.push_back(std::move(front));
  return rest;
}

void Staircase::name_pivots() {
  VectorXd squares = VectorXd::Zero(size());
  for (const auto& [column, derivative] : entries_) squares[column] += derivative * derivative;
  // An empty column has no scale of its own.
  const VectorXd lengths = squares.cwiseSqrt();
  const double longest = size() > 0 ? lengths.maxCoeff() : 0.0;
  perturbed_ = diagonal_;
  for (Index j = 0; j < size(); ++j) {
    if (std::abs(diagonal_[j]) > rounding * lengths[j]) continue;
    singular_ = true;
    const double length = lengths[j] > 0.0 ? lengths[j] : longest > 0.0 ? longest : 1.0;
    perturbed_[j] = std::copysign(rounding * length, diagonal_[j]);
  }
}

VectorXd Staircase::multiply(const VectorXd& x) const {
  VectorXd y = VectorXd::Zero(size());
  for (Index i = 0; i < size(); ++i)
    for (auto e = begin_[static_cast<std::size_t>(i)]; e < begin_[static_cast<std::size_t>(i) + 1]; ++e)
      y[i] += entries_[e].derivative * x[entries_[e].column];
  return y;
}

VectorXd Staircase::multiply_transposed(const VectorXd& x) const {
  VectorXd y = VectorXd::Zero(size());
  for (Index i = 0; i < size(); ++i)
    for (auto e = begin_[static_cast<std::size_t>(i)]; e < begin_[static_cast<std::size_t>(i) + 1]; ++e)
      y[entries_[e].column] += entries_[e].derivative * x[i];
  return y;
}

VectorXd Staircase::inverse(VectorXd w, const VectorXd& diagonal) const {
  VectorXd part;
  for (const auto& front : fronts_) {  // w ← Qᵀ w
    part = w(front.rows);
    for (Index k = 0; k < front.factors.size(); ++k) reflect(front.reflectors, front.factors[k], k, part);
    w(front.rows) = part;
  }
  VectorXd x = VectorXd::Zero(size());
  for (auto front = fronts_.rbegin(); front != fronts_.rend(); ++front) {  // x ← R⁻¹ w
    part = x(front->columns);
    for (Index i = front->count - 1; i >= 0; --i) {
      const int column = front->columns[static_cast<std::size_t>(i)];
      double right = w[pivot_row_[at(column)]];
      const Index beyond = part.size() - i - 1;
      if (i < front->upper.rows()) right -= front->upper.row(i).tail(beyond).dot(part.tail(beyond));
      part[i] = x[column] = right / diagonal[column];
    }
  }
  return x;
}

VectorXd Staircase::inverse_transposed(VectorXd w, const VectorXd& diagonal) const {
  VectorXd y = VectorXd::Zero(size());
  VectorXd part;
  for (const auto& front : fronts_) {  // y ← R⁻ᵀ w
    part = w(front.columns);
    for (Index i = 0; i < front.count; ++i) {
      const int column = front.columns[static_cast<std::size_t>(i)];
      const double value = part[i] / diagonal[column];
      y[pivot_row_[at(column)]] = value;
      const Index beyond = part.size() - i - 1;
      if (i < front.upper.rows()) part.tail(beyond) -= value * front.upper.row(i).tail(beyond).transpose();
    }
    w(front.columns) = part;
  }
  for (auto front = fronts_.rbegin(); front != fronts_.rend(); ++front) {  // y ← Q y
    part = y(front->rows);
    for (Index k = front->factors.size() - 1; k >= 0; --k) reflect(front->reflectors, front->factors[k], k, part);
    y(front->rows) = part;
  }
  return y;
}

VectorXd Staircase::solve(const VectorXd& right) const {
  return inverse(right.cwiseQuotient(row_scales_), diagonal_).cwiseProduct(column_scales_);
}

VectorXd Staircase::solve_transposed(const VectorXd& right) const {
  return inverse_transposed(right.cwiseProduct(column_scales_), diagonal_).cwiseQuotient(row_scales_);
}

Staircase::Extreme Staircase::largest() const {
  return dominant(
      size(), [&](const VectorXd& v) { return multiply(v); }, [&](const VectorXd& u) { return multiply_transposed(u); });
}

Staircase::Extreme Staircase::smallest() const {
  Extreme extreme = dominant(
      size(), [&](const VectorXd& v) { return inverse_transposed(v, perturbed_); },
      [&](const VectorXd& u) { return inverse(u, perturbed_); });
  extreme.value = 1.0 / extreme.value;
  return extreme;
}

double Staircase::condition() const {
  if (singular_) return std::numeric_limits<double>::infinity();
  return size() > 0 ? largest().value / smallest().value : 1.0;
}

}  // namespace costate
