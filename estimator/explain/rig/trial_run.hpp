#pragma once
// A planned segment as the rig's model runs it, and the limits of the rig of a session.

#include <vector>

#include "estimator/explain/verdict/experiment_plan.hpp"
#include "estimator/model/session.hpp"

namespace diastole::explain {

ExperimentLimits limits_of(const rig::Session& session);

/// A segment's first cycles as the rig's model runs them: a second of rest, a ramp to the offset, the cycles, a ramp back.
struct TrialRun {
  rig::RunDrive drive;
  std::vector<double> sample_s;  ///< 300 Hz
  size_t last_first = 0;         ///< samples [last_first, last_end) of the last cycle; a hold has no such
  size_t last_end = 0;
  double repeats = 1.0;  ///< how many cycles the last one stands for
};
TrialRun trial_of(const runfile::Segment& segment, const rig::Session& session);

}  // namespace diastole::explain
