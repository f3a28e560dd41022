#pragma once
// What runs teach of the rig: the values of the plant's effects (leaks, gas, hose, backlash, gain ...) that bring the model's mean cycle of
// volume nearest to what was measured. No verdict, as `diastole explain` makes it: effects that look alike share what they
// explain, and only what the model then predicts counts.

#include "estimator/shaping/gated_run.hpp"

namespace diastole::shaping {

/// Bounded least squares over the harmonics of all runs, errors 0.2 % of `range_mL` and 2 % of the harmonic beside the measured ones; each value
/// is, in its search coordinate, within what the library calls typical of where it was. The level counts in the first run alone:
/// later ones begin with what that one has lost. Without runs the model itself.
DriveModel fitted_model(const DriveModel& model, const std::vector<GatedRun>& runs, double range_mL);

}  // namespace diastole::shaping
