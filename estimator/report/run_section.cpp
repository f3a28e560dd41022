#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <limits>
#include <span>

#include "estimator/report/html_text.hpp"
#include "estimator/report/sections.hpp"
#include "estimator/report/svg_plot.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/runfile/commanded_volume.hpp"
#include "protocol/runfile/frame_bins.hpp"

namespace diastole::report {
namespace {

using runfile::FrameBin;
using runfile::FrameBins;
using runfile::RecordedRun;
using runfile::RunFile;
using runfile::Segment;

constexpr size_t loop_frames = 60;  // windows of a pressure-volume loop
constexpr size_t most_plotted_segments = 6;
// A browser draws this many samples of a trace without delay; longer runs show every n-th.
constexpr size_t most_chart_samples = 120'000;
constexpr size_t most_page_samples = 180'000;  // ... and a page of that many all its traces

std::vector<double> segment_triggers(const RecordedRun& run, const Segment& segment) {
  constexpr double slack_s = 1e-3;
  std::vector<double> kept;
  std::ranges::copy_if(run.trigger_s, std::back_inserter(kept), [&](double time_s) {
    return time_s >= segment.start_s - slack_s && time_s < segment.end_s() - slack_s;
  });
  return kept;
}

std::vector<double> every_nth(const runfile::Series& values, size_t step) {
  std::vector<double> kept;
  values.each_block([&](size_t first, std::span<const double> block) {
    for (size_t i = (step - first % step) % step; i < block.size(); i += step)
      kept.push_back(block[i]);
  });
  return kept;
}

std::string channel_words(const std::string& dataset) {
  if (dataset == "cavity_kPa") return "in the cavity";
  if (dataset == "cavity_filtered_kPa") return "in the cavity, low-passed at 30 Hz";
  if (dataset == "pump_kPa") return "at the pump end of the hose";
  return dataset;
}

void add_traces(Page& page, const RunFile& file) {
  const auto& [run, rows] = file;
  const size_t shown = std::min(most_chart_samples, most_page_samples / (rows.pressure.values.size() + 1));
  const size_t step = 1 + rows.pressure.time_s.size() / shown;
  const std::string thinned = step == 1 ? "" : fmt::format(" Every {}th sample is drawn.", step);
  const char* style = "a";
  for (const auto& [dataset, values] : rows.pressure.values) {
    page.time_chart(
        {.time_s = every_nth(rows.pressure.time_s, step),
         .traces = {{"pressure (kPa)", style, every_nth(values, step)}},
         .y_label = "pressure (kPa)",
         .marks_s = run.trigger_s,
         .caption = fmt::format("Pressure {}. Dashed: triggers. Drag to zoom, double-click to return.{}",
                                channel_words(dataset), thinned)});
    style = dataset == "cavity_kPa" ? "c" : style;
  }
  const size_t pump_step = 1 + rows.pump.time_s.size() / shown;
  page.time_chart(
      {.time_s = every_nth(rows.pump.time_s, pump_step),
       .traces = {{"volume (mL)", "b", every_nth(rows.pump.values.at("commanded_mL"), pump_step)}},
       .y_label = "volume (mL)",
       .marks_s = run.trigger_s,
       .caption = "Volume that the piston was commanded to displace: steps issued times volume per step."});
}

double middle_s(const FrameBin& frame) { return (frame.window.from_s + frame.window.to_s) / 2; }

Figure binned_figure(const FrameBins& bins, const Segment& segment) {
  const auto time_s = numbers_of(bins.frames, middle_s);
  const auto mean = numbers_of(bins.frames, &FrameBin::mean_kPa);
  const auto low = numbers_of(bins.frames, [](const FrameBin& f) { return f.mean_kPa - f.sd_kPa; });
  const auto high = numbers_of(bins.frames, [](const FrameBin& f) { return f.mean_kPa + f.sd_kPa; });
  SvgPlot plot({.x = {.label = "time after the trigger (s)", .from = 0, .to = bins.period_s},
                .y = {.label = "pressure (kPa)"}});
  plot.band(time_s, low, high, "a", "\u00b1 1 SD over cycles");
  plot.line(time_s, mean, "a");
  plot.points(time_s, mean, "a", "mean");
  const size_t cycles = bins.frames.empty() ? 0 : bins.frames.front().cycles;
  return {
      plot.svg(),
      fmt::format("{}: cavity pressure in {} image frames, mean and spread over {} cycles ({}, {} mL, {} s).",
                  fmt::format("Segment {}", bins.segment), bins.frames.size(), cycles, segment.waveform,
                  chosen(segment.stroke_mL), chosen(bins.period_s))};
}

/// Of each frame's middle, over the cycles that begin with these triggers; NaN where none has a volume.
std::vector<double> mean_volume_mL(const runfile::StreamRows& pump, const FrameBins& bins,
                                   const std::vector<double>& triggers_s) {
  std::vector<double> sum(bins.frames.size()), count(bins.frames.size());
  runfile::CommandedVolume volume(pump);
  for (const double trigger_s : triggers_s) {
    for (size_t k = 0; k < bins.frames.size(); ++k) {
      const double value = volume.at(trigger_s + middle_s(bins.frames[k]));
      if (!std::isfinite(value)) continue;
      sum[k] += value;
      ++count[k];
    }
  }
  for (size_t k = 0; k < sum.size(); ++k)
    sum[k] /= count[k];
  return sum;
}

/// Pressure against volume over the mean cycle; the loop is closed by its first point.
Figure loop_figure(const RunFile& file, const FrameBins& fine, const std::vector<double>& triggers_s) {
  const RecordedRun& run = file.run;
  std::vector<double> volume_mL = mean_volume_mL(file.rows.pump, fine, triggers_s);
  std::vector<double> pressure_kPa = numbers_of(fine.frames, &FrameBin::mean_kPa);
  volume_mL.push_back(volume_mL.front());
  pressure_kPa.push_back(pressure_kPa.front());
  SvgPlot plot({.x = {.label = "volume (mL)"}, .y = {.label = "pressure (kPa)"}});
  plot.line(volume_mL, pressure_kPa, "b", "commanded volume");
  const auto flow = run.flow.find(fine.segment);
  if (flow != run.flow.end()) {
    std::vector<double> imaged_kPa;
    for (const double phase_s : flow->second.phase_s) {
      const auto frame = static_cast<size_t>(phase_s / fine.period_s * loop_frames) % loop_frames;
      imaged_kPa.push_back(fine.frames[frame].mean_kPa);
    }
    plot.points(flow->second.cavity_mL, imaged_kPa, "c small", "imaged cavity volume");
  }
  return {plot.svg(),
          fmt::format("Segment {}: cavity pressure against volume over the mean cycle. The commanded volume "
                      "differs from the cavity's by what the hose and the fluid take up.",
                      fine.segment)};
}

void add_bins_table(Page& page, const FrameBins& bins) {
  std::vector<std::vector<std::string>> rows;
  for (size_t i = 0; i < bins.frames.size(); ++i) {
    const FrameBin& frame = bins.frames[i];
    rows.push_back({std::to_string(i),
                    fmt::format("{:.3f} to {:.3f}", frame.window.from_s, frame.window.to_s),
                    fmt::format("{:.4f}", frame.mean_kPa), fmt::format("{:.4f}", frame.sd_kPa),
                    fmt::format("{:.4f}", frame.sample_sd_kPa),
                    fmt::format("{:+.5f}", frame.drift_kPa_per_cycle), std::to_string(frame.cycles)});
  }
  page.table({"frame", "window (s)", "mean (kPa)", "SD over cycles (kPa)", "SD of samples (kPa)",
              "drift (kPa/cycle)", "cycles"},
             rows,
             fmt::format("Segment {}: the pressure of each image frame. The sample SD also holds the "
                         "pressure's own change within the window.",
                         bins.segment));
  for (const runfile::ExcludedCycle& cycle : bins.excluded) {
    page.warning(fmt::format("Cycle {} at {} s is left out of the frames: {}.", cycle.cycle,
                             number(cycle.trigger_s, 5), cycle.reason));
  }
}

void add_segments(Page& page, const RunFile& file, size_t frames) {
  const auto& [run, rows] = file;
  size_t plotted = 0;
  for (size_t i = 0; i < run.segments.size() && plotted < most_plotted_segments; ++i) {
    const std::vector<double> triggers_s = segment_triggers(run, run.segments[i]);
    if (triggers_s.empty() || run.segments[i].stroke_mL == 0) continue;
    try {
      const FrameBins bins = bin_frames(run, rows, {.frames = frames, .segment = i});
      const FrameBins fine = bin_frames(run, rows, {.frames = loop_frames, .segment = i});
      page.figures({binned_figure(bins, run.segments[i]), loop_figure(file, fine, triggers_s)});
      if (plotted == 0) add_bins_table(page, bins);
      ++plotted;
    } catch (const InputError& error) {
      page.warning(fmt::format("Segment {} cannot be binned into frames: {}", i, error.fault().problem));
    }
  }
}

void add_schedule(Page& page, const RecordedRun& run) {
  std::vector<std::vector<std::string>> rows;
  for (size_t i = 0; i < run.segments.size(); ++i) {
    const Segment& segment = run.segments[i];
    rows.push_back({fmt::format("{}  {}", i, segment.waveform), chosen(segment.start_s),
                    chosen(segment.stroke_mL), chosen(segment.offset_mL), chosen(segment.period_s),
                    std::to_string(segment.cycles), std::to_string(segment_triggers(run, segment).size())});
  }
  page.table({"segment", "start (s)", "stroke (mL)", "offset (mL)", "period (s)", "cycles", "triggers"}, rows,
             "What was scheduled, and the triggers recorded in each segment.");
}

void add_losses(Page& page, const RecordedRun& run) {
  for (const runfile::Gap& gap : run.gaps) {
    page.warning(fmt::format("{} samples of {} are missing from index {}: {}.", gap.count, gap.stream,
                             gap.first_index, gap.reason));
  }
  if (run.gaps.empty()) page.paragraph("No sample is known to be missing: the run's list of gaps is empty.");
  if (run.events.empty()) return;
  const auto row_of = [](const runfile::Event& event) -> Page::Row {
    return {number(event.time_s, 5), event.level, event.code, event.text};
  };
  page.table_of(run.events, {"time (s)", "level", "code", "what happened"}, row_of, "Events during the run.");
}

}  // namespace

void add_run(Page& page, const RunFile& file, size_t frames) {
  const auto& [run, rows] = file;
  int64_t missing = 0;
  for (const runfile::Gap& gap : run.gaps)
    missing += gap.count;
  const runfile::Spacing& spacing = rows.pressure.spacing();
  const size_t samples = rows.pressure.time_s.size();
  const double duration_s = samples == 0 ? 0 : spacing.last_s - spacing.first_s;
  const double rate_Hz = duration_s > 0 ? static_cast<double>(samples - 1) / duration_s : 0;
  double peak_kPa = std::numeric_limits<double>::quiet_NaN();
  rows.pressure.values.at("cavity_kPa").each_block([&](size_t, std::span<const double> block) {
    for (const double value : block)
      peak_kPa = std::fmax(peak_kPa, value);
  });

  page.headline(
      "Session", fmt::format("{} triggers", run.trigger_s.size()),
      fmt::format("over {} s; cavity pressure up to {} kPa", number(duration_s, 3), number(peak_kPa, 3)));
  page.headline("Samples", missing == 0 ? "none missing" : fmt::format("{} missing", missing),
                fmt::format("of {}, {} a second", samples, number(rate_Hz, 3)));

  page.section("The session", fmt::format("Recorded {} by {}; run {} in {}.", run.started_utc, run.producer,
                                          run.run_id, std::filesystem::path(run.file).filename().string()));
  add_traces(page, file);
  add_schedule(page, run);
  add_losses(page, run);
  if (!run.protocol_toml.empty()) page.listing("The experiment file as it was run", run.protocol_toml);
  page.section("Pressure in the image frames",
               "Gated images are built from many cycles, so a frame's load is the mean over the same window "
               "of every cycle, counted from that cycle's own trigger.");
  add_segments(page, file, frames);
}

}  // namespace diastole::report
