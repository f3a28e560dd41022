#pragma once
// The rows of /pressure, from blocks of samples: every row of the sample grid once and in order, missing ones included.
//
// A missing row lies evenly between its neighbours in time; before the first and after the last sample that was received
// it lies where it was due. As the last one may have come later than the next was due, a row lies at least a tenth of
// the spacing after the one before. How many there are is told by rows_due.hpp; an instrument that counts its samples by
// a clock of its own may have had more.

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

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
  PressureRows(const ParsedJournal& parsed, const TimeAxis& axis, Take take);

  /// In order of their index (read_blocks). Those of other channels than the journal's beginning says are left out.
  void add(const SampleBlock& block);
  /// All rows that are still missing.
  void finish();
  /// From when to when rows were due; none were: none. Precondition: finished.
  [[nodiscard]] std::optional<runfile::StreamGrid> grid() const;

 private:
  /// Row `next_row_`.
  void give_missing(double time_s);
  void give(const PressureRow& row);
  [[nodiscard]] double due_s(uint64_t row) const;

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
