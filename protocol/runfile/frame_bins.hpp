#pragma once
// Pressure averaged into the image frames of a cycle.
//
// Gated imaging builds one series of frames from many cycles, so a frame's load is the mean pressure over the
// same window of every cycle, counted from that cycle's own trigger:
//
//   trigger i      frame 0    frame 1           frame N-1
//   |--------------[--------)[--------)  ...  [--------)|   trigger i+1
//   t_i                                                  t_i + period
//
// With p_ik the mean of the samples of cycle i in window k (from_s <= t - t_i < to_s, compared to 1 us):
//   mean_kPa   mean of p_ik over the cycles i
//   sd_kPa     standard deviation of p_ik over the cycles (n-1); 0 if there is only one
//   drift      slope of p_ik against the cycle's number, least squares, kPa a cycle
// A cycle enters only if it is whole: a cycle that is not is left out of all frames, and told with its
// reason.

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "protocol/runfile/run.hpp"

namespace diastole::runfile {

/// A frame's time after the trigger.
struct FrameWindow {
  double from_s = 0;
  double to_s = 0;
};

/// `frames` windows of equal length that fill one period.
std::vector<FrameWindow> equal_windows(size_t frames, double period_s);

struct FrameBinOptions {
  size_t frames = 16;                     ///< equal windows of the period, unless `windows` is given
  std::vector<FrameWindow> windows = {};  ///< explicit windows; each must lie within the period
  std::optional<size_t> segment = {};     ///< default: the first segment with triggers
  std::string channel = "cavity_kPa";
};

struct FrameBin {
  FrameWindow window;
  double mean_kPa = 0;
  double sd_kPa = 0;  ///< over cycles
  double sample_sd_kPa =
      0;  ///< over all samples in the window: the pressure's change within it, and its noise
  double drift_kPa_per_cycle = 0;
  size_t cycles = 0;   ///< how many cycles' means went in
  size_t samples = 0;  ///< how many samples, over all cycles
};

struct ExcludedCycle {
  size_t cycle = 0;  ///< from 0 within the segment
  double trigger_s = 0;
  std::string reason;
};

struct FrameBins {
  size_t segment = 0;
  double period_s = 0;
  int64_t scheduled_cycles = 0;
  size_t triggers = 0;  ///< found in the segment
  std::vector<FrameBin> frames;
  std::vector<ExcludedCycle> excluded;
};

/// Throws InputError when the run has no such segment or channel, the segment has no trigger, a window leaves
/// the cycle, or no whole cycle is left (the message tells why the first was excluded).
FrameBins bin_frames(const RecordedRun& run, const FrameBinOptions& options);

}  // namespace diastole::runfile
