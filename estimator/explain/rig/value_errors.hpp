#pragma once
// How well the values of a set's effects are known: by the data, by waveforms that err alike, by equations that are nearly right.
//
// Independent errors of all features are the least. An effect's equations are of a plain part: those of a real one err alike over
// a whole waveform, and otherwise over the next. The scores of the waveforms show what that does to the values: the covariance by
// clusters,
//
//   V = F/(F-1) N^-1 (sum over folds s s') N^-1,   s = K' D^-1 (z - K u) of a fold, N the precision without the sizes' priors
//
// (K.-Y. Liang, S. L. Zeger, Biometrika 73 (1986) 13), counts where it is the larger one. What all waveforms have in common no data
// show: a size at drive or specimen is right to a tenth (two sds), or to as much less as the rig's parts are finer than described. What
// an instrument does is what its effect says.

#include <Eigen/Dense>

#include "estimator/explain/rig/effect_sets.hpp"
#include "estimator/explain/rig/held_out.hpp"

namespace diastole::explain {

/// The larger of the standard errors by folds and by independent features, over the latter. Ones with fewer than three folds.
Eigen::VectorXd error_factors(const LinearFeatures& features, const Eigen::VectorXd& weight,
                              const Eigen::MatrixXd& precision, const std::vector<Fold>& folds);

/// Standard errors of the values' coordinates; infinite where the data do not determine one.
Eigen::VectorXd value_errors(const rig::SessionProblem& problem, const EffectSet& set);

}  // namespace diastole::explain
