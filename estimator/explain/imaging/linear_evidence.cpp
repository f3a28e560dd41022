#include "estimator/explain/imaging/linear_evidence.hpp"

#include <algorithm>
#include <cmath>

namespace diastole::explain {

using Eigen::Index;

Eigen::MatrixXd orthonormal_basis(const Eigen::MatrixXd& columns) {
  const Eigen::VectorXd lengths = columns.colwise().norm().cwiseMax(1e-300);
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(columns * lengths.cwiseInverse().asDiagonal());
  return qr.householderQ() * Eigen::MatrixXd::Identity(columns.rows(), qr.rank());
}

Eigen::RowVector3d by_cylindrical_motion(const ResidualRow& row) {
  const Eigen::Vector3d outwards = Eigen::Vector3d(row.X_mm[0], row.X_mm[1], 0.0).normalized();
  return {row.by_motion.dot(outwards), row.by_motion.dot(Eigen::Vector3d(-outwards[1], outwards[0], 0.0)),
          row.by_motion[2]};
}

LinearEvidence::LinearEvidence(const FieldFit& fit, const Eigen::MatrixXd& columns) {
  const Eigen::MatrixXd own = orthonormal_basis(fit.jacobian);
  const Eigen::MatrixXd across = own.topRows(columns.rows()).transpose() * columns;
  normal_ = columns.transpose() * columns - across.transpose() * across;
  gradient_ =
      columns.transpose() * fit.residuals - across.transpose() * (own.transpose() * fit.all_residuals());
}

LinearEvidence::Gain LinearEvidence::gain(const std::vector<Index>& chosen) const {
  Eigen::MatrixXd normal = normal_(chosen, chosen);
  const Eigen::VectorXd scale = normal.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  normal = scale.asDiagonal() * normal * scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(normal);
  const Eigen::VectorXd along = eigen.eigenvectors().transpose() * scale.cwiseProduct(gradient_(chosen));
  constexpr double independent = 1e-4;
  Gain result;
  for (Index i = 0; i < along.size(); ++i) {
    if (eigen.eigenvalues()[i] < independent) continue;
    result.chi_square += along[i] * along[i] / eigen.eigenvalues()[i];
    ++result.degrees;
  }
  return result;
}

double LinearEvidence::gain(Index column) const {
  const double size = normal_(column, column);
  return size > 0.0 ? gradient_[column] * gradient_[column] / size : 0.0;
}

double LinearEvidence::amount(Index column) const { return -gradient_[column] / normal_(column, column); }

LinearEvidence::Choice LinearEvidence::best_of(const std::vector<Index>& candidates) const {
  constexpr size_t most = 3;
  const double price = 2.0 + 2.0 * std::log(static_cast<double>(std::max<size_t>(1, candidates.size())));
  Choice best;
  Choice current;
  while (current.columns.size() < most) {
    Choice next;
    for (const Index candidate : candidates) {
      if (std::ranges::find(current.columns, candidate) != current.columns.end()) continue;
      std::vector<Index> with = current.columns;
      with.push_back(candidate);
      const double chi_square = gain(with).chi_square;
      if (chi_square > next.chi_square) next = {std::move(with), 0.0, chi_square};
    }
    if (next.columns.empty()) break;
    next.score = next.chi_square - price * static_cast<double>(next.columns.size());
    if (next.score > best.score) best = next;
    current = std::move(next);
  }
  return best;
}

}  // namespace diastole::explain
