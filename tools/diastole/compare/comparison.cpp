#include "tools/diastole/compare/comparison.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>

#include "estimator/inference/intervals.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/runfile/frame_bins.hpp"
#include "protocol/runfile/layout.hpp"
#include "protocol/runfile/soundness.hpp"
#include "tools/diastole/compare/differences.hpp"

namespace diastole::comparison {
namespace {

using runfile::RecordedRun;
using runfile::RunFile;
using runfile::Segment;

constexpr double false_alarm = 0.01;

/// Which cycles were left out; of many, the first.
std::string outlier_words(const std::vector<runfile::ExcludedCycle>& outliers, size_t kept) {
  constexpr size_t most_named = 8;
  std::vector<size_t> named;
  for (size_t i = 0; i < std::min(most_named, outliers.size()); ++i)
    named.push_back(outliers[i].cycle);
  return fmt::format("{} of {} cycles left out as outside the scatter of the others ({}{}): cycle {} {}",
                     outliers.size(), outliers.size() + kept, fmt::join(named, ", "),
                     outliers.size() > most_named ? ", ..." : "", named.front(), outliers.front().reason);
}

MeanCycle mean_cycle(const RunFile& file, size_t number, const runfile::FrameBinOptions& options,
                     std::vector<std::string>& remarks) {
  const runfile::FrameBins bins = runfile::bin_frames(file.run, file.rows, options);
  if (!bins.outliers.empty())
    remarks.push_back(fmt::format("{}: segment {}, {}: {}", file.run.file, bins.segment, options.channel,
                                  outlier_words(bins.outliers, bins.frames.front().cycles)));
  const double resolution_kPa =
      options.channel == runfile::cavity_channel ? runfile::cavity_resolution_kPa(file.run) : 0;
  MeanCycle cycle{.run = number, .cycles = 0, .mean_kPa = {}, .sd_kPa = {}, .error_kPa = {}};
  for (const runfile::FrameBin& bin : bins.frames) {
    cycle.cycles = std::max(cycle.cycles, bin.cycles);
    cycle.mean_kPa.push_back(bin.mean_kPa);
    cycle.sd_kPa.push_back(bin.sd_kPa);
    cycle.error_kPa.push_back(std::sqrt(runfile::variance_of_mean(bin, resolution_kPa)));
  }
  return cycle;
}

/// Both followed the same points, or neither followed any.
bool same_points(const RecordedRun& a, const RecordedRun& b, size_t segment) {
  const auto x = a.waveforms.find(segment), y = b.waveforms.find(segment);
  if (x == a.waveforms.end() || y == b.waveforms.end())
    return x == a.waveforms.end() && y == b.waveforms.end();
  return x->second.phase == y->second.phase && x->second.fraction == y->second.fraction;
}

/// Volumes are whole steps of some µL: equal motions are equal to the digit that the experiment states.
bool same_motion(const RecordedRun& a, const RecordedRun& b, size_t segment) {
  if (segment >= a.segments.size() || segment >= b.segments.size()) return false;
  const Segment &x = a.segments[segment], &y = b.segments[segment];
  return x.waveform == y.waveform && x.stroke_mL == y.stroke_mL && x.period_s == y.period_s &&
         x.offset_mL == y.offset_mL && same_points(a, b, segment);
}

/// Slope of b over a; 1 where a does not move.
double slope(const std::vector<double>& a, const std::vector<double>& b) {
  const auto count = static_cast<double>(a.size());
  const double mean_a = std::accumulate(a.begin(), a.end(), 0.0) / count;
  const double mean_b = std::accumulate(b.begin(), b.end(), 0.0) / count;
  double both = 0, own = 0;
  for (size_t i = 0; i < a.size(); ++i) {
    both += (a[i] - mean_a) * (b[i] - mean_b);
    own += (a[i] - mean_a) * (a[i] - mean_a);
  }
  return own > 0 ? both / own : 1;
}

/// Degrees of freedom of a difference of two means with these variances, each from so many cycles (Welch, Biometrika 34 (1947) 28).
double welch_dof(double variance_a, size_t cycles_a, double variance_b, size_t cycles_b) {
  const double sum = variance_a + variance_b;
  return sum * sum /
         (variance_a * variance_a / static_cast<double>(cycles_a - 1) +
          variance_b * variance_b / static_cast<double>(cycles_b - 1));
}

double range_Pa(const MeanCycle& cycle) {
  const auto [least_kPa, most_kPa] = std::ranges::minmax(cycle.mean_kPa);
  return 1e3 * (most_kPa - least_kPa);
}

/// Precondition: both have two cycles or more.
Departure departure_of(const MeanCycle& first, const MeanCycle& other, const std::vector<double>& phase,
                       double probability) {
  Departure departure{.run = other.run};
  departure.range_Pa = std::min(range_Pa(first), range_Pa(other));
  const auto parts = static_cast<double>(phase.size());
  double worst_share = -1;
  for (size_t i = 0; i < phase.size(); ++i) {
    const double difference_Pa = 1e3 * (other.mean_kPa[i] - first.mean_kPa[i]);
    departure.offset_Pa += difference_Pa / parts;
    departure.rms_Pa += difference_Pa * difference_Pa / parts;
    const double variance_a = std::pow(first.error_kPa[i], 2), variance_b = std::pow(other.error_kPa[i], 2);
    if (!(variance_a > 0 && variance_b > 0)) continue;
    const double error_Pa = 1e3 * std::sqrt(variance_a + variance_b);
    const double in_errors = std::abs(difference_Pa) / error_Pa;
    const double limit = inference::student_quantile(
        welch_dof(variance_a, first.cycles, variance_b, other.cycles), probability);
    departure.allowed_Pa = std::max(departure.allowed_Pa, limit * error_Pa);
    if (in_errors / limit <= worst_share) continue;
    worst_share = in_errors / limit;
    departure.worst_Pa = difference_Pa;
    departure.worst_phase = phase[i];
    departure.worst_in_errors = in_errors;
    departure.limit_in_errors = limit;
  }
  departure.rms_Pa = std::sqrt(departure.rms_Pa);
  departure.gain = slope(first.mean_kPa, other.mean_kPa);
  return departure;
}

std::vector<std::string> channels_of(const std::vector<RunFile>& runs) {
  std::vector<std::string> channels;
  for (const auto& [name, values] : runs.front().rows.pressure.values) {
    const bool everywhere = std::ranges::all_of(runs, [&, channel = name](const RunFile& file) {
      return file.rows.pressure.values.contains(channel);
    });
    if (everywhere && name != runfile::cavity_filtered_channel) channels.push_back(name);
  }
  return channels;
}

Overlay overlay_of(const std::vector<RunFile>& runs, size_t segment, const std::string& channel, size_t parts,
                   std::vector<std::string>& remarks) {
  Overlay overlay{
      .segment = segment, .channel = channel, .period_s = runs.front().run.segments[segment].period_s};
  for (size_t i = 0; i < parts; ++i)
    overlay.phase.push_back((static_cast<double>(i) + 0.5) / static_cast<double>(parts));
  for (size_t number = 0; number < runs.size(); ++number) {
    if (segment >= runs[number].run.segments.size()) continue;
    try {
      overlay.cycles.push_back(mean_cycle(
          runs[number], number,
          {.frames = parts, .segment = segment, .channel = channel, .without_outliers = true}, remarks));
    } catch (const InputError& error) {
      remarks.push_back(
          fmt::format("{}: segment {}: {}", runs[number].run.file, segment, error.fault().problem));
    }
  }
  return overlay;
}

void remark_what_is_not_sound(const std::vector<RunFile>& runs, std::vector<std::string>& remarks) {
  for (const RunFile& file : runs) {
    const std::vector<std::string> problems = runfile::assess(file.run, file.rows).problems;
    if (problems.empty()) continue;
    remarks.push_back(fmt::format("{}: is not sound: {}{}", file.run.file, problems.front(),
                                  problems.size() == 1 ? ""
                                                       : fmt::format("; and {} more problems, which "
                                                                     "`diastole inspect` lists",
                                                                     problems.size() - 1)));
  }
}

/// One run named twice, or a copy of it, agrees whatever its noise.
void remark_what_is_the_same(const std::vector<RunFile>& runs, std::vector<std::string>& remarks) {
  for (size_t r = 1; r < runs.size(); ++r) {
    const auto first =
        std::ranges::find(runs, runs[r].run.run_id, [](const RunFile& file) { return file.run.run_id; });
    const auto before = static_cast<size_t>(first - runs.begin());
    if (before < r && !runs[r].run.run_id.empty())
      remarks.push_back(fmt::format("{} is the recording of [{}] once more: it says nothing of another",
                                    runs[r].run.file, before));
  }
}

/// Segments and channels that some runs have and others lack.
void remark_what_lacks(const std::vector<RunFile>& runs, std::vector<std::string>& remarks) {
  const std::vector<Segment>& of_first = runs.front().run.segments;
  for (const RunFile& file : runs) {
    const std::vector<Segment>& own = file.run.segments;
    const bool has_more = own.size() > of_first.size();
    const std::vector<Segment>& longer = has_more ? own : of_first;
    for (size_t i = std::min(own.size(), of_first.size()); i < longer.size(); ++i)
      if (longer[i].waveform != "hold")
        remarks.push_back(fmt::format("{}: segment {}: {} has none: not tested", file.run.file, i,
                                      has_more ? "the first run" : "this run"));
  }
  const std::vector<std::string> common = channels_of(runs);
  std::set<std::string> lacking;
  for (const RunFile& file : runs)
    for (const auto& [name, values] : file.rows.pressure.values)
      if (name != runfile::cavity_filtered_channel && std::ranges::count(common, name) == 0)
        lacking.insert(name);
  for (const std::string& name : lacking)
    remarks.push_back(fmt::format("{} is not in all runs: not compared", name));
}

bool can_be_tested(const Overlay& overlay, const MeanCycle& cycle, const std::vector<RunFile>& runs) {
  return cycle.run != 0 && cycle.cycles > 1 &&
         same_motion(runs.front().run, runs[cycle.run].run, overlay.segment);
}

}  // namespace

size_t Comparison::count(Outcome outcome) const {
  size_t count = 0;
  for (const Overlay& overlay : overlays)
    count += static_cast<size_t>(std::ranges::count(overlay.departures, outcome, &Departure::outcome));
  return count;
}

std::optional<Outcome> Comparison::outcome() const {
  std::map<size_t, Outcome> of_run;
  for (const Overlay& overlay : overlays) {
    for (const Departure& departure : overlay.departures) {
      Outcome& outcome = of_run.try_emplace(departure.run, Outcome::undecided).first->second;
      if (outcome != Outcome::differs && departure.outcome() != Outcome::undecided)
        outcome = departure.outcome();
    }
  }
  const auto any = [&](Outcome outcome) {
    return std::ranges::any_of(of_run, [&](const auto& run) { return run.second == outcome; });
  };
  for (const Outcome outcome : {Outcome::differs, Outcome::undecided, Outcome::agrees})
    if (any(outcome)) return outcome;
  return {};
}

Comparison compare(const std::vector<RunFile>& runs, const std::vector<runfile::Session>& sessions,
                   size_t parts) {
  Comparison comparison;
  for (const RunFile& file : runs)
    comparison.files.push_back(file.run.file);
  add_differences(comparison, runs, sessions);
  remark_what_is_not_sound(runs, comparison.remarks);
  remark_what_is_the_same(runs, comparison.remarks);
  for (size_t segment = 0; segment < runs.front().run.segments.size(); ++segment) {
    if (runs.front().run.segments[segment].waveform == "hold") continue;
    for (const std::string& channel : channels_of(runs))
      comparison.overlays.push_back(overlay_of(runs, segment, channel, parts, comparison.remarks));
  }
  remark_what_lacks(runs, comparison.remarks);
  size_t tests = 0;
  for (const Overlay& overlay : comparison.overlays)
    for (const MeanCycle& cycle : overlay.cycles)
      tests += can_be_tested(overlay, cycle, runs) ? parts : 0;
  for (Overlay& overlay : comparison.overlays) {
    if (overlay.cycles.empty() || overlay.cycles.front().run != 0 || overlay.cycles.front().cycles < 2)
      continue;
    for (const MeanCycle& cycle : overlay.cycles) {
      if (can_be_tested(overlay, cycle, runs)) {
        overlay.departures.push_back(departure_of(overlay.cycles.front(), cycle, overlay.phase,
                                                  false_alarm / static_cast<double>(tests)));
      } else if (cycle.run != 0 && overlay.channel == runfile::cavity_channel) {
        comparison.remarks.push_back(
            fmt::format("{}: segment {}: {}", runs[cycle.run].run.file, overlay.segment,
                        cycle.cycles > 1 ? "another motion than in the first run: not tested"
                                         : "one cycle tells nothing of its noise: not tested"));
      }
    }
  }
  return comparison;
}

}  // namespace diastole::comparison
