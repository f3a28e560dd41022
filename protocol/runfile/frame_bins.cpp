#include "protocol/runfile/frame_bins.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>

#include "protocol/contract/input_error.hpp"
#include "protocol/runfile/cycles.hpp"
#include "protocol/runfile/layout.hpp"
#include "protocol/runfile/spacing.hpp"
#include "protocol/signal/median.hpp"

namespace diastole::runfile {
namespace {

constexpr double time_tolerance_s = 1e-6;  // a sample on a window's edge belongs to the window it opens

/// The samples of one frame in one cycle.
struct FrameSamples {
  size_t count = 0;
  double mean_kPa = 0;
  double squares = 0;  ///< of what each is from that mean
};

/// What one cycle holds, frame by frame, or why it cannot be used.
struct CycleFrames {
  std::vector<FrameSamples> frames;
  std::string exclusion;
  bool frame_without_sample = false;
};

[[noreturn]] void fail(const RecordedRun& run, const std::string& place, std::string problem,
                       std::string remedy) {
  throw InputError({run.file, place, std::move(problem), std::move(remedy)});
}

struct Samples {
  size_t first = 0;  ///< row of the run
  std::span<const double> time_s;
  std::span<const double> value_kPa;

  /// Those with from_s <= time < to_s.
  [[nodiscard]] Samples within(double from_s, double to_s) const {
    const auto begin = std::lower_bound(time_s.begin(), time_s.end(), from_s - time_tolerance_s);
    const auto end = std::lower_bound(begin, time_s.end(), to_s - time_tolerance_s);
    const auto at = static_cast<size_t>(begin - time_s.begin()), count = static_cast<size_t>(end - begin);
    return {first + at, time_s.subspan(at, count), value_kPa.subspan(at, count)};
  }
};

/// Goes through a channel's samples forward, with those of one window in memory.
class SamplesInOrder {
 public:
  SamplesInOrder(const StreamRows& rows, const Series& value_kPa) : rows_(rows), value_kPa_(value_kPa) {}

  /// Samples with from_s <= time < to_s; `from_s` is not less than before. They live until the next call.
  Samples within(double from_s, double to_s) {
    const auto gone =
        std::lower_bound(time_s_.begin(), time_s_.end(), from_s - time_tolerance_s) - time_s_.begin();
    time_s_.erase(time_s_.begin(), time_s_.begin() + gone);
    values_kPa_.erase(values_kPa_.begin(), values_kPa_.begin() + gone);
    first_ += static_cast<size_t>(gone);
    while (first_ + time_s_.size() < size() && (time_s_.empty() || time_s_.back() < to_s))
      load(from_s);
    return Samples{first_, time_s_, values_kPa_}.within(from_s, to_s);
  }
  [[nodiscard]] size_t size() const { return rows_.time_s.size(); }
  [[nodiscard]] const Spacing& spacing() const { return rows_.spacing(); }

 private:
  void load(double from_s) {
    const size_t first = first_ + time_s_.size(), count = std::min(Series::block_rows, size() - first);
    const auto time_s = rows_.time_s.rows(first, count, memory_);
    const auto earlier =
        std::lower_bound(time_s.begin(), time_s.end(), from_s - time_tolerance_s) - time_s.begin();
    const auto skipped = time_s_.empty() ? static_cast<size_t>(earlier) : 0;
    time_s_.insert(time_s_.end(), time_s.begin() + static_cast<std::ptrdiff_t>(skipped), time_s.end());
    first_ += skipped;
    const auto values_kPa = value_kPa_.rows(first + skipped, count - skipped, memory_);
    values_kPa_.insert(values_kPa_.end(), values_kPa.begin(), values_kPa.end());
  }

