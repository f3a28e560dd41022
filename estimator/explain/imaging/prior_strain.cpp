#include "estimator/explain/imaging/prior_strain.hpp"

#include <cmath>

#include "estimator/inference/deleted_residual.hpp"

namespace diastole::explain {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

PriorStrain prior_strain(const FieldFit& fit) {
  constexpr double determined_by_others = 1e-6;  // of a prior's own variance: less is rounding
  const Index count = fit.priors.size();
  const MatrixXd slopes = fit.jacobian.bottomRows(count);
  // What moves no residual moves no prior either: its unknowns' infinite variances count for nothing here.
  const MatrixXd covariance = fit.covariance.array().isFinite().select(fit.covariance, 0.0);
  const MatrixXd left = MatrixXd::Identity(count, count) - slopes * covariance * slopes.transpose();
  PriorStrain strain{.deleted = VectorXd::Zero(count), .off = VectorXd::Zero(count)};
  for (Index i = 0; i < count; ++i) {
    const auto deleted = inference::deleted_residual(fit.priors[i], slopes.row(i).transpose(), covariance);
    if (!deleted) continue;
    strain.deleted[i] = deleted->value;
    strain.off[i] = deleted->value * std::sqrt(deleted->share);
  }
  const Eigen::SelfAdjointEigenSolver<MatrixXd> combinations(left);
  for (Index i = 0; i < count; ++i) {
    const double share = combinations.eigenvalues()[i];
    if (!(share > determined_by_others)) continue;
    const double residual = combinations.eigenvectors().col(i).dot(fit.priors);
    strain.chi_square += residual * residual / share;
    strain.degrees += 1.0;
  }
  return strain;
}

}  // namespace diastole::explain
