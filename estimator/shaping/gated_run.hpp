#pragma once
// A run as the shaping of a drive sees it: what the pump was asked for, and what volume the specimen took, each as the mean
// cycle, its times those of the wanted curve.
//
// Volumes come from /mr/flow of the segment where there is one, to half as many harmonics as it has phases; its level is not known from
// flow, and comes from the pressure, as everything does without /mr/flow: mean over cycles, the catheter's lag taken off, through
// the specimen's curve and memories (specimen_volume.hpp). Errors are the scatter of the cycles, or those that /mr/flow states.

#include <optional>
#include <string>

#include "estimator/shaping/drive_model.hpp"
#include "protocol/runfile/run.hpp"

namespace diastole::shaping {

struct GatedRun {
  std::string file;
  PeriodicCurve drive_mL = {};
  MeasuredCurve cavity_mL = {};
  std::string source;         ///< "gated volume" or "pressure"
  double zero_kPa = 0.0;      ///< of the transducer: its reading at rest before the motion
  double greatest_kPa = 0.0;  ///< that the specimen held in the mean cycle
  /// The cycle from which on the specimen's pressure does not go on as the cycles before say: something burst, slipped or opened.
  std::optional<size_t> changed_in_cycle = {};
};

/// The drive by which a specimen at rest would do what this run's did, which began otherwise filled: a level at the beginning is as good as
/// one of the piston. The first of several runs begins at rest.
PeriodicCurve drive_from_rest(const DriveModel& model, const GatedRun& run, bool is_first);

/// The comment of a points file by which a run knows how long after a cycle's beginning the wanted curve begins.
std::string lead_line(double lead_s);

/// Precondition: the run was read and checked. Throws InputError if it has no segment of this period with enough cycles, no
/// waveform of it, or if the model's sensors cannot be undone. `zero_kPa` is that of the first of several runs: after it a specimen
/// that has lost volume through a leak rests under suction.
GatedRun gated_run(const runfile::RecordedRun& run, const DriveModel& model, double period_s,
                   Eigen::Index harmonics, std::optional<double> zero_kPa = {});

}  // namespace diastole::shaping
