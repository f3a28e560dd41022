#pragma once
// Whether a run can be trusted, and if not why not, each reason with its place: samples that are missing, declared or
// not, streams that do not reach from the start of run to its end, or have not as many rows as were due, triggers that are missing, extra or out of time (cycles.hpp), slices that are not complete, clocks that cannot
// be, samples at the end of the instrument's range (saturation.hpp), faults.

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/runfile/run.hpp"
#include "protocol/runfile/spacing.hpp"
#include "protocol/runfile/stream_rows.hpp"

namespace diastole::runfile {

struct StreamFacts {
  size_t rows = 0;
  int64_t missing = 0;  ///< of them, declared in /gaps
  std::optional<int64_t>
      expected;        ///< rows that were due by the clocks (StreamGrid); none: the file does not say
  double rate_Hz = 0;  ///< from the median spacing; 0 for fewer than two rows
  Irregularity irregularity{};  ///< no fault as long as nothing is missing (spacing.hpp)

  [[nodiscard]] bool any() const { return missing < static_cast<int64_t>(rows); }
};

/// Of a channel's samples; without any, least > most.
struct Range {
  double least = 0;
  double most = 0;
  [[nodiscard]] bool any() const { return least <= most; }
};

/// Triggers of all segments against their schedule.
struct TriggerCounts {
  int64_t scheduled = 0;  ///< those of holds only if they were triggered
  int64_t missing = 0;
  int64_t extra = 0;  ///< within and outside the segments
  int64_t non_periodic = 0;
};

/// A clock that runs further from the controller's than this has not been mapped rightly: crystals differ by tens
/// of ppm.
inline constexpr double plausible_drift_ppm = 1000;
/// The pump's rows may end before the run by this part of a period: they end with its last step, and a cycle that comes
/// to rest makes that some time before its end.
inline constexpr double last_step_periods = 0.05;

struct Soundness {
  StreamFacts pressure;
  StreamFacts pump;
  double duration_s = 0;            ///< of the pressure stream
  int64_t scheduled_cycles = 0;     ///< of all segments that move
  int64_t scheduled_holds = 0;      ///< cycles of waveform "hold", which may be triggered or not
  bool stopped_on_request = false;  ///< somebody ended it early, in order: fewer triggers are no fault
  TriggerCounts triggers{};
  std::map<std::string, int64_t>
      saturated;  ///< samples at the end of the instrument's range, by channel; all channels
  std::map<std::string, Range> ranges;  ///< by channel
  std::vector<std::string> problems;    ///< "place: what is wrong there"; empty if the run is sound

  [[nodiscard]] bool sound() const { return problems.empty(); }
};

/// Whether an event's code says that a run was ended early and in order.
bool is_stop_on_request(std::string_view code);
bool was_stopped_on_request(const RecordedRun& run);

/// When the motion ended that the segments plan, or when it was broken off, as an event says; 0 without segments.
double end_of_motion_s(const RecordedRun& run);

/// Precondition: the run has passed `check`.
Soundness assess(const RecordedRun& run);
/// The same of a run without rows, and these.
Soundness assess(const RecordedRun& run, const RunRows& rows);

}  // namespace diastole::runfile
