#pragma once
// The rows of /pressure, from blocks of samples: every row of the sample grid once and in order, missing ones included.
//
// A missing row lies evenly between its neighbours in time; before the first and after the last sample that was received
// it lies where it was due. As the last one may have come later than the next was due, a row lies at least a tenth of
// the spacing after the one before. rows_due.hpp says how many there are; an instrument that counts its samples by
// a clock of its own may have had more.

#include <algorithm>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "host/runfile/rows_due.hpp"
#include "host/runfile/time_axis.hpp"

namespace diastole {

struct PressureRow {
  double time_s = 0;
  std::span<const double> value_kPa;     ///< one a channel; NaN: missing
  const std::string* missing = nullptr;  ///< why; null: received
};

class PressureRows {
 public:
  using Take = std::function<void(const PressureRow&)>;

  /// `parsed` and `axis` outlive this. Rows before the start of run are left out.
  PressureRows(const ParsedJournal& parsed, const TimeAxis& axis, Take take)
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

  /// In order of their index (read_blocks). Those of other channels than the journal's beginning says are left out.
  void add(const SampleBlock& block) {
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
  /// All rows that are still missing.
  void finish() {
    uint64_t rows = std::max(journal_.sample_rows, samples_due_.value_or(0));
    if (!journal_.closed)
      rows = std::max(rows, rows_due_by(last_known_s(journal_, axis_), due_s(0), spacing_s_));
    for (rows = std::min(rows, limit_); next_row_ < rows; ++next_row_)
      give_missing(last_s_ ? std::max(due_s(next_row_), *last_s_ + 0.1 * spacing_s_) : due_s(next_row_));
  }
  /// From when to when rows were due; none were: none. Precondition: finished.
  [[nodiscard]] std::optional<runfile::StreamGrid> grid() const {
    if (!started_ || !(spacing_s_ > 0)) return std::nullopt;
    return runfile::StreamGrid{due_s(first_row_), due_s(next_row_ - 1), 1 / spacing_s_};
  }

 private:
  static inline const std::string lost_in_the_journal = "its record was lost in the journal";
  static inline const std::string not_recorded = "not recorded";

  /// Row `next_row_`.
  void give_missing(double time_s) {
    if (last_s_) last_s_ = time_s;
    while (gap_ < gaps_.size() && gaps_[gap_].first_index + gaps_[gap_].count <= next_row_)
      ++gap_;
    const bool declared = gap_ < gaps_.size() && gaps_[gap_].first_index <= next_row_;
    const std::string& otherwise = next_row_ < journal_.sample_rows ? lost_in_the_journal : not_recorded;
    give({time_s, nothing_, declared ? &gaps_[gap_].reason : &otherwise});
  }
  void give(const PressureRow& row) {
    if (!started_) first_row_ = next_row_;
    started_ = started_ || row.time_s >= 0;
    if (started_) take_(row);
  }
  [[nodiscard]] double due_s(uint64_t row) const {
    return grid_start_s_.value_or(0) + spacing_s_ * static_cast<double>(row);
  }

  const ParsedJournal& journal_;
  const TimeAxis& axis_;
  Take take_;
  double spacing_s_;
  std::vector<double> nothing_;  // the values of a missing row
  std::vector<GapRecord> gaps_;  // in order
  size_t gap_ = 0;               // the first that ends behind the row
  std::optional<double> grid_start_s_;
  std::optional<uint64_t> samples_due_;  // closed in order: until its end
  uint64_t limit_ = most_rows;           // no row from here on
  uint64_t first_row_ = 0;               // that was given
  uint64_t next_row_ = 0;
  std::optional<double> last_s_;  // of the newest row, from the first sample on
  bool started_ = false;          // the start of run has passed
};

}  // namespace diastole
