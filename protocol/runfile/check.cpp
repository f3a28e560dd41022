#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>

#include "protocol/contract/input_error.hpp"
#include "protocol/runfile/layout.hpp"
#include "protocol/runfile/reader.hpp"

namespace diastole::runfile {
namespace {

bool countable(int64_t count) { return count >= 0 && count <= most_counted; }

bool on_the_axis(double time_s) { return std::abs(time_s) <= longest_time_s; }  // false for NaN

[[noreturn]] void fail_at(const std::string& file, const std::string& dataset, size_t index,
                          std::string problem, std::string remedy) {
  throw InputError(
      {file, fmt::format("dataset {}, index {}", dataset, index), std::move(problem), std::move(remedy)});
}

[[noreturn]] void fail_at(const RecordedRun& run, const std::string& dataset, size_t index,
                          std::string problem, std::string remedy) {
  fail_at(run.file, dataset, index, std::move(problem), std::move(remedy));
}

/// `last_s`: of the row before; of row 0 nothing.
void check_time(const std::string& file, const std::string& dataset, size_t row, double time_s,
                double last_s) {
  if (!on_the_axis(time_s)) {
    fail_at(file, dataset, row, fmt::format("is {}", time_s),
            "Every row has a time since the start of run; also a missing sample has the one at which it "
            "was due.");
  }
  if (row > 0 && time_s <= last_s) {
    fail_at(file, dataset, row, fmt::format("is {} s, not later than the {} s before it", time_s, last_s),
            "Times must increase strictly.");
  }
}

[[noreturn]] void fail_undeclared(const std::string& file, const std::string& dataset, size_t row,
                                  double value) {
  fail_at(file, dataset, row, fmt::format("is {} although /gaps declares no gap there", value),
          "A missing sample must be declared in /gaps.");
}

/// Which rows of dataset "/pressure/cavity_kPa" gaps declare missing: those of stream "pressure", or of a
/// stream named as the dataset itself, with or without its group.
std::vector<bool> declared_missing(const RecordedRun& run, std::string_view dataset, size_t rows) {
  dataset.remove_prefix(1);
  const std::string_view group = dataset.substr(0, dataset.find('/'));
  const std::string_view name = dataset.substr(dataset.find('/') + 1);
  std::vector<bool> missing(rows, false);
  for (const Gap& gap : run.gaps) {
    if (gap.stream != group && gap.stream != dataset && gap.stream != name) continue;
    const auto first = std::min(static_cast<size_t>(gap.first_index), rows);
    const auto last = first + std::min(static_cast<size_t>(gap.count), rows - first);
    std::fill(missing.begin() + static_cast<std::ptrdiff_t>(first),
              missing.begin() + static_cast<std::ptrdiff_t>(last), true);
  }
  return missing;
}

void check_values(const RecordedRun& run, const std::string& dataset, const Series& values) {
  std::optional<std::vector<bool>> missing;  // made if there is need of it
  const auto declared = [&](size_t row) {
    if (!missing) missing = declared_missing(run, dataset, values.size());
    return (*missing)[row];
  };
  values.each_block([&](size_t first, std::span<const double> block) {
    for (size_t i = 0; i < block.size(); ++i) {
      if (std::isfinite(block[i]) || (std::isnan(block[i]) && declared(first + i))) continue;
      fail_undeclared(run.file, dataset, first + i, block[i]);
    }
  });
}

void check_times(const RecordedRun& run, const std::string& dataset, const Series& times_s) {
  double last_s = 0;
  times_s.each_block([&](size_t first, std::span<const double> block) {
    for (size_t i = 0; i < block.size(); last_s = block[i++])
      check_time(run.file, dataset, first + i, block[i], last_s);
  });
}

void check_length(const RecordedRun& run, const std::string& dataset, size_t rows, const std::string& of,
                  size_t expected) {
  if (rows == expected) return;
  fail_at(run, dataset, std::min(rows, expected), fmt::format("has {} rows, {} has {}", rows, of, expected),
          "Datasets of one stream must be equally long.");
}

void check_stream(const RecordedRun& run, const std::string& group, const StreamRows& rows) {
  const std::string times = group + "/time_s";
  check_times(run, times, rows.time_s);
  for (const auto& [name, values] : rows.values) {
    const std::string dataset = fmt::format("{}/{}", group, name);
    check_length(run, dataset, values.size(), times, rows.time_s.size());
    check_values(run, dataset, values);
  }
}

void check_grid(const RecordedRun& run, const std::string& group, const std::optional<StreamGrid>& grid) {
  if (!grid) return;
  const bool ordered = on_the_axis(grid->start_s) && on_the_axis(grid->end_s) && grid->start_s <= grid->end_s;
  const double most_rate_Hz = static_cast<double>(most_counted);
  if (ordered && grid->rate_Hz > 0 && grid->rate_Hz <= most_rate_Hz &&
      (grid->end_s - grid->start_s) * grid->rate_Hz < most_rate_Hz) {
    return;
  }
  throw InputError({run.file, "attributes of group " + group,
                    fmt::format("have {} {}, {} {} and {} {}", grid_start, grid->start_s, grid_end,
                                grid->end_s, grid_rate, grid->rate_Hz),
                    "They tell from when to when and how often a row was due."});
}

void check_segments(const RecordedRun& run) {
  double last_s = -HUGE_VAL;
  for (size_t i = 0; i < run.segments.size(); ++i) {
    const Segment& segment = run.segments[i];
    const bool finite = on_the_axis(segment.start_s) && std::isfinite(segment.stroke_mL) &&
                        on_the_axis(segment.period_s) && std::isfinite(segment.offset_mL);
    if (!finite || segment.period_s < shortest_period_s || !countable(segment.cycles)) {
      fail_at(run, segments_table.path, i,
              fmt::format("has start_s {}, period_s {} and cycles {}", segment.start_s, segment.period_s,
                          segment.cycles),
              "A segment needs finite numbers, a positive period and no negative count of cycles.");
    }
    if (segment.start_s < last_s) {
      fail_at(run, segments_table.path, i,
              fmt::format("starts at {} s, before the one above", segment.start_s),
              "Segments must be in the order in which they ran.");
    }
    last_s = segment.start_s;
  }
}

void check_gaps(const RecordedRun& run) {
  for (size_t i = 0; i < run.gaps.size(); ++i) {
    const Gap& gap = run.gaps[i];
    if (countable(gap.first_index) && countable(gap.count) && gap.count >= 1) continue;
    fail_at(run, gaps_table.path, i,
            fmt::format("declares first_index {} and count {}", gap.first_index, gap.count),
            "A gap starts at 0 or later and misses at least one sample.");
  }
}

void check_slices(const RecordedRun& run) {
  int64_t next_trigger = 0;
  for (size_t i = 0; i < run.slices.size(); ++i) {
    const Slice& slice = run.slices[i];
    const auto rows = std::ssize(run.trigger_s);
    const bool in_order = slice.first_trigger >= next_trigger && slice.first_trigger <= rows;
    if (!countable(slice.cycles) || !countable(slice.dummy_cycles)) {
      fail_at(run, slices_table.path, i,
              fmt::format("has cycles {} and dummy_cycles {}", slice.cycles, slice.dummy_cycles),
              "Cycles are counted from 0.");
    }
    if (!in_order || slice.triggers < 0 || slice.triggers > rows - slice.first_trigger) {
      fail_at(
          run, slices_table.path, i,
          fmt::format("has triggers {} of the {} from row {} on", slice.triggers, rows, slice.first_trigger),
          "Slices follow one another, and each lies within the recorded triggers.");
    }
    next_trigger = slice.first_trigger + slice.triggers;
  }
}

}  // namespace

void StreamCheck::time(double time_s) {
  check_time(file_, group_ + "/time_s", rows_, time_s, last_s_);
  last_s_ = time_s;
  ++rows_;
}

void StreamCheck::value(const std::string& dataset, double value) const {
  if (!std::isfinite(value)) fail_undeclared(file_, fmt::format("{}/{}", group_, dataset), rows_ - 1, value);
}

void check(const RecordedRun& run) { check(run, rows_of(run)); }

void check(const RecordedRun& run, const RunRows& rows) {
  check_gaps(run);
  check_segments(run);
  for (const auto& [segment, waveform] : run.waveforms) {
    const std::string group = fmt::format("{}/{}", waveforms_group, segment);
    check_times(run, group + "/phase", waveform.phase);
    check_length(run, group + "/fraction", waveform.fraction.size(), group + "/phase", waveform.phase.size());
    check_values(run, group + "/fraction", waveform.fraction);
  }
  check_grid(run, pump_group, run.pump.grid);
  check_grid(run, pressure_group, run.pressure.grid);
  check_stream(run, pump_group, rows.pump);
  check_stream(run, pressure_group, rows.pressure);
  check_times(run, trigger_time, run.trigger_s);
  if (!on_the_axis(run.trigger_delay_s)) {
    fail_at(run, trigger_delay, 0, fmt::format("is {}", run.trigger_delay_s), "It is a time in seconds.");
  }
  check_slices(run);
  for (const auto& [segment, flow] : run.flow) {
    const std::string group = fmt::format("{}/{}", flow_group, segment);
    check_times(run, group + "/phase_s", flow.phase_s);
    check_length(run, group + "/cavity_mL", flow.cavity_mL.size(), group + "/phase_s", flow.phase_s.size());
    check_length(run, group + "/sigma_mL", flow.sigma_mL.size(), group + "/phase_s", flow.phase_s.size());
    check_values(run, group + "/cavity_mL", flow.cavity_mL);
    check_values(run, group + "/sigma_mL", flow.sigma_mL);
  }
}

}  // namespace diastole::runfile
