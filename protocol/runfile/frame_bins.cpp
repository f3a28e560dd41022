#include "protocol/runfile/frame_bins.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>

#include "protocol/contract/input_error.hpp"
#include "protocol/runfile/cycles.hpp"
#include "protocol/runfile/spacing.hpp"

namespace diastole::runfile {
namespace {

constexpr double time_tolerance_s = 1e-6;  // a sample on a window's edge belongs to the window it opens

struct Samples {
  std::span<const double> time_s;
  std::span<const double> value_kPa;
  double spacing_s = 0;  // median
  std::vector<size_t> holes_before;
};

/// The mean pressures of one cycle, frame by frame, or why it cannot be used.
struct CycleMeans {
  std::vector<double> mean_kPa;
  std::string exclusion;
  bool frame_without_sample = false;
};

[[noreturn]] void fail(const RecordedRun& run, const std::string& place, std::string problem,
                       std::string remedy) {
  throw InputError({run.file, place, std::move(problem), std::move(remedy)});
}

/// Rows with from_s <= time < to_s.
std::pair<size_t, size_t> rows_within(const Samples& samples, double from_s, double to_s) {
  const auto& time_s = samples.time_s;
  const auto first = std::lower_bound(time_s.begin(), time_s.end(), from_s - time_tolerance_s);
  const auto last = std::lower_bound(first, time_s.end(), to_s - time_tolerance_s);
  return {static_cast<size_t>(first - time_s.begin()), static_cast<size_t>(last - time_s.begin())};
}

bool in_slices(const RecordedRun& run, std::optional<size_t> only, size_t row) {
  for (size_t i = 0; i < run.slices.size(); ++i) {
    const Slice& slice = run.slices[i];
    const auto behind = static_cast<int64_t>(row) - slice.first_trigger;
    if ((!only || *only == i) && behind >= 0 && behind < slice.triggers) return true;
  }
  return false;
}

/// The triggers whose cycles may enter: those of the slices, if there are slices.
SegmentTriggers imaged_triggers(const RecordedRun& run, size_t segment, std::optional<size_t> slice) {
  SegmentTriggers imaged = triggers_of(run, segment);
  if (run.slices.empty()) return imaged;
  std::erase_if(imaged.triggers,
                [&](const CycleTrigger& trigger) { return !in_slices(run, slice, trigger.row); });
  return imaged;
}

size_t choose_segment(const RecordedRun& run, const FrameBinOptions& options) {
  if (options.slice && *options.slice >= run.slices.size()) {
    fail(run, fmt::format("slice {}", *options.slice),
         fmt::format("does not exist; the run has {}", run.slices.size()), "Slices count from 0.");
  }
  if (options.segment) {
    if (*options.segment >= run.segments.size()) {
      fail(run, fmt::format("segment {}", *options.segment),
           fmt::format("does not exist; the run has {}", run.segments.size()), "Segments count from 0.");
    }
    if (imaged_triggers(run, *options.segment, options.slice).triggers.empty()) {
      fail(run, fmt::format("segment {}", *options.segment), "has no trigger",
           "Choose a segment with motion; `diastole inspect` lists them.");
    }
    return *options.segment;
  }
  for (size_t i = 0; i < run.segments.size(); ++i) {
    if (!imaged_triggers(run, i, options.slice).triggers.empty()) return i;
  }
  fail(run, "dataset /trigger/time_s", "holds no trigger within a segment",
       "Only a run with triggered cycles can be binned.");
}

void check_windows(const RecordedRun& run, const std::vector<FrameWindow>& windows, double interval_s) {
  if (windows.empty()) fail(run, "", "no frame is asked for", "Ask for at least one frame.");
  for (size_t k = 0; k < windows.size(); ++k) {
    const FrameWindow& window = windows[k];
    if (window.from_s >= 0 && window.to_s > window.from_s && window.to_s <= interval_s + time_tolerance_s) {
      continue;
    }
    fail(run, fmt::format("frame {}", k),
         fmt::format("spans {:g} to {:g} s, outside the cycle of {:g} s", window.from_s, window.to_s,
                     interval_s),
         "A schedule longer than the cycle runs into the next: take the frames' times from the images "
         "(TriggerTime), or if the scanner takes every n-th R-wave, say so (gate every n).");
  }
}

/// Why the cycle from trigger_s to end_s is not whole; empty if it is.
std::string why_not_whole(const Samples& samples, double trigger_s, double end_s) {
  const auto [first, last] = rows_within(samples, trigger_s, end_s);
  const double reach_s = reach_spacings * samples.spacing_s;
  if (first == last) return "no pressure was recorded in it";
  if (first == 0 && samples.time_s[first] - trigger_s > reach_s) return "the recording starts within it";
  if (last == samples.time_s.size() && end_s - samples.time_s[last - 1] > reach_s) {
    return "the recording ends within it";
  }
  for (size_t i = first; i < last; ++i) {
    if (std::isnan(samples.value_kPa[i])) return fmt::format("sample {} is missing", i);
  }
  for (const size_t hole : samples.holes_before) {
    const double before_s = samples.time_s[hole - 1];
    const double after_s = samples.time_s[hole];
    if (before_s + samples.spacing_s >= end_s || after_s - samples.spacing_s < trigger_s) continue;
    return fmt::format("{:.1f} ms without a sample before sample {}", 1e3 * (after_s - before_s), hole);
  }
  return {};
}

/// `windows` and `interval_s` count from `from_s`: the trigger, and the signal's delay behind it.
CycleMeans means_of_cycle(const Samples& samples, const std::vector<FrameWindow>& windows, double from_s,
                          double interval_s) {
  CycleMeans cycle{{}, why_not_whole(samples, from_s, from_s + interval_s)};
  if (!cycle.exclusion.empty()) return cycle;
  for (size_t k = 0; k < windows.size(); ++k) {
    const auto [first, last] = rows_within(samples, from_s + windows[k].from_s, from_s + windows[k].to_s);
    if (first == last) {
      cycle.exclusion = fmt::format("no sample falls into frame {}", k);
      cycle.frame_without_sample = true;
      return cycle;
    }
    const auto values = samples.value_kPa.subspan(first, last - first);
    cycle.mean_kPa.push_back(std::accumulate(values.begin(), values.end(), 0.0) /
                             static_cast<double>(values.size()));
  }
  return cycle;
}

/// Why the interval that triggers[i] begins is out of tolerance: any of its cycles is, or ends with the segment.
std::string irregular_interval(const SegmentTriggers& segment, size_t i, int64_t gate_every) {
  const auto& triggers = segment.triggers;
  if (triggers[i].cycle + gate_every + (segment.delayed ? 1 : 0) > segment.scheduled)
    return "the segment ends within its interval";
  for (size_t j = i; j < triggers.size() && triggers[j].cycle < triggers[i].cycle + gate_every; ++j) {
    if (!triggers[j].fault.empty()) return triggers[j].fault;
  }
  return {};
}

struct UsedCycle {
  double number;  // within the segment
  double from_s;  // the trigger, and the signal's delay behind it
  std::vector<double> mean_kPa;
};

FrameBin summarise(const Samples& samples, const FrameWindow& window, size_t k,
                   const std::vector<UsedCycle>& cycles) {
  const auto n = static_cast<double>(cycles.size());
  FrameBin bin{.window = window, .cycles = cycles.size()};
  double number_mean = 0;
  for (const UsedCycle& cycle : cycles) {
    bin.mean_kPa += cycle.mean_kPa[k] / n;
    number_mean += cycle.number / n;
  }
  double squares = 0, products = 0, numbers = 0, sample_squares = 0, sample_sum = 0;
  for (const UsedCycle& cycle : cycles) {
    const double deviation = cycle.mean_kPa[k] - bin.mean_kPa;
    squares += deviation * deviation;
    products += (cycle.number - number_mean) * deviation;
    numbers += (cycle.number - number_mean) * (cycle.number - number_mean);
    const auto [first, last] = rows_within(samples, cycle.from_s + window.from_s, cycle.from_s + window.to_s);
    for (size_t i = first; i < last; ++i) {
      const double from_mean = samples.value_kPa[i] - bin.mean_kPa;
      sample_sum += from_mean;
      sample_squares += from_mean * from_mean;
    }
    bin.samples += last - first;
  }
  const auto count = static_cast<double>(bin.samples);
  bin.sd_kPa = n > 1 ? std::sqrt(squares / (n - 1)) : 0;
  bin.drift_kPa_per_cycle = numbers > 0 ? products / numbers : 0;
  if (n > 2) {
    const double left = std::max(0.0, squares - bin.drift_kPa_per_cycle * products);
    bin.drift_se_kPa_per_cycle = std::sqrt(left / (n - 2) / numbers);
  }
  bin.sample_sd_kPa =
      count > 1 ? std::sqrt(std::max(0.0, sample_squares - sample_sum * sample_sum / count) / (count - 1))
                : 0;
  return bin;
}

int64_t scheduled_cycles(const RecordedRun& run, const FrameBinOptions& options,
                         const SegmentTriggers& segment) {
  if (run.slices.empty()) return segment.scheduled;
  int64_t cycles = 0;
  for (size_t i = 0; i < run.slices.size(); ++i)
    cycles += !options.slice || *options.slice == i ? run.slices[i].cycles : 0;
  return cycles;
}

/// The controller counts cycles through the whole run when it gates.
int64_t cycles_before_segment(const RecordedRun& run, size_t segment) {
  int64_t cycles = 0;
  for (size_t i = 0; i < segment; ++i) {
    const bool untriggered = run.segments[i].waveform == "hold" && triggers_of(run, i).triggers.empty();
    cycles += untriggered ? 0 : run.segments[i].cycles;
  }
  return cycles;
}

}  // namespace

double binned_interval_s(const RecordedRun& run, const FrameBinOptions& options) {
  return run.segments[choose_segment(run, options)].period_s * static_cast<double>(options.gate_every);
}

FrameBins bin_frames(const RecordedRun& run, const FrameBinOptions& options) {
  const auto channel = run.pressure.channels.find(options.channel);
  if (channel == run.pressure.channels.end()) {
    fail(run, fmt::format("dataset /pressure/{}", options.channel), "is not in this run",
         "`diastole inspect` lists the channels.");
  }
  FrameBins bins;
  bins.segment = choose_segment(run, options);
  const SegmentTriggers segment = imaged_triggers(run, bins.segment, options.slice);
  bins.period_s = run.segments[bins.segment].period_s;
  bins.interval_s = binned_interval_s(run, options);
  bins.scheduled_cycles = scheduled_cycles(run, options, segment);
  bins.triggers = segment.triggers.size();
  const auto windows =
      options.windows.empty() ? equal_windows(options.frames, bins.interval_s) : options.windows;
  check_windows(run, windows, bins.interval_s);

  const double spacing_s = median_spacing_s(run.pressure.time_s);
  const Samples samples{run.pressure.time_s, channel->second, spacing_s,
                        holes_before(run.pressure.time_s, spacing_s)};
  const int64_t cycles_before = cycles_before_segment(run, bins.segment);
  std::vector<UsedCycle> used;
  bool frames_too_short = false;
  for (size_t i = 0; i < segment.triggers.size(); ++i) {
    const CycleTrigger& trigger = segment.triggers[i];
    if ((cycles_before + trigger.cycle) % options.gate_every != 0) continue;
    const double from_s = trigger.time_s + options.delay_s;
    CycleMeans cycle = means_of_cycle(samples, windows, from_s, bins.interval_s);
    if (cycle.exclusion.empty()) cycle.exclusion = irregular_interval(segment, i, options.gate_every);
    if (cycle.exclusion.empty()) {
      used.push_back({static_cast<double>(trigger.cycle), from_s, std::move(cycle.mean_kPa)});
    } else {
      frames_too_short = frames_too_short || cycle.frame_without_sample;
      bins.excluded.push_back({i, trigger.time_s, std::move(cycle.exclusion)});
    }
  }
  if (used.empty()) {
    fail(run, fmt::format("segment {}", bins.segment),
         bins.excluded.empty()
             ? "has no gated cycle"
             : fmt::format("has no whole cycle; the first: {}", bins.excluded.front().reason),
         frames_too_short ? fmt::format("Ask for fewer frames: samples are {:.2f} ms apart.", 1e3 * spacing_s)
                          : "Record again, or choose another segment.");
  }
  for (size_t k = 0; k < windows.size(); ++k) {
    bins.frames.push_back(summarise(samples, windows[k], k, used));
  }
  return bins;
}

double cavity_resolution_kPa(const RecordedRun& run) {
  const auto found = run.rig.find("cavity_resolution_kPa");
  const auto* value = found == run.rig.end() ? nullptr : std::get_if<double>(&found->second);
  return value == nullptr ? 0 : *value;
}

double variance_of_mean(const FrameBin& bin, double resolution_kPa) {
  const double spread = bin.cycles > 1 ? bin.sd_kPa * bin.sd_kPa / static_cast<double>(bin.cycles)
                                       : bin.sample_sd_kPa * bin.sample_sd_kPa;
  return spread + resolution_kPa * resolution_kPa / 12;
}

}  // namespace diastole::runfile
