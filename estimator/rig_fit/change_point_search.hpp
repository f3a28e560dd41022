#pragma once
// When did it happen? Change points of effects that begin at one (effect.hpp, ChangePoints): a sensor's step, steps lost.
//
// From a change point on, the residuals hold the effect's lasting change D (of the whole run, were it there from the start).
// For every sample as the change point the drop of chi-square is known from sums over the samples after it,
//
//   gain(t) = (sum_{s >= t} D r)^2 / (sum_{s >= t} D^2 - what the fitted unknowns take up of it),
//
// a change-point scan by matched filter. The best one is shifted to where the simulated change correlates best with
// the residuals, and change points and all values are refined together. Effects of several change points
// go on until another one gains too little for having been chosen among so many samples.

#include <optional>

#include "estimator/rig_fit/rig_fit.hpp"

namespace diastole::rig {

struct FoundChangePoints {
  ModelTerm term;              ///< with its change_points
  std::vector<double> values;  ///< of the effect
  RigFit fit;                  ///< of the terms before and this one, from which further fits may start
  double gain = 0.0;           ///< of chi-square, for all change points
};

/// What the scan alone promises: one by one the lasting change of the size that fits best, all else linear. One
/// simulation; `find_change_points` takes some ten for each.
struct PromisedChangePoints {
  size_t count = 0;
  Eigen::VectorXd residuals;  ///< that would be left
};

/// None as of `find_change_points`.
std::optional<PromisedChangePoints> promise_change_points(const RigProblem& problem, const Session& session,
                                                          const RigFit& before, const Effect& effect);

/// Added to the residuals `before` left. None if no change point gains enough, or the effect has no change points.
/// Precondition: `before` is a fine fit of `problem` to all runs; `session` is the problem's.
std::optional<FoundChangePoints> find_change_points(const RigProblem& problem, const Session& session,
                                                    const RigFit& before, const Effect& effect);

}  // namespace diastole::rig
