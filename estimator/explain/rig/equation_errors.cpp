#include "estimator/explain/rig/equation_errors.hpp"

#include <cmath>
#include <limits>
#include <map>
#include <tuple>

#include "estimator/explain/rig/set_fit.hpp"

namespace diastole::explain {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Features whose equation errors are alike: of a channel, of a kind, and of an octave, which is none at rest.
using Likeness = std::tuple<rig::Signal, rig::FeatureKind, int>;

Likeness likeness_of(const rig::FeatureBlock& block, const rig::Feature& feature) {
  constexpr int at_rest = -1000;
  const double cycle_s = block.cycles > 1.0 ? block.period_s : 2.0 * block.period_s;
  const bool has_frequency = feature.kind == rig::FeatureKind::repeats && feature.harmonic > 0.0;
  return {block.signal, feature.kind,
          has_frequency ? static_cast<int>(std::lround(std::log2(feature.harmonic / cycle_s))) : at_rest};
}

/// What an error that is alike wherever the part acts may change, one sd a column.
MatrixXd alike_errors(const rig::SegmentFeatures& features, const VectorXd& change) {
  std::map<Likeness, VectorXd> columns;
  for (const rig::FeatureBlock& block : features.blocks())
    for (size_t i = 0; i < block.features.size(); ++i) {
      const auto row = static_cast<Index>(block.first + i);
      VectorXd& column =
          columns.try_emplace(likeness_of(block, block.features[i]), VectorXd::Zero(change.size()))
              .first->second;
      column[row] = right_to * change[row];
    }
  MatrixXd all(change.size(), static_cast<Index>(columns.size()));
  Index at = 0;
  for (const auto& [likeness, column] : columns)
    all.col(at++) = column;
  return all;
}

}  // namespace

double log_odds_beside_equation_errors(const rig::SessionProblem& problem, const EffectSet& set,
                                       const EffectSet& without, const MatrixXd& changes, size_t effect) {
  rig::ModelError error = problem.error();
  MatrixXd repeated(changes.rows(), 0);
  for (Index other = 0; other < changes.cols(); ++other) {
    if (other == static_cast<Index>(effect)) continue;
    error.noise += right_to * right_to * changes.col(other).cwiseAbs2();
    const MatrixXd errors = alike_errors(problem.features(), changes.col(other));
    repeated.conservativeResize(Eigen::NoChange, repeated.cols() + errors.cols());
    repeated.rightCols(errors.cols()) = errors;
  }
  const auto log_posterior = [&](const EffectSet& fitted) {
    const EffectSet of = fitted.by_part ? fit_set_exactly(problem, fitted) : fitted;
    MatrixXd columns(changes.rows(), of.columns.cols() + repeated.cols());
    columns << of.columns, repeated;
    const rig::EvidenceFit fit = fit_with_shares(of.target(), columns, error, of.evidence.shares);
    if (!inference::is_settled(fit.termination)) return std::numeric_limits<double>::quiet_NaN();
    return of.log_posterior - of.evidence.log_evidence + fit.log_evidence;
  };
  return log_posterior(set) - log_posterior(without);
}

}  // namespace diastole::explain
