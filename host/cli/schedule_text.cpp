#include "host/cli/schedule_text.hpp"

#include <fmt/format.h>

#include <cmath>

namespace diastole {
namespace {

std::string block_words(const Experiment& experiment, const ScheduleBlock& block) {
  const Schedule& schedule = *experiment.schedule;
  const int64_t cycles = block.slices * (schedule.dummy_cycles + block.cycles_per_slice);
  return fmt::format(
      "  {}: {} slice{} of {} cycles{}, {}{}\n", block.name, block.slices, block.slices == 1 ? "" : "s",
      block.cycles_per_slice,
      schedule.dummy_cycles > 0 ? fmt::format(" after {} dummy cycles", schedule.dummy_cycles) : "",
      duration_words(experiment.segments.front().period_s * static_cast<double>(cycles)),
      block.prompt.empty() ? "" : ", each waits for you");
}

}  // namespace

std::string duration_words(double duration_s) {
  const auto seconds = static_cast<int64_t>(std::llround(duration_s));
  if (seconds < 60) return fmt::format("{} s", seconds);
  if (seconds < 3600) return fmt::format("{} min {} s", seconds / 60, seconds % 60);
  return fmt::format("{} h {} min", seconds / 3600, seconds % 3600 / 60);
}

std::string plan_words(const Experiment& experiment) {
  std::string words;
  if (experiment.schedule) {
    for (const ScheduleBlock& block : experiment.schedule->blocks)
      words += block_words(experiment, block);
  } else {
    for (const ExperimentSegment& segment : experiment.segments) {
      words += fmt::format("  {} x {} of {:g} mL in {:g} s\n", segment.cycles, segment.waveform_name,
                           segment.stroke_mL, segment.period_s);
    }
  }
  words += fmt::format("{} cycles, about {}", experiment.planned_cycles(),
                       duration_words(experiment.estimate_s()));
  if (experiment.schedule && experiment.schedule->waits()) words += ", and the time of waiting for you";
  return words + "\n";
}

nlohmann::json plan_json(const Experiment& experiment) {
  nlohmann::json blocks = nlohmann::json::array();
  if (experiment.schedule) {
    for (const ScheduleBlock& block : experiment.schedule->blocks) {
      blocks.push_back({{"name", block.name},
                        {"slices", block.slices},
                        {"cycles_per_slice", block.cycles_per_slice},
                        {"waits", !block.prompt.empty()}});
    }
  }
  return {{"experiment", experiment.file},
          {"cycles", experiment.planned_cycles()},
          {"estimate_s", experiment.estimate_s()},
          {"slices", experiment.schedule ? experiment.schedule->slices() : 0},
          {"waits", experiment.schedule && experiment.schedule->waits()},
          {"blocks", blocks}};
}

}  // namespace diastole
