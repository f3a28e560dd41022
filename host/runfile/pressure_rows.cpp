#include "host/runfile/pressure_rows.hpp"

#include <algorithm>
#include <limits>

#include "host/runfile/rows_due.hpp"

namespace diastole {
namespace {

const std::string lost_in_the_journal = "its record was lost in the journal";
const std::string not_recorded = "not recorded";

}  // namespace

PressureRows::PressureRows(const ParsedJournal& parsed, const TimeAxis& axis, Take take)
    : journal_(parsed),
      axis_(axis),
      take_(std::move(take)),
      spacing_s_(axis.map().scale / parsed.begin.sample_rate_Hz),
      nothing_(parsed.begin.channels.size(), std::numeric_limits<double>::quiet_NaN()),
      gaps_(parsed.gaps) {
  std::ranges::stable_sort(gaps_, {}, &GapRecord::first_index);
  if (axis.instrument_counts()) {
    grid_start_s_ = axis.of_sample(0, 0);
    spacing_s_ = axis.of_sample(1, 0) - *grid_start_s_;
  } else if (parsed.first_due_ns) {
    grid_start_s_ = axis.of_host_ns(*parsed.first_due_ns);
  }
  samples_due_ = samples_due(parsed);
  if (samples_due_ && !axis.instrument_counts()) limit_ = *samples_due_;
}

void PressureRows::add(const SampleBlock& block) {
  const size_t channels = nothing_.size();
  if (block.channels != channels) return;
  const std::span<const double> values(block.value_kPa);
  for (size_t i = 0; i < block.host_ns.size(); ++i) {
    const uint64_t row = block.first_index + i;
    if (row >= limit_) return;
    const double time_s = axis_.of_sample(row, block.host_ns[i]);
    if (!grid_start_s_) grid_start_s_ = time_s - spacing_s_ * static_cast<double>(row);
    for (; next_row_ < row; ++next_row_)
      give_missing(last_s_ ? *last_s_ + (time_s - *last_s_) / static_cast<double>(row - next_row_ + 1)
                           : due_s(next_row_));
    give({time_s, values.subspan(i * channels, channels), nullptr});
    last_s_ = time_s;
    next_row_ = row + 1;
  }
}

void PressureRows::finish() {
  uint64_t rows = std::max(journal_.sample_rows, samples_due_.value_or(0));
  if (!journal_.closed)
    rows = std::max(rows, rows_due_by(last_known_s(journal_, axis_), due_s(0), spacing_s_));
  for (rows = std::min(rows, limit_); next_row_ < rows; ++next_row_)
    give_missing(last_s_ ? std::max(due_s(next_row_), *last_s_ + 0.1 * spacing_s_) : due_s(next_row_));
}

void PressureRows::give_missing(double time_s) {
  if (last_s_) last_s_ = time_s;
  while (gap_ < gaps_.size() && gaps_[gap_].first_index + gaps_[gap_].count <= next_row_)
    ++gap_;
  const bool declared = gap_ < gaps_.size() && gaps_[gap_].first_index <= next_row_;
  const std::string& otherwise = next_row_ < journal_.sample_rows ? lost_in_the_journal : not_recorded;
  give({time_s, nothing_, declared ? &gaps_[gap_].reason : &otherwise});
}

void PressureRows::give(const PressureRow& row) {
  if (!started_) first_row_ = next_row_;
  started_ = started_ || row.time_s >= 0;
  if (started_) take_(row);
}

std::optional<runfile::StreamGrid> PressureRows::grid() const {
  if (!started_ || !(spacing_s_ > 0)) return std::nullopt;
  return runfile::StreamGrid{due_s(first_row_), due_s(next_row_ - 1), 1 / spacing_s_};
}

double PressureRows::due_s(uint64_t row) const {
  return grid_start_s_.value_or(0) + spacing_s_ * static_cast<double>(row);
}

}  // namespace diastole
