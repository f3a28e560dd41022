#pragma once
// The schedule of an imaging study: which of the pump's cycles the scanner makes its slices of (table [schedule] of an
// experiment file). The pump goes on cycling through the whole study, so that the specimen never rests:
//
//   |d d d|i i i ... i i|p p|d d d|i i i ... i i|p p| ...        d dummy cycles, i imaged, p pause
//         slice 0                 slice 1
//
// A block with a prompt waits before each of its slices for the operator, who sets the scanner; the pump cycles
// meanwhile, up to wait_cycles_at_most cycles in all. At the end of the last slice the run ends by itself.
//
// A session that broke off goes on in another run, which leaves out the slices that are `done`.

#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/contract/table_reader.hpp"

namespace diastole {

/// What the scanner takes of each interval of gate_every cycles.
struct PlannedFrames {
  int64_t frames = 0;
  double first_ms = 0;
  double tr_ms = 0;
};

struct ScheduleBlock {
  std::string name;  ///< "tagged"
  int64_t slices = 1;
  int64_t cycles_per_slice = 1;
  std::string prompt = {};  ///< empty: goes on by itself
  int64_t gate_every = 1;   ///< the scanner takes every n-th R-wave
  std::optional<PlannedFrames> frames = {};
};

struct Schedule {
  int64_t dummy_cycles = 0;  ///< before each slice
  int64_t pause_cycles = 0;  ///< after each slice but the last
  int64_t wait_cycles_at_most = 0;
  std::vector<ScheduleBlock> blocks;
  std::set<int64_t> done = {};  ///< slices, of all, that earlier runs of the session have imaged; of no file

  [[nodiscard]] bool waits() const;
  /// Of the whole session.
  [[nodiscard]] int64_t slices() const;
  /// Of all slices that are not done, with dummies and pauses; what waiting takes comes on top.
  [[nodiscard]] int64_t cycles() const;
  /// As many as the controller is asked for, so that no wait that is allowed runs out.
  [[nodiscard]] int64_t cycles_at_most() const { return cycles() + (waits() ? wait_cycles_at_most : 0); }
};

struct PlannedSlice {
  std::string block;
  int64_t number = 0;  ///< of the block
  int64_t dummy_cycles = 0;
  int64_t cycles = 0;
  int64_t pause_cycles = 0;
  std::string prompt;
  bool done = false;
};

/// One after the other, those that are done among them.
std::vector<PlannedSlice> planned_slices(const Schedule& schedule);

/// `period_s` of the cycles. A block gives cycles_per_slice, or lines, lines_per_segment and averages, of which
///   cycles_per_slice = ceil(lines / lines_per_segment) x averages;
/// and may give the frames that the scanner takes (frames, first_ms, tr_ms, gate_every): they must end within
/// gate_every cycles. Throws InputError with file, line and key.
Schedule read_schedule(TableReader table, double period_s);

/// The schedule of an experiment file's text, if it has one. Throws InputError where that is not to be read.
std::optional<Schedule> schedule_of(std::string_view experiment, const std::string& file);

}  // namespace diastole
