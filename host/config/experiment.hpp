#pragma once
// The experiment file (format "diastole-experiment", version 1): what is to be run. Here only its own sense
// is checked; whether the rig can do it, the controller decides when it plans the program.

#include <cstdint>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "host/config/even_waveform.hpp"
#include "host/config/points_file.hpp"
#include "host/config/schedule.hpp"
#include "protocol/wire/states.hpp"

namespace diastole {

struct ExperimentSegment {
  std::string waveform_name;  ///< as the file spells it: "reversed-sawtooth"
  wire::Waveform waveform{};
  double stroke_mL = 0;
  double offset_mL = 0;
  double period_s = 0;
  int64_t cycles = 1;
  std::optional<size_t> upload;  ///< which of the experiment's waveforms, if it is an uploaded one
};

/// A points file that segments name.
struct ExperimentWaveform {
  std::string name;  ///< as `points` spells it
  PointsFile points;
  EvenWaveform even;
};

struct Experiment {
  std::string file;  ///< for messages
  std::string text;  ///< the whole file, as it goes into the run file
  double sample_rate_Hz = 300;
  int64_t gate_every = 1;
  double trigger_delay_ms = 0;  ///< TTL and R-wave come that long after the cycle's first step
  double rest_s = 1.0;          ///< stillness between the start of run and the first segment
  std::vector<ExperimentSegment> segments;
  std::vector<ExperimentWaveform> waveforms;  ///< each once, in the order in which they are first named

  /// Of an imaging study, whose one segment then has as many cycles as the schedule may take.
  std::optional<Schedule> schedule = {};

  [[nodiscard]] int64_t cycles() const;
  /// The same, but without the cycles that a schedule allows for waiting.
  [[nodiscard]] int64_t planned_cycles() const;
  /// Rest and planned cycles.
  [[nodiscard]] double estimate_s() const;
  /// Rest and cycles; ramps between offsets come on top.
  [[nodiscard]] double least_duration_s() const;
};

/// The text of a points file, by its name in the experiment. Throws InputError if there is none.
using ReadPoints = std::function<std::string(const std::string& name)>;

/// Throws InputError with file, line and key. Without `read_points` no segment can be uploaded.
Experiment parse_experiment(std::string_view text, const std::string& file,
                            const ReadPoints& read_points = {});
/// Points files are looked for beside the experiment.
Experiment read_experiment(const std::string& file);

/// Leaves these slices out of a study, of which others are still due.
void leave_out(Experiment& study, std::set<int64_t> done);

/// What is allowed, and hardly meant: one sentence for each, with what may have been meant.
std::vector<std::string> doubts_about(const Experiment& experiment);

}  // namespace diastole
