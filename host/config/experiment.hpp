#pragma once
// The experiment file (format "diastole-experiment", version 1): what is to be run. Here only its own sense
// is checked; whether the rig can do it, the controller decides when it plans the program.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/wire/states.hpp"

namespace diastole {

struct ExperimentSegment {
  std::string waveform_name;  ///< as the file spells it: "reversed-sawtooth"
  wire::Waveform waveform{};
  double stroke_mL = 0;
  double offset_mL = 0;
  double period_s = 0;
  int64_t cycles = 1;
};

struct Experiment {
  std::string file;  ///< for messages
  std::string text;  ///< the whole file, as it goes into the run file
  double sample_rate_Hz = 300;
  int64_t gate_every = 1;
  double rest_s = 1.0;  ///< stillness between the start of run and the first segment
  std::vector<ExperimentSegment> segments;

  [[nodiscard]] int64_t cycles() const;
  /// Rest and cycles; ramps between offsets come on top.
  [[nodiscard]] double least_duration_s() const;
};

/// Throws InputError with file, line and key.
Experiment parse_experiment(std::string_view text, const std::string& file);
Experiment read_experiment(const std::string& file);

}  // namespace diastole
