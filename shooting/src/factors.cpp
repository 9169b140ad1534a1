#include "factors.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace costate {

namespace {

/// Is every derivative of the equations by the unknowns?
bool finite(const Shooting& shooting, const Shot& shot) {
  for (Eigen::Index i = 0; i < shooting.size(); ++i) {
    for (const auto& [column, derivative] : shooting.row(shot, i).gradient()) {
      if (column < shooting.size() && !std::isfinite(derivative)) return false;
    }
  }
  return true;
}

}  // namespace

void Factors::decompose(const Shooting& shooting, const Shot& shot, const Eigen::VectorXd& row_scales,
                        const Eigen::VectorXd& unknown_scales) {
  if (!small(shooting)) {
    size_ = 0;
    large_.emplace(shooting.decompose(shot));
    large_finite_ = finite(shooting, shot);
    large_row_scales_ = row_scales;
    large_unknown_scales_ = unknown_scales;
    return;
  }
  size_ = row_scales.size();
  lu_.fill(0.0);
  for (Eigen::Index i = 0; i < size_; ++i) {
    for (const auto& [column, derivative] : shot.rows()[static_cast<std::size_t>(i)].gradient()) {
      if (column < size_) lu_[static_cast<std::size_t>(i * size_ + column)] = derivative;
    }
  }
  eliminate(row_scales, unknown_scales);
}

void Factors::decompose(const Eigen::VectorXd& entries, const Eigen::VectorXd& row_scales,
                        const Eigen::VectorXd& unknown_scales) {
  size_ = row_scales.size();
  std::copy(entries.begin(), entries.end(), lu_.begin());
  eliminate(row_scales, unknown_scales);
}

void Factors::eliminate(const Eigen::VectorXd& row_scales, const Eigen::VectorXd& unknown_scales) {
  large_.reset();
  const Eigen::Index n = size_;
  const auto entry = [&](Eigen::Index i, Eigen::Index j) -> double& { return lu_[static_cast<std::size_t>(i * n + j)]; };
  for (Eigen::Index i = 0; i < n; ++i) {
    row_scales_[static_cast<std::size_t>(i)] = 1.0 / row_scales[i];
    unknown_scales_[static_cast<std::size_t>(i)] = unknown_scales[i];
    for (Eigen::Index j = 0; j < n; ++j) entry(i, j) *= unknown_scales[j] / row_scales[i];
  }
  for (Eigen::Index k = 0; k < n; ++k) {
    Eigen::Index best = k;
    for (Eigen::Index i = k + 1; i < n; ++i) {
      if (std::abs(entry(i, k)) > std::abs(entry(best, k))) best = i;
    }
    pivot_[static_cast<std::size_t>(k)] = best;
    if (best != k) {
      for (Eigen::Index j = 0; j < n; ++j) std::swap(entry(k, j), entry(best, j));
    }
    // The inverse of an infinite pivot would be 0, and so would what is solved for.
    const double pivot = entry(k, k);
    const double inverse = std::isfinite(pivot) ? 1.0 / pivot : std::numeric_limits<double>::quiet_NaN();
    for (Eigen::Index i = k + 1; i < n; ++i) {
      const double factor = entry(i, k) *= inverse;
      for (Eigen::Index j = k + 1; j < n; ++j) entry(i, j) -= factor * entry(k, j);
    }
    entry(k, k) = inverse;
  }
}

void Factors::correction(const Eigen::VectorXd& r, Eigen::VectorXd& x) const {
  if (large_) {
    x = -large_->solve(r);
    if (!large_finite_) x.setConstant(std::numeric_limits<double>::quiet_NaN());
    return;
  }
  const auto entry = [&](Eigen::Index i, Eigen::Index j) { return lu_[static_cast<std::size_t>(i * size_ + j)]; };
  x.resize(size_);
  for (Eigen::Index i = 0; i < size_; ++i) x[i] = -r[i] * row_scales_[static_cast<std::size_t>(i)];
  for (Eigen::Index k = 0; k < size_; ++k) std::swap(x[k], x[pivot_[static_cast<std::size_t>(k)]]);
  for (Eigen::Index i = 1; i < size_; ++i) {
    for (Eigen::Index j = 0; j < i; ++j) x[i] -= entry(i, j) * x[j];
  }
  for (Eigen::Index i = size_; i-- > 0;) {
    for (Eigen::Index j = i + 1; j < size_; ++j) x[i] -= entry(i, j) * x[j];
    x[i] *= entry(i, i);
  }
  for (Eigen::Index i = 0; i < size_; ++i) x[i] *= unknown_scales_[static_cast<std::size_t>(i)];
}

double Factors::amplification() const {
  if (large_) return large_->solve(large_row_scales_).cwiseQuotient(large_unknown_scales_).cwiseAbs().maxCoeff();
  const auto entry = [&](Eigen::Index i, Eigen::Index j) { return lu_[static_cast<std::size_t>(i * size_ + j)]; };
  std::array<double, most> sums{}, x{};
  for (Eigen::Index column = 0; column < size_; ++column) {
    x.fill(0.0);
    x[static_cast<std::size_t>(column)] = 1.0;
    for (Eigen::Index i = column + 1; i < size_; ++i) {
      for (Eigen::Index j = column; j < i; ++j)
        x[static_cast<std::size_t>(i)] -= entry(i, j) * x[static_cast<std::size_t>(j)];
    }
    for (Eigen::Index i = size_; i-- > 0;) {
      double& value = x[static_cast<std::size_t>(i)];
      for (Eigen::Index j = i + 1; j < size_; ++j) value -= entry(i, j) * x[static_cast<std::size_t>(j)];
      value *= entry(i, i);
      sums[static_cast<std::size_t>(i)] += std::abs(value);
    }
  }
  return *std::max_element(sums.begin(), sums.end());
}

}  // namespace costate
