#pragma once
// An experiment and a rig file as the messages that load them into the controller. A number that the protocol cannot
// carry throws InputError with its file, place and range.

#include <vector>

#include "host/config/experiment.hpp"
#include "host/config/rig_config.hpp"
#include "protocol/wire/messages.hpp"

namespace diastole {

/// A quantity of a file on its way into a message: `value` in the wire's unit, and what the wire can carry.
struct Quantity {
  const std::string& file;
  std::string place;
  double value;
  const char* unit;
  uint32_t least = 0;
  uint32_t most = UINT32_MAX;
};

/// The nearest whole number.
uint32_t whole(const Quantity& quantity);

wire::Configure configuration(const RigConfig& rig, uint32_t microstep_pL);

/// At which the controller reports positions: as the samples come, between 300 Hz, which a run file promises, and
/// 1000 Hz. Throws InputError when the line's baud rate does not carry that.
double reported_rate_Hz(const Experiment& experiment, const ControllerConfig& controller);

wire::AddSegment segment_message(const Experiment& experiment, size_t index);
/// An uploaded waveform begins with this message, and its points follow in batches.
wire::UploadWaveform waveform_message(const std::vector<int16_t>& rises, size_t number);
std::vector<wire::WaveformPoints> waveform_batches(const std::vector<int16_t>& rises);
wire::Arm arm_message(const Experiment& experiment, const RigConfig& rig);

}  // namespace diastole
