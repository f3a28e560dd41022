#include "estimator/rig_fit/base_fit.hpp"

#include <cmath>
#include <utility>

namespace diastole::rig {

LinearisedModel declared_rig(const SessionProblem& problem, SessionModel with) {
  // Of the modulus: its square is below the model's own error.
  constexpr double small = 0.03;
  constexpr int most_rounds = 3;
  LinearisedModel declared{.at = std::move(with), .there = {}, .columns = {}};
  declared.at.nuisances = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(problem.nuisances().size()));
  for (int round = 0; round < most_rounds; ++round) {
    declared.columns = problem.nuisance_columns(declared.at, declared.there);
    const EvidenceFit fit = fit_with_shares(declared.target(problem), declared.columns, problem.error(),
                                            problem.error().prior.share);
    const double moved = std::abs(fit.estimate[0] - declared.at.nuisances[0]) * problem.nuisances()[0].sd;
    declared.at.nuisances.head(basic_nuisances) = fit.estimate.head(basic_nuisances);
    if (moved < small) {
      declared.there = problem.predicted_features(std::span(&declared.at, 1));
      break;
    }
  }
  return declared;
}

}  // namespace diastole::rig
