#pragma once
// The drive as files that the rig runs: points of an uploaded waveform, and an experiment beside them.

#include <string>

#include "estimator/shaping/drive_model.hpp"
#include "tools/diastole/shape/pump.hpp"

namespace diastole::shaping {

/// phase,fraction of a cycle, with what it is in comments.
std::string points_text(const PlannedCycle& cycle, const std::string& target);
/// An experiment that plays these points.
std::string experiment_text(const PlannedCycle& cycle, const CyclePlan& plan, const std::string& points_file);

}  // namespace diastole::shaping
