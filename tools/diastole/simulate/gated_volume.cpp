#include "tools/diastole/simulate/gated_volume.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <random>
#include <vector>

#include "protocol/runfile/flow_writer.hpp"
#include "protocol/runfile/reader.hpp"

namespace diastole {
namespace {

constexpr size_t phases = 32, dummy_cycles = 3, least_cycles = 6;

struct VolumeRow {
  size_t trigger = 0;
  double since_s = 0.0, cavity_mL = 0.0;
};

std::vector<VolumeRow> rows_of(const std::filesystem::path& trace) {
  std::ifstream file(trace);
  std::string header;
  std::getline(file, header);
  std::vector<VolumeRow> rows;
  VolumeRow row;
  for (char comma = 0; file >> row.trigger >> comma >> row.since_s >> comma >> row.cavity_mL;)
    rows.push_back(row);
  return rows;
}

/// Between the rows on both sides.
double volume_at(const std::vector<VolumeRow>& cycle, double since_s) {
  const auto after = std::ranges::upper_bound(cycle, since_s, {}, &VolumeRow::since_s);
  if (after == cycle.begin()) return cycle.front().cavity_mL;
  if (after == cycle.end()) return cycle.back().cavity_mL;
  const VolumeRow &a = *(after - 1), &b = *after;
  return a.cavity_mL + (b.cavity_mL - a.cavity_mL) * (since_s - a.since_s) / (b.since_s - a.since_s);
}

}  // namespace

std::string store_gated_volume(const std::string& run, const std::filesystem::path& trace,
                               size_t triggers_before, const GatedNoise& noise) {
  const runfile::RecordedRun recorded = runfile::read_run(run);
  const auto moving = std::ranges::find_if(
      recorded.segments, [](const runfile::Segment& one) { return one.waveform != "hold"; });
  if (moving == recorded.segments.end()) return "no gated volume: no segment moves";
  const runfile::Segment& segment = *moving;
  const auto triggers_until = [&](double end_s) {
    return static_cast<size_t>(std::ranges::lower_bound(recorded.trigger_s, end_s) -
                               recorded.trigger_s.begin());
  };
  const size_t earlier = triggers_until(segment.start_s),
               begun = triggers_until(segment.end_s() + recorded.trigger_delay_s) - earlier;
  if (begun < least_cycles) {
    return fmt::format("no gated volume: the segment that moves has {} cycles, and it takes {}", begun,
                       least_cycles);
  }
  std::vector<double> sum_mL(phases, 0.0);
  const std::vector<VolumeRow> rows = rows_of(trace);
  const size_t first = triggers_before + earlier + dummy_cycles,
               last = triggers_before + earlier + begun - 1;  // the last may be cut off
  for (size_t trigger = first; trigger < last; ++trigger) {
    const std::vector<VolumeRow> cycle(std::ranges::lower_bound(rows, trigger, {}, &VolumeRow::trigger),
                                       std::ranges::upper_bound(rows, trigger, {}, &VolumeRow::trigger));
    if (cycle.empty())
      return fmt::format("no gated volume: the rig has not written cycle {}", trigger - triggers_before + 1);
    for (size_t j = 0; j < phases; ++j)
      sum_mL[j] += volume_at(cycle, segment.period_s * (static_cast<double>(j) + 0.5) / phases);
  }
  std::mt19937_64 random(noise.seed + triggers_before);
  std::normal_distribution<double> scatter(0.0, noise.sd_mL);
  runfile::FlowVolume flow;
  for (size_t j = 0; j < phases; ++j) {
    flow.phase_s.push_back(segment.period_s * (static_cast<double>(j) + 0.5) / phases);
    flow.cavity_mL.push_back(sum_mL[j] / static_cast<double>(last - first) + scatter(random));
    flow.sigma_mL.push_back(noise.sd_mL);
  }
  runfile::store_flow(run, static_cast<size_t>(moving - recorded.segments.begin()), flow, true);
  return {};
}

}  // namespace diastole
