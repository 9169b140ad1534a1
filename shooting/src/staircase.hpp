/// \file
/// Orthogonal factorisation of the Jacobian of multiple shooting. Private to the shooting library.
#pragma once

#include <costate/jet.hpp>

#include <Eigen/Core>

#include <optional>

namespace costate {

/// S = Q R for S = D_r⁻¹ A D_c, where A ∈ ℝᴺˣᴺ is sparse and its columns come in blocks: first the border (the unknowns of the
/// problem, which may appear in any row), then one block for each node of the arcs, in order. Rows come in any order; a matching
/// row holds two adjacent blocks and the border.
///
/// Blocks are eliminated in order and the border last. The front of a block are the rows, given or left over from earlier
/// fronts, that hold it first; Householder reflections make its columns upper triangular, the top rows are rows of R, the others go
/// on to the next block they hold. For a chain of blocks this is the structured orthogonal factorisation of S. J. Wright (SIAM J.
/// Sci. Stat. Comput. 13 (1992) 742–764): time and memory are linear in the number of blocks, and because every step is orthogonal
/// the solution is backward stable whatever the transition matrices are. Gaussian elimination with row interchanges is not: its
/// growth can be exponential in the number of blocks (SIAM J. Sci. Comput. 14 (1993) 231–238).
///
/// A singular matrix is factorised as well: a column of a front with too few rows has the pivot 0 and one of the rows that are left
/// over after the border.
class Staircase {
 public:
  /// Sizes of the border and of the node blocks; together N.
  struct Layout {
    int border = 0;
    std::vector<int> blocks{};
  };

  /// A singular value and its vectors of unit length.
  struct Extreme {
    double value;
    Eigen::VectorXd right, left;
  };

  /// `rows` are those of A. Scales are D_r = diag(row_scales) and D_c = diag(column_scales), all positive.
  /// \throws BadInput if a size is negative, the matrix is not square, a scale is not positive and finite or missing, or an entry is
  /// in a column that does not exist.
  Staircase(const std::vector<Jet::Gradient>& rows, const Layout& layout, const Eigen::VectorXd& row_scales,
            const Eigen::VectorXd& column_scales);

  [[nodiscard]] Eigen::Index size() const { return row_scales_.size(); }

  /// x of A x = right. Not finite if a pivot is exactly 0.
  [[nodiscard]] Eigen::VectorXd solve(const Eigen::VectorXd& right) const;
  /// x of Aᵀ x = right. Not finite if a pivot is exactly 0.
  [[nodiscard]] Eigen::VectorXd solve_transposed(const Eigen::VectorXd& right) const;

  /// Is a pivot |Rⱼⱼ| no more than the rounding errors of its column of S, or not a number? Sufficient only: a matrix may be singular
  /// to working precision without such a pivot, and then condition() is of the order of 1/ε.
  [[nodiscard]] bool singular() const { return singular_; }
  /// 2-norm condition number of S, from power iterations on SᵀS and its inverse: a lower bound, close because both run until they
  /// stand still. Infinite if singular().
  [[nodiscard]] double condition() const;
  /// Right singular vector of the smallest singular value of S, of unit length: the combination of the unknowns, each in its
  /// scale, that the rows determine least. Pivots that are 0 to rounding count as rounding errors.
  [[nodiscard]] Eigen::VectorXd weakest() const { return smallest().right; }
  /// Left singular vector of the smallest singular value: the combination of the rows, each over its scale, that is nearest to
  /// vanishing.
  [[nodiscard]] Eigen::VectorXd weakest_rows() const { return smallest().left; }

  /// The first row, or column, without an entry that differs from 0.
  [[nodiscard]] std::optional<int> empty_row() const { return empty_row_; }
  [[nodiscard]] std::optional<int> empty_column() const { return empty_column_; }

 private:
  /// What one block leaves behind. With m rows and s columns of its block there are p = min(m, s) reflections.
  struct Front {
    int count;                     ///< s
    std::vector<int> rows{};       ///< m; the first p become rows of R
    std::vector<int> columns{};    ///< of the block, then the others of the front
    Eigen::MatrixXd reflectors{};  ///< m × p, below the diagonal: Householder vectors without their leading 1
    Eigen::VectorXd factors{};     ///< p: the reflections are I - factor v vᵀ
    /// p × columns: rows of R, right of the diagonal.
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> upper{};
  };
  /// Rows of a front that are not rows of R, dense on its remaining columns.
  struct Carried {
    std::vector<int> rows;
    std::vector<int> columns;
    Eigen::MatrixXd values;
  };

  void check(const std::vector<Jet::Gradient>& rows, const Layout& layout) const;
  void scale(const std::vector<Jet::Gradient>& rows);
  void factorise(const Layout& layout);
  /// Factorises the front of the columns first, …, first + count - 1; what is left of it is returned.
  Carried eliminate(int first, int count, int border, const std::vector<int>& own, const std::vector<Carried>& carried);
  void name_pivots();

  [[nodiscard]] Eigen::VectorXd multiply(const Eigen::VectorXd& x) const;             ///< S x
  [[nodiscard]] Eigen::VectorXd multiply_transposed(const Eigen::VectorXd& x) const;  ///< Sᵀ x
  /// S⁻¹ w and S⁻ᵀ w, with the given diagonal of R.
  [[nodiscard]] Eigen::VectorXd inverse(Eigen::VectorXd w, const Eigen::VectorXd& diagonal) const;
  [[nodiscard]] Eigen::VectorXd inverse_transposed(Eigen::VectorXd w, const Eigen::VectorXd& diagonal) const;
  [[nodiscard]] Extreme largest() const;
  [[nodiscard]] Extreme smallest() const;

  Eigen::VectorXd row_scales_, column_scales_;
  // S by rows: row i has the entries begin_[i], …, begin_[i + 1] - 1.
  std::vector<std::size_t> begin_;
  std::vector<Jet::Entry> entries_;
  std::vector<Front> fronts_;
  std::vector<int> position_;   ///< of a column in the front under construction, else -1
  std::vector<int> pivot_row_;  ///< of each column
  Eigen::VectorXd diagonal_;    ///< Rⱼⱼ of each column j
  Eigen::VectorXd perturbed_;   ///< the same, but at least the rounding error of the column
  bool singular_ = false;
  std::optional<int> empty_row_, empty_column_;
};

}  // namespace costate
