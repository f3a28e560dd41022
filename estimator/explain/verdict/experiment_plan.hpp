#pragma once
// Experiments that a rig can run: segments within its limits, and their file (docs/experiments: format
// "diastole-experiment", version 1).

#include <string>
#include <vector>

#include "estimator/model/session.hpp"
#include "protocol/runfile/run.hpp"

namespace diastole::explain {

/// What the controller refuses beyond, and what this specimen has borne.
struct ExperimentLimits {
  rig::MotionLimits motion;
  double largest_mL = 40.0;  ///< the largest volume in the session's runs

  static ExperimentLimits of(const rig::Session& session);
  /// With a tenth to spare.
  [[nodiscard]] bool allow(const runfile::Segment& segment, const rig::Hose& hose) const;
};

struct PlannedExperiment {
  std::vector<runfile::Segment> segments;  ///< start_s is not used
  bool new_pump_sensor = false;            ///< asks for a transducer at the pump end that the session lacked
  bool volumes = false;                    ///< phase contrast beside it: every second cycle is imaged
  bool radius = false;                     ///< measured in an image of the specimen at rest
  bool stiffness = false;                  ///< C1 measured by a shear test
};

/// Large and small, fast and slow strokes of the named waveforms, preloads and holds, as many as the limits allow; some
/// fifteen seconds each.
std::vector<runfile::Segment> possible_segments(const ExperimentLimits& limits, const rig::Hose& hose);

/// "parabolic strokes of 40 mL in 0.8 s", "a hold at 30 mL for 20 s".
std::string words_of(const runfile::Segment& segment);

/// The file, with `remark` as its first comment.
std::string to_toml(const PlannedExperiment& experiment, const std::string& remark);

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
