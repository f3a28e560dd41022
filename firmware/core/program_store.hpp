#pragma once
// What the host has configured and loaded for a run: machine, geometry and limits, segments, uploaded waveforms. Whether
// the state allows a change is for the caller to say; here it is checked that what is asked can be.

#include <cstdint>

#include "firmware/core/plan_check.hpp"
#include "firmware/core/program.hpp"
#include "firmware/core/uploaded/waveform_store.hpp"
#include "protocol/wire/machine_settings.hpp"

namespace diastole::firmware {

class ProgramStore {
 public:
  /// Settings from flash; `written` unless they are the initial ones. Forgets what was configured, and the segments.
  void use(const wire::MachineSettings& machine, bool written);
  /// Geometry and limits; refused where they disagree with machine settings that were ever written.
  PlanRefusal configure(const wire::Configure& configure);
  /// Forgets segments and waveforms.
  void clear();
  wire::Refusal add(const wire::AddSegment& add);
  wire::Refusal upload(const wire::UploadWaveform& upload);
  wire::Refusal upload(const wire::WaveformPoints& points);
  /// Takes over what Arm holds and checks the whole program.
  PlanRefusal arm(const wire::Arm& arm);

  [[nodiscard]] bool configured() const { return configured_; }
  [[nodiscard]] const Settings& settings() const { return settings_; }
  [[nodiscard]] const Program& program() const { return program_; }
  [[nodiscard]] std::uint32_t backlash_steps() const { return backlash_steps_; }
  /// Of the armed program: in which the play is taken up, and the longest that a controlled stop takes.
  [[nodiscard]] Ticks compensation_window() const { return compensation_window_; }
  [[nodiscard]] Ticks stopping_time() const { return stopping_time_; }

 private:
  wire::MachineSettings machine_;
  bool machine_written_ = false;
  std::uint32_t backlash_steps_ = 0;
  Settings settings_;
  bool configured_ = false;
  Program program_;
  WaveformStore waveforms_;
  Ticks compensation_window_;
  Ticks stopping_time_;
};

}  // namespace diastole::firmware
