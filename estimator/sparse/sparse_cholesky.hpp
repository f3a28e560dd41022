#pragma once
// Sparse symmetric positive definite matrices, factorised by CHOLMOD (supernodal Cholesky), ordered by METIS's nested dissection:
//
//   const auto pattern = CholeskyPattern::of(column_starts, rows);     // once
//   const auto factor = CholeskyFactor::of(pattern, values);           // of each matrix
//   if (factor) x = factor->solve(right_sides);
//
// Different factors, of one pattern too, may be made and used at the same time; one factor by one thread at a time.

#include <cholmod.h>

#include <Eigen/Core>
#include <memory>
#include <span>
#include <vector>

namespace diastole {

/// Which entries are stored, and the order in which they are eliminated.
class CholeskyPattern {
 public:
  /// The upper triangle by compressed columns; each column's rows rise, the last is the diagonal's. None where a factor would have more
  /// entries than CHOLMOD can count (two thousand million).
  static std::shared_ptr<const CholeskyPattern> of(std::vector<int> column_starts, std::vector<int> rows);
  ~CholeskyPattern();
  CholeskyPattern(const CholeskyPattern&) = delete;
  CholeskyPattern& operator=(const CholeskyPattern&) = delete;

  [[nodiscard]] size_t unknowns() const { return column_starts_.size() - 1; }
  [[nodiscard]] const std::vector<int>& column_starts() const { return column_starts_; }
  [[nodiscard]] const std::vector<int>& rows() const { return rows_; }
  /// Where the stored numbers have a column's diagonal entry.
  [[nodiscard]] size_t diagonal(size_t column) const {
    return static_cast<size_t>(column_starts_[column + 1]) - 1;
  }

 private:
  friend class CholeskyFactor;

  CholeskyPattern(std::vector<int> column_starts, std::vector<int> rows);
  /// With these numbers, or the pattern alone.
  [[nodiscard]] cholmod_sparse matrix(const double* values) const;

  std::vector<int> column_starts_, rows_;
  cholmod_common common_{};
  cholmod_factor* ordering_ = nullptr;
};

class CholeskyFactor {
 public:
  /// Of the matrix with these stored numbers. None if it is not positive definite, or has a pivot no greater than `least_pivot` times its
  /// diagonal entry.
  static std::unique_ptr<const CholeskyFactor> of(std::shared_ptr<const CholeskyPattern> pattern,
                                                  std::span<const double> values, double least_pivot = 0.0);
  ~CholeskyFactor();
  CholeskyFactor(const CholeskyFactor&) = delete;
  CholeskyFactor& operator=(const CholeskyFactor&) = delete;

  [[nodiscard]] Eigen::MatrixXd solve(Eigen::MatrixXd right_sides) const;
  [[nodiscard]] size_t entries() const { return factor_->xsize; }

 private:
  explicit CholeskyFactor(std::shared_ptr<const CholeskyPattern> pattern);
  bool factorise(std::span<const double> values);
  [[nodiscard]] bool has_pivots_above(std::span<const double> values, double least_pivot) const;

  std::shared_ptr<const CholeskyPattern> pattern_;
  mutable cholmod_common common_{};
  cholmod_factor* factor_ = nullptr;
};

}  // namespace diastole
