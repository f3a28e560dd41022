#pragma once
// A recorded run against its replay, quantity by quantity.
//
// What must agree, and how closely:
//   triggers     number; times to one tick of the controller (11.9 ns)
//   positions    every one of /pump, in whole microsteps, at its time to one tick; steps of each cycle, both ways. When
//                the line was lost, those of the message that was on it (30) may have come in one of the two only
//   samples      number, to one at the end if the start phase differs; the same ones missing
//   pressure     every sample to the resolution of the register that carries it (a float32: 2^-23 of the volts)
//   events       faults of the controller, stops, the end: the same, in the same order; faults to 250 us (the turn of
//                the controller's main loop that notes them), but lease_lost to a heartbeat (50 ms), whose phase is
//                not in the file; what the host noted to one sample and the start phase
// What may differ, and is reported: where within the sampling interval the run began (the start phase), and by how much
// samples came late in the recording (a busy host, a slow answer), which is not brought about. More than one spacing
// of the samples is reported with the verdict.
//
// Of a recording that broke off, only as much as there is.

#include <optional>
#include <string>
#include <vector>

#include "protocol/runfile/reader.hpp"

namespace diastole::replay {

enum class Verdict { equal, differs, reported };

struct Line {
  std::string what;
  std::string recorded;
  std::string replayed;
  std::string difference;
  Verdict verdict = Verdict::equal;
};

/// Where two runs part.
struct Difference {
  double time_s = 0;
  int64_t cycle = -1;  ///< of the recording, from 0; -1: before the first
  std::string text;    ///< what it was and is
};

struct Comparison {
  std::vector<Line> lines;
  std::optional<Difference> first;  ///< in time
  bool triggers_equal = true;
  bool steps_equal = true;
  bool samples_equal = true;  ///< number
  bool missing_equal = true;
  bool pressure_equal = true;
  bool events_equal = true;
  double max_trigger_diff_s = 0;
  int64_t max_steps_diff = 0;  ///< microsteps
  double max_abs_diff_kPa = 0;
  double tolerance_kPa = 0;
  double max_sample_time_diff_s = 0;  ///< beyond the start phase
  double sample_spacing_s = 0;        ///< of the recording
  double start_phase_s = 0;  ///< the replay's first sample lies this much later after the start of run

  [[nodiscard]] bool equal() const {
    return !first && triggers_equal && steps_equal && samples_equal && missing_equal && pressure_equal &&
           events_equal;
  }
  /// Whether every sample of the replay lies within one spacing of where the recording's does.
  [[nodiscard]] bool samples_in_time() const { return max_sample_time_diff_s <= sample_spacing_s; }
};

Comparison compare(const runfile::RunFile& recorded, const runfile::RunFile& replayed);

}  // namespace diastole::replay
