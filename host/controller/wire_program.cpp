#include "host/controller/wire_program.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "protocol/contract/input_error.hpp"
#include "protocol/wire/crc32.hpp"

namespace diastole {
namespace {

/// Bytes per second on the line, with everything that comes beside the positions.
double line_load_B_s(double position_rate_Hz, const Experiment& experiment) {
  constexpr double frame_B = 12;  // header, CRC, COBS
  constexpr double batch_head_B = 17;
  constexpr double positions_a_batch = 30;          // at least, while a run is on
  constexpr double trigger_B = 2 * (frame_B + 16);  // a cycle may also begin a segment
  constexpr double background_B_s = 700;            // time answers, acknowledgements, states, status
  double shortest_period_s = std::numeric_limits<double>::infinity();
  for (const ExperimentSegment& segment : experiment.segments)
    shortest_period_s = std::min(shortest_period_s, segment.period_s);
  return position_rate_Hz * (sizeof(int32_t) + (frame_B + batch_head_B) / positions_a_batch) +
         trigger_B / shortest_period_s + background_B_s;
}

}  // namespace

uint32_t whole(const Quantity& quantity) {
  const double nearest = std::round(quantity.value);
  if (nearest >= quantity.least && nearest <= quantity.most) return static_cast<uint32_t>(nearest);
  throw InputError({quantity.file, quantity.place,
                    fmt::format("comes to {:g} {}, and the controller takes {} to {} {}", quantity.value,
                                quantity.unit, quantity.least, quantity.most, quantity.unit),
                    "Change it so that it lies in this range."});
}

wire::Configure configuration(const RigConfig& rig, uint32_t microstep_pL) {
  const MotionLimits& limits = rig.controller.limits;
  const auto limit = [&](const char* key, double value, const char* unit, uint32_t most) {
    return whole({rig.file, std::string("controller.limits.") + key, value, unit, 1, most});
  };
  wire::Configure message;
  message.microstep_pL = microstep_pL;
  message.travel_uL = limit("travel_mL", 1e3 * limits.travel_mL, "uL", 50'000'000);
  message.flow_uL_per_s = limit("flow_mL_s", 1e3 * limits.flow_mL_s, "uL/s", 10'000'000);
  message.acceleration_uL_per_s2 =
      limit("acceleration_mL_s2", 1e3 * limits.acceleration_mL_s2, "uL/s2", 1'000'000'000);
  message.step_rate_Hz = limit("step_rate_Hz", limits.step_rate_Hz, "microsteps/s", 400'000);
  message.pressure_Pa = limit("pressure_kPa", 1e3 * limits.pressure_kPa, "Pa", 10'000'000);
  message.inertance_kg_per_m4 =
      whole({rig.file, "rig, inertance of the hose", rig.hose_inertance_kg_m4, "kg/m4", 1});
  const auto loss = [&](const char* what, double pressure_Pa) {
    return whole({rig.file, std::string("rig, the hose's ") + what + " at 1 L/s", pressure_Pa, "Pa", 0,
                  1'000'000'000});
  };
  message.laminar_Pa = loss("laminar friction", rig.hose_losses.laminar_Pa);
  message.turbulent_Pa = loss("turbulent friction", rig.hose_losses.turbulent_Pa);
  message.minor_Pa = loss("minor losses", rig.hose_losses.minor_Pa);
  message.cavity_Pa =
      whole({rig.file, "controller.limits.cavity_kPa", 1e3 * limits.cavity_kPa, "Pa", 0, 10'000'000});
  message.lease_us = static_cast<uint32_t>(rig.controller.lease_ms * 1000);
  message.homing_flow_uL_per_s = limit("homing_flow_mL_s", 1e3 * limits.homing_flow_mL_s, "uL/s", 10'000'000);
  return message;
}

double reported_rate_Hz(const Experiment& experiment, const ControllerConfig& controller) {
  constexpr double least_Hz = 300;
  constexpr double most_Hz = 1000;
  constexpr double bits_a_byte = 10;
  constexpr double usable = 0.8;  // the rest is for repetitions
  const double rate_Hz = std::clamp(experiment.sample_rate_Hz, least_Hz, most_Hz);
  const double load_baud = bits_a_byte / usable * line_load_B_s(rate_Hz, experiment);
  if (load_baud <= controller.baud) return rate_Hz;
  throw InputError({experiment.file, "sample_rate_Hz",
                    fmt::format("with {:g} positions/s and these periods the line to the controller needs "
                                "{:.0f} baud, and it has {}",
                                rate_Hz, load_baud, controller.baud),
                    fmt::format("Raise baud in the rig file{}, or lengthen the shortest period_s.",
                                rate_Hz > least_Hz ? ", lower sample_rate_Hz (to 300 at the least)" : "")});
}

wire::AddSegment segment_message(const Experiment& experiment, size_t index) {
  const ExperimentSegment& segment = experiment.segments[index];
  const auto quantity = [&](const char* key, double value, const char* unit) {
    return whole({experiment.file, fmt::format("segment[{}].{}", index, key), value, unit});
  };
  wire::AddSegment message;
  message.waveform = segment.waveform;
  message.cycles = static_cast<uint32_t>(segment.cycles);
  message.stroke_nL = quantity("stroke_mL", 1e6 * segment.stroke_mL, "nL");
  message.offset_nL = quantity("offset_mL", 1e6 * segment.offset_mL, "nL");
  message.period_us = quantity("period_s", 1e6 * segment.period_s, "us");
  message.upload = static_cast<uint8_t>(segment.upload.value_or(0));
  return message;
}

wire::UploadWaveform waveform_message(const std::vector<int16_t>& rises, size_t number) {
  wire::Crc32 crc;
  for (const int16_t rise : rises) {
    crc.add(static_cast<uint8_t>(rise & 0xFF));
    crc.add(static_cast<uint8_t>((rise >> 8) & 0xFF));
  }
  return {0, static_cast<uint8_t>(number), static_cast<uint16_t>(rises.size()), crc.value()};
}

std::vector<wire::WaveformPoints> waveform_batches(const std::vector<int16_t>& rises) {
  std::vector<wire::WaveformPoints> batches;
  for (size_t first = 0; first < rises.size(); first += wire::WaveformPoints::kMaxCount) {
    wire::WaveformPoints& batch = batches.emplace_back();
    batch.first = static_cast<uint16_t>(first);
    batch.count = static_cast<uint8_t>(std::min(wire::WaveformPoints::kMaxCount, rises.size() - first));
    std::copy_n(rises.begin() + static_cast<std::ptrdiff_t>(first), batch.count, batch.rise.begin());
  }
  return batches;
}

wire::Arm arm_message(const Experiment& experiment, const RigConfig& rig) {
  wire::Arm arm;
  arm.gate_every = static_cast<uint16_t>(experiment.gate_every);
  arm.rest_us = whole({experiment.file, "rest_s", 1e6 * experiment.rest_s, "us"});
  arm.ttl_width_us = whole({rig.file, "controller.ttl_width_ms", 1e3 * rig.controller.ttl_width_ms, "us", 1});
  arm.trigger_delay_us =
      whole({experiment.file, "trigger_delay_ms", 1e3 * experiment.trigger_delay_ms, "us", 0, 10'000'000});
  return arm;
}

}  // namespace diastole
