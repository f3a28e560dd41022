#pragma once
// The tangent of incompressible material without its Lagrange pressures, factorised by Cholesky's method
// (estimator/sparse):
//
//   K u + B' p = f      B u = g        has the solution of        (K + B' W B) u + B' p = f + B' W g,   B u = g,
//
// W diagonal and large. p starts from W (B u - g) and is corrected so until it stays (method of multipliers: M. Fortin and
// R. Glowinski, Augmented Lagrangian Methods, 1983): the error shrinks a thousandfold a correction. K + B' W B is
// positive definite exactly where the whole matrix has one negative eigenvalue for each pressure; it has a seventh of the unknowns
// less, and half the operations.
//
// Only where each pressure meets displacements that all meet one another (those of one element): condensation then adds no
// entry.

#include <Eigen/Dense>
#include <memory>
#include <span>
#include <vector>

#include "estimator/sparse/sparse_cholesky.hpp"

namespace diastole {

/// The pattern: its ordering is found once for all factors.
class CondensedPattern {
 public:
  /// Triplets counted from 1 of the lower triangle; the unknowns from `displacements` on are pressures. None if the pattern cannot
  /// be condensed (see above), or has other unknowns after the pressures.
  static std::shared_ptr<CondensedPattern> of(size_t displacements, size_t pressures,
                                              std::span<const int> rows, std::span<const int> columns);

 private:
  friend class CondensedFactor;

  /// Pressures that meet the same displacements.
  struct Group {
    std::vector<int> pressures;
    std::vector<int> displacements;  ///< rising
    std::vector<size_t> entries;     ///< triplets: [pressure][displacement]
    std::vector<int>
        places;  ///< in the matrix, of pairs of displacements: the upper triangle, column by column
  };

  CondensedPattern() = default;
  /// Whether the matrix can be factorised.
  bool map_displacements(std::span<const int> rows, std::span<const int> columns);
  bool map_pressures(std::span<const int> rows, std::span<const int> columns);
  bool map_places(Group& group) const;

  size_t displacements_ = 0;
  size_t pressures_ = 0;
  std::vector<size_t> entries_;  // triplet of each stored number of K
  std::vector<Group> groups_;
  std::shared_ptr<const CholeskyPattern> matrix_;  // K
};

class CondensedFactor {
 public:
  /// `values` of the pattern's triplets. None if the condensed matrix is not positive definite beyond rounding.
  static std::shared_ptr<const CondensedFactor> of(std::shared_ptr<const CondensedPattern> pattern,
                                                   std::span<const double> values);
  /// As SparseFactor::solve.
  void solve(std::span<double> right_sides, size_t count) const;
  /// One right-hand side without correcting the pressures: for a third of the time, relative errors of 1e-3. A correction of Newton's
  /// method with a kept factor is not better than that.
  void solve_roughly(std::span<double> right_side) const;
  [[nodiscard]] size_t entries() const { return factor_->entries(); }

 private:
  explicit CondensedFactor(std::shared_ptr<const CondensedPattern> pattern) : pattern_(std::move(pattern)) {}
  /// W, and B' W B added to the matrix.
  void condense(std::span<const double> values, std::vector<double>& matrix);
  void solve_corrected(std::span<double> right_sides, size_t count, int corrections) const;
  /// displacements += B' pressures.
  void add_pull(const Eigen::MatrixXd& pressures, Eigen::MatrixXd& displacements) const;
  /// pressures += B displacements.
  void add_growth(const Eigen::MatrixXd& displacements, Eigen::MatrixXd& pressures) const;

  std::shared_ptr<const CondensedPattern> pattern_;
  using Coupling = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  std::vector<Coupling> coupling_;  // B: a row a pressure of the group
  Eigen::VectorXd weights_;         // W
  std::unique_ptr<const CholeskyFactor> factor_;
};

}  // namespace diastole
