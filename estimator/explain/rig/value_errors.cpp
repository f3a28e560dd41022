#include "estimator/explain/rig/value_errors.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/explain/rig/part_strain.hpp"
#include "estimator/inference/information.hpp"

namespace diastole::explain {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

VectorXd error_factors(const LinearFeatures& features, const VectorXd& weight, const MatrixXd& precision,
                       const std::vector<Fold>& folds) {
  constexpr size_t fewest = 3;
  VectorXd factors = VectorXd::Ones(precision.rows());
  if (folds.size() < fewest) return factors;
  const MatrixXd& columns = features.columns;
  const MatrixXd covariance = inference::covariance_of_information(precision).matrix;
  const VectorXd u = covariance * (columns.transpose() * weight.cwiseProduct(features.target));
  const VectorXd weighted = weight.cwiseProduct(features.target - columns * u);
  VectorXd spread = VectorXd::Zero(u.size());
  for (const Fold& fold : folds) {
    VectorXd score = VectorXd::Zero(u.size());
    for (Index i = 0; i < weighted.size(); ++i)
      if (fold.held[static_cast<size_t>(i)]) score += weighted[i] * columns.row(i).transpose();
    spread += (covariance * score).cwiseAbs2();
  }
  const auto count = static_cast<double>(folds.size());
  for (Index i = 0; i < u.size(); ++i)
    if (covariance(i, i) > 0.0)
      factors[i] = std::max(1.0, std::sqrt(count / (count - 1.0) * spread[i] / covariance(i, i)));
  return factors;
}

VectorXd value_errors(const rig::SessionProblem& problem, const EffectSet& set) {
  const double of_equations = 0.5 * right_to * fineness(problem, set.model);  // a sd: they are right to two
  const VectorXd factors = error_factors({set.target(), set.columns}, set.evidence.variance.cwiseInverse(),
                                         set.precision_by_data(), folds_of(problem));
  const rig::RigModel base = problem.model({{}, {}, set.model.nuisances, set.model.prior});
  VectorXd errors(static_cast<Index>(set.model.values.size()));
  Index at = 0;
  for (const rig::ModelTerm& term : set.model.terms) {
    const std::vector<double> neutral = term.effect->neutral(base);
    const Port port = term.effect->text().port;
    for (size_t j = 0; j < neutral.size(); ++j, ++at) {
      const auto i = static_cast<size_t>(at);
      const rig::Unknown& unknown = set.unknowns[i];
      const double by_data = factors[at] * std::sqrt(set.covariance(at, at));
      const double size = std::abs(unknown.coordinate(set.model.values[i]) - unknown.coordinate(neutral[j]));
      const bool has_equations =
          is_amplitude(*term.effect, j) && (port == Port::drive || port == Port::specimen);
      errors[at] = has_equations ? std::hypot(by_data, of_equations * size) : by_data;
    }
  }
  return errors;
}

}  // namespace diastole::explain
