#pragma once
// The specimen's volume from its pressure, by the model's own curve and memories.

#include "estimator/rig/rig_model.hpp"
#include "estimator/shaping/drive_model.hpp"

namespace diastole::shaping {

/// The volume whose pressure, as often repeated and counted as the plan says, has this mean cycle.
PeriodicCurve specimen_volume(const DriveModel& of, const PeriodicCurve& cavity_kPa, Eigen::Index harmonics);

}  // namespace diastole::shaping
