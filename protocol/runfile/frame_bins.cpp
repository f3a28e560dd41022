#include "protocol/runfile/frame_bins.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>

#include "protocol/contract/input_error.hpp"
#include "protocol/runfile/spacing.hpp"

namespace diastole::runfile {
namespace {

constexpr double time_tolerance_s = 1e-6;  // a sample on a window's edge belongs to the window it opens
constexpr double period_tolerance = 0.01;  // of the period, between triggers

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

std::vector<double> triggers_of(const RecordedRun& run, const Segment& segment) {
  const double slack_s = 0.5 * period_tolerance * segment.period_s;
  std::vector<double> triggers_s;
  for (const double t : run.trigger_s) {
    if (t >= segment.start_s - slack_s && t < segment.end_s() - slack_s) triggers_s.push_back(t);
  }
  return triggers_s;
}

size_t choose_segment(const RecordedRun& run, const FrameBinOptions& options) {
  if (options.segment) {
    if (*options.segment >= run.segments.size()) {
      fail(run, fmt::format("segment {}", *options.segment),
           fmt::format("does not exist; the run has {}", run.segments.size()), "Segments count from 0.");
    }
    if (triggers_of(run, run.segments[*options.segment]).empty()) {
      fail(run, fmt::format("segment {}", *options.segment), "has no trigger",
           "Choose a segment with motion; `diastole inspect` lists them.");
    }
    return *options.segment;
  }
  for (size_t i = 0; i < run.segments.size(); ++i) {
    if (!triggers_of(run, run.segments[i]).empty()) return i;
  }
  fail(run, "dataset /trigger/time_s", "holds no trigger within a segment",
       "Only a run with triggered cycles can be binned.");
}

void check_windows(const RecordedRun& run, const std::vector<FrameWindow>& windows, double period_s) {
  if (windows.empty()) fail(run, "", "no frame is asked for", "Ask for at least one frame.");
  for (size_t k = 0; k < windows.size(); ++k) {
    const FrameWindow& window = windows[k];
    if (window.from_s >= 0 && window.to_s > window.from_s && window.to_s <= period_s + time_tolerance_s) {
      continue;
    }
    fail(run, fmt::format("frame {}", k),
         fmt::format("spans {} to {} s, outside the cycle of {} s", window.from_s, window.to_s, period_s),
         "A frame must lie within one cycle.");
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

CycleMeans means_of_cycle(const Samples& samples, const std::vector<FrameWindow>& windows, double trigger_s,
                          double period_s) {
  CycleMeans cycle{{}, why_not_whole(samples, trigger_s, trigger_s + period_s)};
  if (!cycle.exclusion.empty()) return cycle;
  for (size_t k = 0; k < windows.size(); ++k) {
    const auto [first, last] =
        rows_within(samples, trigger_s + windows[k].from_s, trigger_s + windows[k].to_s);
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

/// "the next trigger came after 1.31 s" when it is not one period later; empty for the last of a segment.
std::string irregular_trigger(std::span<const double> triggers_s, size_t i, double period_s) {
  if (i + 1 == triggers_s.size()) return {};
  const double interval_s = triggers_s[i + 1] - triggers_s[i];
  if (std::abs(interval_s - period_s) <= period_tolerance * period_s) return {};
  return fmt::format("the next trigger came after {:.4f} s, not after {:.4f} s", interval_s, period_s);
}

struct UsedCycle {
  double number;  // within the segment
  double trigger_s;
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
    const auto [first, last] =
        rows_within(samples, cycle.trigger_s + window.from_s, cycle.trigger_s + window.to_s);
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
  bin.sample_sd_kPa =
      count > 1 ? std::sqrt(std::max(0.0, sample_squares - sample_sum * sample_sum / count) / (count - 1))
                : 0;
  return bin;
}

}  // namespace

std::vector<FrameWindow> equal_windows(size_t frames, double period_s) {
  std::vector<FrameWindow> windows;
  const double length_s = period_s / static_cast<double>(frames);
  for (size_t k = 0; k < frames; ++k) {
    windows.push_back({static_cast<double>(k) * length_s, static_cast<double>(k + 1) * length_s});
  }
  return windows;
}

FrameBins bin_frames(const RecordedRun& run, const FrameBinOptions& options) {
  const auto channel = run.pressure.channels.find(options.channel);
  if (channel == run.pressure.channels.end()) {
    fail(run, fmt::format("dataset /pressure/{}", options.channel), "is not in this run",
         "`diastole inspect` lists the channels.");
  }
  FrameBins bins;
  bins.segment = choose_segment(run, options);
  const Segment& segment = run.segments[bins.segment];
  bins.period_s = segment.period_s;
  bins.scheduled_cycles = segment.cycles;
  const auto windows =
      options.windows.empty() ? equal_windows(options.frames, bins.period_s) : options.windows;
  check_windows(run, windows, bins.period_s);

  const double spacing_s = median_spacing_s(run.pressure.time_s);
  const Samples samples{run.pressure.time_s, channel->second, spacing_s,
                        holes_before(run.pressure.time_s, spacing_s)};
  const std::vector<double> triggers_s = triggers_of(run, segment);
  bins.triggers = triggers_s.size();
  std::vector<UsedCycle> used;
  bool frames_too_short = false;
  for (size_t i = 0; i < triggers_s.size(); ++i) {
    CycleMeans cycle = means_of_cycle(samples, windows, triggers_s[i], bins.period_s);
    if (cycle.exclusion.empty()) cycle.exclusion = irregular_trigger(triggers_s, i, bins.period_s);
    if (cycle.exclusion.empty()) {
      used.push_back({static_cast<double>(i), triggers_s[i], std::move(cycle.mean_kPa)});
    } else {
      frames_too_short = frames_too_short || cycle.frame_without_sample;
      bins.excluded.push_back({i, triggers_s[i], std::move(cycle.exclusion)});
    }
  }
  if (used.empty()) {
    fail(run, fmt::format("segment {}", bins.segment),
         fmt::format("has no whole cycle; the first: {}", bins.excluded.front().reason),
         frames_too_short ? fmt::format("Ask for fewer frames: samples are {:.2f} ms apart.", 1e3 * spacing_s)
                          : "Record again, or choose another segment.");
  }
  for (size_t k = 0; k < windows.size(); ++k) {
    bins.frames.push_back(summarise(samples, windows[k], k, used));
  }
  return bins;
}

}  // namespace diastole::runfile