  const StreamRows& rows_;
  const Series& value_kPa_;
  size_t first_ = 0;  // row of time_s_.front()
  std::vector<double> time_s_, values_kPa_, memory_;
};

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

/// Why the cycle from trigger_s to end_s, which has these samples, is not whole; empty if it is.
std::string why_not_whole(const Samples& cycle, const SamplesInOrder& all, double trigger_s, double end_s) {
  const double spacing_s = all.spacing().median_s, reach_s = reach_spacings * spacing_s;
  if (cycle.time_s.empty()) return "no pressure was recorded in it";
  if (cycle.first == 0 && cycle.time_s.front() - trigger_s > reach_s) return "the recording starts within it";
  if (cycle.first + cycle.time_s.size() == all.size() && end_s - cycle.time_s.back() > reach_s)
    return "the recording ends within it";
  for (size_t i = 0; i < cycle.value_kPa.size(); ++i) {
    if (std::isnan(cycle.value_kPa[i])) return fmt::format("sample {} is missing", cycle.first + i);
  }
  for (const Hole& hole : all.spacing().holes) {
    if (hole.before_s + spacing_s >= end_s || hole.after_s - spacing_s < trigger_s) continue;
    return fmt::format("{:.1f} ms without a sample before sample {}", 1e3 * (hole.after_s - hole.before_s),
                       hole.row);
  }
  return {};
}

FrameSamples frame_of(std::span<const double> value_kPa) {
  FrameSamples frame{.count = value_kPa.size()};
  frame.mean_kPa =
      std::accumulate(value_kPa.begin(), value_kPa.end(), 0.0) / static_cast<double>(value_kPa.size());
  for (const double value : value_kPa)
    frame.squares += (value - frame.mean_kPa) * (value - frame.mean_kPa);
  return frame;
}

/// `windows` and `interval_s` count from `from_s`: the trigger, and the signal's delay behind it.
CycleFrames frames_of_cycle(SamplesInOrder& all, const std::vector<FrameWindow>& windows, double from_s,
                            double interval_s) {
  const Samples samples = all.within(from_s, from_s + interval_s);
  CycleFrames cycle{{}, why_not_whole(samples, all, from_s, from_s + interval_s)};
  if (!cycle.exclusion.empty()) return cycle;
  for (size_t k = 0; k < windows.size(); ++k) {
    const Samples frame = samples.within(from_s + windows[k].from_s, from_s + windows[k].to_s);
    if (frame.time_s.empty()) {
      cycle.exclusion = fmt::format("no sample falls into frame {}", k);
      cycle.frame_without_sample = true;
      return cycle;
    }
    cycle.frames.push_back(frame_of(frame.value_kPa));
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
  std::vector<FrameSamples> frames;
  size_t trigger;  // of the segment's
  double trigger_s;
};

/// How far each cycle lies from the middle one: root mean square over the frames. Precondition: one or more.
std::vector<double> distances_kPa(const std::vector<UsedCycle>& cycles) {
  const size_t frames = cycles.front().frames.size();
  std::vector<double> squares(cycles.size(), 0), of_frame(cycles.size());
  for (size_t k = 0; k < frames; ++k) {
    std::ranges::transform(cycles, of_frame.begin(),
                           [&](const UsedCycle& cycle) { return cycle.frames[k].mean_kPa; });
    const double middle_kPa = signal::median(of_frame);
    for (size_t i = 0; i < cycles.size(); ++i)
      squares[i] += (of_frame[i] - middle_kPa) * (of_frame[i] - middle_kPa) / static_cast<double>(frames);
  }
  for (double& square : squares)
    square = std::sqrt(square);
  return squares;
}

std::vector<ExcludedCycle> take_outliers(std::vector<UsedCycle>& cycles, double resolution_kPa) {
  constexpr size_t fewest_cycles = 5;
  constexpr double usual_distances = 8;
  if (cycles.size() < fewest_cycles) return {};
  const std::vector<double> distance_kPa = distances_kPa(cycles);
  const double usual_kPa = signal::median(distance_kPa);
  std::vector<ExcludedCycle> outliers;
  std::vector<UsedCycle> kept;
  for (size_t i = 0; i < cycles.size(); ++i) {
    if (!(distance_kPa[i] > usual_distances * usual_kPa + resolution_kPa)) {
      kept.push_back(std::move(cycles[i]));
      continue;
    }
    outliers.push_back(
        {cycles[i].trigger, cycles[i].trigger_s,
         fmt::format("lies {:.3g} kPa from the middle cycle, where half of them lie within {:.3g}",
                     distance_kPa[i], usual_kPa)});
  }
  cycles = std::move(kept);
  return outliers;
}

FrameBin summarise(const FrameWindow& window, size_t k, const std::vector<UsedCycle>& cycles) {
  const auto n = static_cast<double>(cycles.size());
  FrameBin bin{.window = window, .cycles = cycles.size()};
  double number_mean = 0;
  for (const UsedCycle& cycle : cycles) {
    bin.mean_kPa += cycle.frames[k].mean_kPa / n;
    number_mean += cycle.number / n;
  }
  double squares = 0, products = 0, numbers = 0, sample_squares = 0, sample_sum = 0;
  for (const UsedCycle& cycle : cycles) {
    const FrameSamples& frame = cycle.frames[k];
    const auto samples = static_cast<double>(frame.count);
    const double deviation = frame.mean_kPa - bin.mean_kPa;
    squares += deviation * deviation;
    products += (cycle.number - number_mean) * deviation;
    numbers += (cycle.number - number_mean) * (cycle.number - number_mean);
    sample_sum += samples * deviation;
    sample_squares += frame.squares + samples * deviation * deviation;
    bin.samples += frame.count;
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
  return bin_frames(run, rows_of(run), options);
}

FrameBins bin_frames(const RecordedRun& run, const RunRows& rows, const FrameBinOptions& options) {
  const auto channel = rows.pressure.values.find(options.channel);
  if (channel == rows.pressure.values.end()) {
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

  SamplesInOrder samples(rows.pressure, channel->second);
  const int64_t cycles_before = cycles_before_segment(run, bins.segment);
  std::vector<UsedCycle> used;
  bool frames_too_short = false;
  for (size_t i = 0; i < segment.triggers.size(); ++i) {
    const CycleTrigger& trigger = segment.triggers[i];
    if ((cycles_before + trigger.cycle) % options.gate_every != 0) continue;
    const double from_s = trigger.time_s + options.delay_s;
    CycleFrames cycle = frames_of_cycle(samples, windows, from_s, bins.interval_s);
    if (cycle.exclusion.empty()) cycle.exclusion = irregular_interval(segment, i, options.gate_every);
    if (cycle.exclusion.empty()) {
      used.push_back({static_cast<double>(trigger.cycle), std::move(cycle.frames), i, trigger.time_s});
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
         frames_too_short ? fmt::format("Ask for fewer frames: samples are {:.2f} ms apart.",
                                        1e3 * samples.spacing().median_s)
                          : "Record again, or choose another segment.");
  }
  if (options.without_outliers)
    bins.outliers = take_outliers(used, options.channel == cavity_channel ? cavity_resolution_kPa(run) : 0);
  for (size_t k = 0; k < windows.size(); ++k) {
    bins.frames.push_back(summarise(windows[k], k, used));
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
