#pragma once
// Penalised weighted least squares for a displacement field:
//
//   E(q) = Σ wᵢ (gᵢ·q − yᵢ)² / σᵢ²  +  λ S(q)  +  |u|²/U²          H = A + λ S + M/U²,  A = Σ wᵢ gᵢgᵢᵀ/σᵢ²
//
// The last term counts as one measurement of the whole body: that it has moved by 0 ± U (mm RMS). Nothing that data or smoothness feel
// notices it; where no tag knows a rigid motion it keeps that motion within the size of what is seen.
//
// H⁻¹ is the covariance of q if the field were drawn from the prior that λ stands for (Wahba 1983, J. R. Stat.
// Soc. B 45:133): its standard errors hold the mean square of smoothing's own bias as well as the noise.
// One thread at a time; different instances at the same time.

#include <memory>
#include <span>
#include <vector>

#include "estimator/reconstruction/sobolev.hpp"
#include "estimator/sparse/sparse_cholesky.hpp"

namespace diastole {

/// One measured number: g·q = target with standard deviation sigma.
struct ObservationRow {
  Functional functional;
  double target = 0.0;
  double sigma = 1.0;
  double weight = 1.0;  ///< w: 0 leaves the row out
};

/// What a mesh needs once for all frames.
struct FieldForms {
  FieldForms(const HermiteMesh& mesh, const SobolevWeights& weights)
      : space(mesh),
        quadratic(space),
        pattern(quadratic.factor_pattern()),
        sobolev(sobolev_forms(space, quadratic, weights)) {}
  FieldForms(const FieldForms&) = delete;
  FieldForms& operator=(const FieldForms&) = delete;

  FieldSpace space;
  QuadraticForms quadratic;
  std::shared_ptr<const CholeskyPattern> pattern;
  SobolevForms sobolev;
};

class SmoothedSystem {
 public:
  /// `forms` must outlive this object.
  explicit SmoothedSystem(const FieldForms& forms);

  void set_rows(std::span<const ObservationRow> rows);
  /// U, from the next factorisation on; 1000 mm at first.
  void set_extent_of_motion(double rms_mm) { extent_of_motion_mm_ = rms_mm; }
  void factorise(double lambda);
  /// H = A + M/u², without smoothness: what the data alone determine (coverage.hpp).
  void factorise_without_smoothness(double amplitude_mm);
  /// The factor that `factorise` would make, for several λ at the same time; none where neither data nor so little smoothness hold the
  /// field.
  [[nodiscard]] std::unique_ptr<const CholeskyFactor> factor_at(double lambda) const;

  // All below belong to the last rows and the last factorisation.
  [[nodiscard]] Eigen::VectorXd solution() const;
  [[nodiscard]] Eigen::MatrixXd solve(const Eigen::MatrixXd& right_sides) const;
  /// Variances of functionals: diagonal of C H⁻¹ Cᵀ, solved in blocks.
  [[nodiscard]] std::vector<double> variances(std::span<const Functional> functionals) const;

  /// Rows √w g/σ, and √w y/σ. The matrix is made when it is first asked for.
  [[nodiscard]] const Eigen::SparseMatrix<double, Eigen::RowMajor>& weighted_rows() const;
  [[nodiscard]] const Eigen::VectorXd& weighted_targets() const { return targets_; }
  /// Of H q = Gᵀ W y: the solution's right side.
  [[nodiscard]] const Eigen::VectorXd& right_side() const { return right_side_; }
  /// How many rows have a weight.
  [[nodiscard]] size_t measured() const { return measured_; }
  [[nodiscard]] const FieldForms& forms() const { return forms_; }
  [[nodiscard]] double lambda() const { return lambda_; }

 private:
  /// Of A, λ S and M/U².
  [[nodiscard]] std::unique_ptr<const CholeskyFactor> factor_of(double lambda, double extent_mm) const;

  const FieldForms& forms_;
  /// The rows of one element: a column each.
  struct Block {
    std::vector<Eigen::Index> rows;
    Eigen::MatrixXd coefficients;
  };

  QuadraticForms::Values data_;
  std::vector<Block> blocks_;
  mutable Eigen::SparseMatrix<double, Eigen::RowMajor> rows_;
  Eigen::VectorXd right_side_;
  Eigen::VectorXd targets_;
  size_t measured_ = 0;
  double lambda_ = 0.0;
  double extent_of_motion_mm_ = 1000.0;
  std::unique_ptr<const CholeskyFactor> factor_;
};

}  // namespace diastole
