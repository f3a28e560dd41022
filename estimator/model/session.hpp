#pragma once
// The runs that a study names, read for the rig's model: the motion behind the steps, the samples of each channel, the
// gated volumes, and where in the session each run lies.

#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include "estimator/effects/effect_library.hpp"
#include "estimator/io/study.hpp"
#include "estimator/rig/simulation.hpp"
#include "protocol/runfile/run.hpp"

namespace diastole::rig {

enum class Channel { cavity, pump };
std::string_view name_of(Channel channel);  ///< "cavity_kPa", "pump_kPa"

/// Gated volumes of one segment with the triggers over which they were averaged.
struct GatedVolume {
  std::vector<double> trigger_s;
  runfile::FlowVolume measured;
};

struct SessionRun {
  RunDrive drive;  ///< place.name is the file's name before ".run.h5"
  std::vector<runfile::Segment> segments;
  std::vector<double> sample_s;
  std::map<Channel, std::vector<double>> pressure_kPa;  ///< NaN where a gap is declared
  std::vector<GatedVolume> volumes;
  double smoothed_mL =
      0.0;                  ///< how far drive.motion is from counts that no known motion follows; 0: one does
  std::string run_id = {};  ///< of the recording

  /// Of the first sample at this time or later, to a microsecond.
  [[nodiscard]] size_t row_at(double time_s) const {
    return static_cast<size_t>(std::ranges::lower_bound(sample_s, time_s - 1e-6) - sample_s.begin());
  }
};

/// Beyond these the controller refuses a motion.
struct MotionLimits {
  double flow_mL_s = 1860.0;
  double acceleration_mL_s2 = 1700.0;
  double pressure_kPa = 79.3;  ///< at the piston, from accelerating the fluid in the hose
};

struct Session {
  std::vector<SessionRun> runs;  ///< in the study's order
  RigModel base;                 ///< of the first run's /rig; its curve is not yet set
  std::map<std::string, double>
      tolerance_sd;  ///< of the first run's /rig: what it states of its parts (rig_fit/tolerance.hpp)
  EffectLibrary effects = {};  ///< that may be in it
  MotionLimits limits;         ///< of the first run's /rig; the controller's own where it states none
};

/// Throws InputError if the study names no runs or a run cannot be read.
Session read_session(const Study& study);

/// An effect that the study's model has already: its values, bounded, and its moments in the session's runs.
struct StatedEffect {
  const Effect* effect = nullptr;
  std::vector<double> values;
  std::vector<ChangePoint> change_points;
};
/// In the study's order; where it states no value the typical one. Throws InputError for an unknown effect.
std::vector<StatedEffect> stated_effects(const Study& study, const Session& session);

}  // namespace diastole::rig
