#pragma once
// Sparse factorisation (MUMPS) of a symmetric indefinite matrix, L D L^T with pivoting, or of a general one, L U: the
// ordering is found once for a pattern, factors are remade for new values, and any number of right-hand sides is
// solved at once.
//
// That of a symmetric matrix also counts negative pivots, the matrix's negative eigenvalues: a stable equilibrium
// of the mixed problem has exactly one for each Lagrange pressure.
//
// Not copyable; one instance is used by one thread at a time, and different instances never at the same time
// (MUMPS's sequential library shares its state).

#include <memory>
#include <span>

namespace diastole {

struct FactorResult {
  bool singular = false;
  size_t negative_pivots = 0;  ///< of a symmetric matrix
};

enum class MatrixKind { symmetric, general };

class SparseFactor {
 public:
  /// Triplets counted from 1, several of one place being summed: the lower (or upper) triangle of a symmetric matrix,
  /// all of a general one. `rows` and `columns` must outlive the factor.
  SparseFactor(size_t size, std::span<const int> rows, std::span<const int> columns,
               MatrixKind kind = MatrixKind::symmetric);
  ~SparseFactor();
  SparseFactor(const SparseFactor&) = delete;
  SparseFactor& operator=(const SparseFactor&) = delete;

  /// Throws std::bad_alloc if memory is exhausted; a singular matrix is a result.
  FactorResult factorise(std::span<double> values);

  /// Numbers stored in the last factors: their fill. 0 before the first factorise().
  [[nodiscard]] size_t entries() const;

  /// Replaces right-hand sides by solutions: `count` columns of `size` numbers, one after the other.
  /// Precondition: the last factorise() was not singular.
  void solve(std::span<double> right_sides, size_t count = 1);

 private:
  struct Instance;
  std::unique_ptr<Instance> instance_;
};

}  // namespace diastole
