#include "estimator/explain/imaging/linear_evidence.hpp"

#include <algorithm>
#include <cmath>

namespace diastole::explain {

using Eigen::Index;

LinearEvidence::LinearEvidence(const FieldFit& fit, const Eigen::MatrixXd& columns) {
  const Eigen::MatrixXd across = fit.jacobian.topRows(columns.rows()).transpose() * columns;
  normal_ = columns.transpose() * columns - across.transpose() * fit.covariance * across;
  Eigen::VectorXd all(fit.residuals.size() + fit.priors.size());
  all << fit.residuals, fit.priors;
  gradient_ = columns.transpose() * fit.residuals -
              across.transpose() * (fit.covariance * (fit.jacobian.transpose() * all));
}

LinearEvidence::Gain LinearEvidence::gain(const std::vector<Index>& chosen) const {
  const auto count = static_cast<Index>(chosen.size());
  Eigen::MatrixXd normal(count, count);
  Eigen::VectorXd gradient(count);
  Eigen::VectorXd scale(count);
  for (Index i = 0; i < count; ++i)
    scale[i] = 1.0 / std::sqrt(std::max(
                         normal_(chosen[static_cast<size_t>(i)], chosen[static_cast<size_t>(i)]), 1e-300));
  for (Index i = 0; i < count; ++i) {
    gradient[i] = scale[i] * gradient_[chosen[static_cast<size_t>(i)]];
    for (Index j = 0; j < count; ++j)
      normal(i, j) =
          scale[i] * scale[j] * normal_(chosen[static_cast<size_t>(i)], chosen[static_cast<size_t>(j)]);
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(normal);
  const Eigen::VectorXd along = eigen.eigenvectors().transpose() * gradient;
  constexpr double independent = 1e-4;
  Gain result;
  for (Index i = 0; i < count; ++i) {
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
