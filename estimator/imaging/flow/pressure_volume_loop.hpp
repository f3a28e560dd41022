#pragma once
// A cycle's pressure against the volume that flow has brought: the loop, the work that it encloses, and the stiffness along it.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "estimator/imaging/flow/flow_measurement.hpp"
#include "protocol/runfile/reader.hpp"

namespace diastole::imaging {

struct LoopPoint {
  double phase_s = 0;
  ValueWithError volume_mL, pressure_kPa;
  std::optional<ValueWithError> stiffness_kPa_per_mL;  ///< dp/dV along the loop; nothing where the flow turns
};

struct PressureVolumeLoop {
  std::string source;  ///< the run file, or the pressure's CSV
  std::vector<LoopPoint> points;
  ValueWithError
      work_mJ;  ///< integral of p dV once around, what a cycle does not return spread evenly over it
  size_t segment = 0;
  int64_t gate_every = 1;  ///< cycles of the pump in the images' interval
  size_t cycles = 0;       ///< that the pressure is the mean of
  double delay_s = 0;      ///< of the pressure's signal, taken off
  std::vector<Finding> findings;
};

/// A pressure trace `time_s,cavity_kPa` and its triggers `time_s` as a run of one segment. Throws InputError.
runfile::RecordedRun run_of_tables(const std::filesystem::path& pressure,
                                   const std::filesystem::path& trigger);

/// `segment`: default the first with triggers. Throws InputError if the images' interval is no whole number of the segment's periods, if the
/// volume falls while the run's pump fills, or as bin_frames does.
PressureVolumeLoop pressure_volume_loop(const FlowMeasurement& flow, const runfile::RunFile& file,
                                        std::optional<size_t> segment);

}  // namespace diastole::imaging
