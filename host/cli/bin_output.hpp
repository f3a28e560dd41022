#pragma once
// The binned pressure as a table, as JSON and as a frames file for the estimator.

#include <nlohmann/json.hpp>
#include <string>

#include "protocol/runfile/frame_bins.hpp"

namespace diastole {

/// What was removed from the signal's times, and where that figure comes from ("given", "the run: catheter ...").
struct RemovedDelay {
  double delay_s = 0;
  std::string source;
};

nlohmann::json bins_as_json(const std::string& run, const runfile::FrameBins& bins,
                            const RemovedDelay& delay);

void show_bins(const runfile::FrameBins& bins, const RemovedDelay& delay);

/// NAME.frames.csv: frame,time_s,pressure_kPa,sigma_kPa, one row a frame, time_s the window's middle. sigma_kPa is the
/// standard error of the mean over the cycles and a step of the converter (`resolution_kPa`, 0 if unknown):
///   sigma^2 = sd^2 / cycles + resolution^2 / 12,
/// with sample_sd instead of sd / sqrt(cycles) if there is only one cycle. With `relative`, pressures are those above
/// frame 0's, whose own sigma enters all others.
std::string frames_csv(const runfile::FrameBins& bins, double resolution_kPa, bool relative);

}  // namespace diastole
