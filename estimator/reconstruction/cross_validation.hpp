#pragma once
// The smoothing weight λ by generalised cross-validation (Golub, Heath, Wahba 1979):
//
//   V(λ) = N RSS(λ) / (N − tr K(λ))²          K = G H⁻¹ Gᵀ, the matrix that makes fitted values of measured ones
//
// tr K, the field's effective degrees of freedom, is estimated with random signs z (Hutchinson 1990):
// E[zᵀ K z] = tr K. The same signs serve every λ, so that V is smooth; with 24 of them tr K is off by some units,
// which N − tr K (thousands) does not feel.

#include <vector>

#include "estimator/reconstruction/smoothed_system.hpp"

namespace diastole {

struct CrossValidationPoint {
  double lambda;
  double score;               ///< V, dimensionless: near 1 where sigma is right
  double degrees_of_freedom;  ///< tr K
};

struct CrossValidation {
  double lambda = 0.0;
  bool at_edge = false;                     ///< the least score lies at an end of the range searched
  std::vector<CrossValidationPoint> curve;  ///< in order of λ
};

/// Random signs, one column for each of 24 probes; the same for the same size.
Eigen::MatrixXd random_signs(Eigen::Index rows);

/// Gᵀz: as long as the rows are the same, so is this.
Eigen::MatrixXd seen_signs(const SmoothedSystem& system);

/// Of the system's present factorisation.
double stochastic_trace(const SmoothedSystem& system, const Eigen::MatrixXd& seen_signs);
/// E[(z - K z)²] of each row: the share of a measured number's variance that is left in its residual. Their sum over
/// the rows that count, tr[(1 - K)²], is what χ² is to be compared with; it is less than N - tr K when K smooths.
Eigen::VectorXd residual_shares(const SmoothedSystem& system, const Eigen::MatrixXd& signs);

/// Searches λ from 1 to 10^8, by decades (several at the same time) and then by golden section to `fineness` decades. Leaves the system
/// factorised at the λ found.
CrossValidation choose_lambda(SmoothedSystem& system, double fineness = 0.1);

}  // namespace diastole
