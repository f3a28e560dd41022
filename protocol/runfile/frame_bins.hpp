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
// A cycle enters only if it is whole and its triggers are in time (cycles.hpp): one that is not is left out of all
// frames, and reported with its reason. Where a run has slices, only their cycles are imaged: dummy cycles and
// those between slices do not count at all.
//
// One wild cycle would make sd_kPa its own size. With `without_outliers` a cycle is left out that lies further from the middle
// cycle (the median of each frame) than eight times the median distance of all, and a step of the converter; the distance is the
// root mean square over the frames. Of fewer than five cycles none is known to be wild.
//
// What delays the signal (catheter, filter) by d shows at t + d what the pressure was at t. With
// `delay_s` = d, the samples from from_s + d to to_s + d make the frame.
//
// A scanner that takes every n-th R-wave only (`gate_every` n) has n periods for its frames: windows then count from
// every n-th trigger of the run.

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "protocol/runfile/frame_times.hpp"
#include "protocol/runfile/run.hpp"
#include "protocol/runfile/stream_rows.hpp"

namespace diastole::runfile {

struct FrameBinOptions {
  size_t frames = 16;                     ///< equal windows of the interval, unless `windows` is given
  std::vector<FrameWindow> windows = {};  ///< explicit windows; each must lie within the interval
  std::optional<size_t> segment = {};     ///< default: the slice's, or the first segment with triggers
  std::optional<size_t> slice = {};       ///< row of /protocol/slices; default: all
  std::string channel = "cavity_kPa";
  int64_t gate_every = 1;  ///< the interval is this many periods
  double delay_s = 0;      ///< of the signal behind the pressure
  bool without_outliers = false;
};

struct FrameBin {
  FrameWindow window;
  double mean_kPa = 0;
  double sd_kPa = 0;  ///< over cycles
  double sample_sd_kPa =
      0;  ///< over all samples in the window: the pressure's change within it, and its noise
  double drift_kPa_per_cycle = 0;
  double drift_se_kPa_per_cycle = 0;  ///< standard error of the slope; 0 for fewer than three cycles
  size_t cycles = 0;                  ///< how many cycles' means went in
  size_t samples = 0;                 ///< how many samples, over all cycles
};

struct ExcludedCycle {
  size_t cycle = 0;  ///< number of its trigger in the segment, from 0
  double trigger_s = 0;
  std::string reason;
};

struct FrameBins {
  size_t segment = 0;
  double period_s = 0;
  double interval_s = 0;         ///< gate_every periods
  int64_t scheduled_cycles = 0;  ///< of the segment, or of the slices
  size_t triggers = 0;           ///< found in the segment, or in the slices
  std::vector<FrameBin> frames;
  std::vector<ExcludedCycle> excluded;
  std::vector<ExcludedCycle> outliers;  ///< whole and in time, but wild
};

/// gate_every periods of the segment that `options` choose. Throws InputError as bin_frames does.
double binned_interval_s(const RecordedRun& run, const FrameBinOptions& options);

/// Throws InputError when the run has no such segment, slice or channel, the segment has no trigger, a window leaves
/// the interval, or no whole cycle is left (the message says why the first was excluded).
FrameBins bin_frames(const RecordedRun& run, const FrameBinOptions& options);
/// The same of a run without rows, and these: no more of them than a cycle's are in memory at a time.
FrameBins bin_frames(const RecordedRun& run, const RunRows& rows, const FrameBinOptions& options);

/// A step of the converter behind the cavity's pressure; 0 if the run does not state it.
double cavity_resolution_kPa(const RecordedRun& run);
/// Of a frame's mean, kPa^2: over the cycles (of one cycle: of its samples), and a step of the converter.
double variance_of_mean(const FrameBin& bin, double resolution_kPa);

}  // namespace diastole::runfile
