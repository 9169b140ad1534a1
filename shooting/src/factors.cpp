#include "factors.hpp"

#include <cmath>

namespace costate {

void Factors::decompose(const Shooting& shooting, const Shot& shot, const Eigen::VectorXd& row_scales,
                        const Eigen::VectorXd& unknown_scales) {
  const Eigen::Index n = row_scales.size();
  if (n > most || !shooting.cuts().empty()) {
    size_ = 0;
    large_.emplace(shooting.decompose(shot));
    return;
  }
  large_.reset();
  size_ = n;
  const auto entry = [&](Eigen::Index i, Eigen::Index j) -> double& { return lu_[static_cast<std::size_t>(i * n + j)]; };
  for (Eigen::Index i = 0; i < n; ++i) {
    row_scales_[static_cast<std::size_t>(i)] = 1.0 / row_scales[i];
    unknown_scales_[static_cast<std::size_t>(i)] = unknown_scales[i];
    for (Eigen::Index j = 0; j < n; ++j) entry(i, j) = 0.0;
    for (const auto& [column, derivative] : shot.rows()[static_cast<std::size_t>(i)].gradient()) {
      if (column < n) entry(i, column) = derivative / row_scales[i] * unknown_scales[column];
    }
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
    const double inverse = 1.0 / entry(k, k);
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

}  // namespace costate
