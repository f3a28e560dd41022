#pragma once
// Errors of effects' equations. A real part does what an effect's equations say to a tenth (right_to); what it does otherwise is in
// part alike wherever it acts, and in part another thing with each waveform:
//
//   e = 0.1 (sum_b a_b d_b + n o d),   a_b, n ~ N(0, 1)
//
// d: what the effect changes of the features; d_b: of those of one kind in one channel, within an octave of frequency. So an effect that is
// small beside another may be nothing but that one's error, unless it acts where the other does not.

#include <Eigen/Dense>

#include "estimator/explain/rig/effect_sets.hpp"

namespace diastole::explain {

/// ln of the odds of a set against the one without one of its effects where the equations of the others err so. `changes`: what each of
/// the set's effects changes of the features, a column each. Not a number if a fit that it needs does not settle.
double log_odds_beside_equation_errors(const rig::SessionProblem& problem, const EffectSet& set,
                                       const EffectSet& without, const Eigen::MatrixXd& changes,
                                       size_t effect);

}  // namespace diastole::explain
