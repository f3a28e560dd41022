#pragma once
// One recorded run in memory, as the run file holds it (layout.hpp). Plain data: reader.hpp fills and checks
// it, host/runfile writes it, everything else only looks.

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace diastole::runfile {

using Attribute = std::variant<double, int64_t, std::string>;

/// One row of /protocol/segments. A cycle starts at the segment's least volume, offset_mL, at rest.
struct Segment {
  double start_s = 0;
  std::string waveform;
  double stroke_mL = 0;
  double period_s = 0;
  double offset_mL = 0;
  int64_t cycles = 0;

  [[nodiscard]] double end_s() const { return start_s + period_s * static_cast<double>(cycles); }
};

/// The cycles of one image slice: rows [first_trigger, first_trigger + triggers) of /trigger/time_s. The dummy
/// cycles before them are not imaged and belong to no slice.
struct Slice {
  std::string block;          ///< what was imaged: "tagged"
  int64_t number = 0;         ///< of the block, from 0
  int64_t first_trigger = 0;  ///< row
  int64_t triggers = 0;       ///< rows; fewer than `cycles` if the run ended within the slice
  int64_t cycles = 0;         ///< scheduled
  int64_t dummy_cycles = 0;   ///< scheduled before them
};

/// Rows [first_index, first_index + count) of a stream are known to be missing.
struct Gap {
  std::string stream;
  int64_t first_index = 0;
  int64_t count = 0;
  std::string reason;
};

struct Event {
  double time_s = 0;
  std::string level;  ///< "info", "warning", "error"
  std::string code;
  std::string text;
};

/// Where the rows of a stream were due, by the clocks and not as rows were counted: row k at start_s + k / rate_Hz,
/// from the start of run to the end of the recording.
struct StreamGrid {
  double start_s = 0;
  double end_s = 0;  ///< of the last row that was due
  double rate_Hz = 0;

  [[nodiscard]] int64_t rows() const { return 1 + std::llround((end_s - start_s) * rate_Hz); }
};

struct PumpTrace {
  std::optional<StreamGrid> grid;  ///< none: the file does not say
  std::vector<double> time_s;
  std::vector<double> commanded_mL;  ///< steps issued x volume per step
};

struct PressureTrace {
  std::optional<StreamGrid> grid;  ///< none: the file does not say
  std::vector<double> time_s;
  /// By dataset name, "cavity_kPa" always among them; each as long as time_s, NaN where a gap is declared.
  std::map<std::string, std::vector<double>, std::less<>> channels;
  /// What a channel's dataset states about itself besides its unit, by channel: how it was filtered, say.
  std::map<std::string, std::map<std::string, Attribute, std::less<>>, std::less<>> notes;
};

/// Gated phase-contrast cavity volume of one segment, averaged over its cycles.
struct FlowVolume {
  std::vector<double> phase_s;  ///< since the trigger
  std::vector<double> cavity_mL;
  std::vector<double> sigma_mL;
};

/// What the controller followed in an uploaded segment: volumes at even phases, 0 and 1 included.
struct PlayedWaveform {
  std::string points;  ///< the points file as it was given
  std::vector<double> phase;
  std::vector<double> fraction;  ///< of the stroke
};

struct RecordedRun {
  std::string file;  ///< where it was read from, for messages
  std::string run_id;
  std::string started_utc;  ///< ISO 8601
  std::string producer;
  std::map<std::string, Attribute, std::less<>> rig;
  std::string protocol_toml;
  std::vector<Segment> segments;
  std::map<size_t, PlayedWaveform> waveforms;  ///< of uploaded segments, by number
  PumpTrace pump;
  PressureTrace pressure;
  std::vector<double> trigger_s;
  double trigger_delay_s = 0;         ///< from a cycle's first step to its trigger, as asked for
  std::map<size_t, FlowVolume> flow;  ///< by segment number, from 0
  std::map<std::string, double, std::less<>> clock;  ///< e.g. "daq_drift_ppm"
  std::vector<Gap> gaps;
  std::vector<Event> events;
  std::vector<Slice> slices;  ///< empty: the experiment had no schedule of slices

  /// Rows that /gaps declares missing in a stream ("pressure") or one dataset of it ("pressure/cavity_kPa").
  [[nodiscard]] int64_t missing(std::string_view stream) const {
    int64_t total = 0;
    for (const Gap& gap : gaps)
      total += gap.stream == stream ? gap.count : 0;
    return total;
  }
};

}  // namespace diastole::runfile
