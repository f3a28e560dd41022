#include "estimator/sparse/sparse_cholesky.hpp"

#include <dlfcn.h>

#include <algorithm>
#include <new>
#include <utility>

namespace diastole {
namespace {

/// From now on, parallel regions that the calling thread meets in a library have one thread. CHOLMOD shares parts of its work between
/// four threads of GCC's OpenMP if it may: a forked process waits for ever for those that its parent had
/// (docs/decisions/0012-newton-and-factorisation.md), waiting threads spin, and what there is to share is small.
void keep_openmp_serial() {
  using SetLevels = void (*)(int);
  static const auto set_levels =
      reinterpret_cast<SetLevels>(dlsym(RTLD_DEFAULT, "omp_set_max_active_levels"));
  if (set_levels != nullptr) set_levels(0);
}

}  // namespace

CholeskyPattern::CholeskyPattern(std::vector<int> column_starts, std::vector<int> rows)
    : column_starts_(std::move(column_starts)), rows_(std::move(rows)) {
  cholmod_start(&common_);
  common_.print = 0;
  common_.supernodal = CHOLMOD_SUPERNODAL;
  common_.nmethods = 1;
  common_.method[0].ordering = CHOLMOD_METIS;
}

std::shared_ptr<const CholeskyPattern> CholeskyPattern::of(std::vector<int> column_starts,
                                                           std::vector<int> rows) {
  std::shared_ptr<CholeskyPattern> pattern(new CholeskyPattern(std::move(column_starts), std::move(rows)));
  cholmod_sparse matrix = pattern->matrix(nullptr);
  pattern->ordering_ = cholmod_analyze(&matrix, &pattern->common_);
  if (pattern->common_.status == CHOLMOD_OUT_OF_MEMORY) throw std::bad_alloc();
  return pattern->ordering_ == nullptr ? nullptr : pattern;
}

CholeskyPattern::~CholeskyPattern() {
  cholmod_free_factor(&ordering_, &common_);
  cholmod_finish(&common_);
}

cholmod_sparse CholeskyPattern::matrix(const double* values) const {
  cholmod_sparse matrix{};
  matrix.nrow = matrix.ncol = unknowns();
  matrix.nzmax = rows_.size();
  matrix.p = const_cast<int*>(column_starts_.data());
  matrix.i = const_cast<int*>(rows_.data());
  matrix.x = const_cast<double*>(values);
  matrix.stype = 1;
  matrix.itype = CHOLMOD_INT;
  matrix.xtype = values == nullptr ? CHOLMOD_PATTERN : CHOLMOD_REAL;
  matrix.dtype = CHOLMOD_DOUBLE;
  matrix.sorted = matrix.packed = 1;
  return matrix;
}

CholeskyFactor::CholeskyFactor(std::shared_ptr<const CholeskyPattern> pattern)
    : pattern_(std::move(pattern)) {
  cholmod_start(&common_);
  common_.print = 0;
  common_.supernodal = CHOLMOD_SUPERNODAL;
}

CholeskyFactor::~CholeskyFactor() {
  cholmod_free_factor(&factor_, &common_);
  cholmod_finish(&common_);
}

std::unique_ptr<const CholeskyFactor> CholeskyFactor::of(std::shared_ptr<const CholeskyPattern> pattern,
                                                         std::span<const double> values, double least_pivot) {
  std::unique_ptr<CholeskyFactor> factor(new CholeskyFactor(std::move(pattern)));
  if (!factor->factorise(values) || !factor->has_pivots_above(values, least_pivot)) return nullptr;
  return factor;
}

bool CholeskyFactor::factorise(std::span<const double> values) {
  cholmod_sparse matrix = pattern_->matrix(values.data());
  keep_openmp_serial();
  factor_ = cholmod_copy_factor(pattern_->ordering_, &common_);
  cholmod_factorize(&matrix, factor_, &common_);
  if (common_.status == CHOLMOD_OUT_OF_MEMORY) throw std::bad_alloc();
  return common_.status == CHOLMOD_OK && factor_->minor == pattern_->unknowns();
}

bool CholeskyFactor::has_pivots_above(std::span<const double> values, double least_pivot) const {
  // The diagonal of a supernodal factor: each supernode is a dense block, its own columns' rows first.
  const auto* supernodes = static_cast<const int*>(factor_->super);
  const auto* row_starts = static_cast<const int*>(factor_->pi);
  const auto* block_starts = static_cast<const int*>(factor_->px);
  const auto* permutation = static_cast<const int*>(factor_->Perm);
  const auto* numbers = static_cast<const double*>(factor_->x);
  for (size_t s = 0; s < factor_->nsuper; ++s) {
    const int rows = row_starts[s + 1] - row_starts[s];
    for (int j = 0; j < supernodes[s + 1] - supernodes[s]; ++j) {
      const double root = numbers[block_starts[s] + j * rows + j];
      const auto column = static_cast<size_t>(permutation[supernodes[s] + j]);
      if (!(root * root > least_pivot * values[pattern_->diagonal(column)])) return false;
    }
  }
  return true;
}

Eigen::MatrixXd CholeskyFactor::solve(Eigen::MatrixXd right_sides) const {
  cholmod_dense dense{};
  dense.nrow = dense.d = static_cast<size_t>(right_sides.rows());
  dense.ncol = static_cast<size_t>(right_sides.cols());
  dense.nzmax = static_cast<size_t>(right_sides.size());
  dense.x = right_sides.data();
  dense.xtype = CHOLMOD_REAL;
  dense.dtype = CHOLMOD_DOUBLE;
  keep_openmp_serial();
  cholmod_dense* solved = cholmod_solve(CHOLMOD_A, factor_, &dense, &common_);
  if (solved == nullptr) throw std::bad_alloc();
  std::copy_n(static_cast<const double*>(solved->x), right_sides.size(), right_sides.data());
  cholmod_free_dense(&solved, &common_);
  return right_sides;
}

}  // namespace diastole
