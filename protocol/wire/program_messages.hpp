#pragma once
// What is to be run and within which limits. The whole program lies on the controller before motion begins.

#include <cstddef>
#include <cstdint>

#include "protocol/wire/common_requests.hpp"
#include "protocol/wire/field_codec.hpp"
#include "protocol/wire/message_type.hpp"
#include "protocol/wire/states.hpp"

namespace diastole::wire {

// clang-format off

// Host → controller: geometry and limits; allowed while nothing moves; clears the program. The commanded
// volume is position times microstep_pL, exactly. The pressure at the piston is at most, in Pa, with the flow q in L/s,
//
//   1e-9 inertance_kg_per_m4 acceleration_uL_per_s2        what accelerates the fluid in the hose
//   + max(laminar_Pa q, turbulent_Pa q^1.75)               friction: Hagen-Poiseuille, Blasius
//   + minor_Pa q^2                                         losses at the hose's ends and bends
//   + cavity_Pa                                            what the specimen holds against it
//
// Example Configure: 02 00 21 E4 76 00 C0 CF 6A 00 A0 61 1C 00 A0 F0 19 00 80 A9 03 00 C4 35 01 00 00 63
//   9F 02 20 A1 07 00 88 13 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00
struct Configure {
  DIASTOLE_LAYOUT(Configure,
      (value,   0, uint16_t, request_id),  // chosen by the host; the answer repeats it
      (within,  2, uint32_t, microstep_pL, 1U, 4'000'000'000U),            // volume of one microstep
      (within,  6, uint32_t, travel_uL, 1U, 50'000'000U),  // largest volume displaced, from the home position
      (within, 10, uint32_t, flow_uL_per_s, 1U, 10'000'000U),              // limit
      // limit; also the deceleration of a controlled stop
      (within, 14, uint32_t, acceleration_uL_per_s2, 1U, 1'000'000'000U),
      (within, 18, uint32_t, step_rate_Hz, 1U, 400'000U),                  // limit, in microsteps
      (within, 22, uint32_t, pressure_Pa, 1U, 10'000'000U),                // limit
      (value,  26, uint32_t, inertance_kg_per_m4),  // of the hose; 0 switches the pressure limit off
      (within, 30, uint32_t, lease_us, 100'000U, 5'000'000U),  // last heartbeat to standstill at most
      (within, 34, uint32_t, homing_flow_uL_per_s, 1U, 10'000'000U),       // speed of homing
      (within, 38, uint32_t, laminar_Pa, 0U, 1'000'000'000U),              // at 1 L/s
      (within, 42, uint32_t, turbulent_Pa, 0U, 1'000'000'000U),            // at 1 L/s
      (within, 46, uint32_t, minor_Pa, 0U, 1'000'000'000U),                // at 1 L/s
      (within, 50, uint32_t, cavity_Pa, 0U, 10'000'000U))
  static constexpr Configure example() {
    return {.request_id = 2,
            .microstep_pL = 7'791'649,
            .travel_uL = 7'000'000,
            .flow_uL_per_s = 1'860'000,
            .acceleration_uL_per_s2 = 1'700'000,
            .step_rate_Hz = 240'000,
            .pressure_Pa = 79'300,
            .inertance_kg_per_m4 = 44'000'000,
            .lease_us = 500'000,
            .homing_flow_uL_per_s = 5'000};
  }
};

// Host → controller: forgets all segments and uploaded waveforms; armed becomes homed.
//
// Example ClearProgram: 07 01
using ClearProgram = BareRequest<MessageType::ClearProgram>;

// Host → controller: appends one segment. V(t) = offset + stroke times the waveform, repeated `cycles`
// times; a smooth ramp leads to the offset before it. The experiment file describes the same in mL and s.
//
// Example AddSegment: 03 00 00 0A 00 00 00 00 5A 62 02 00 00 00 00 80 4F 12 00 00
struct AddSegment {
  DIASTOLE_LAYOUT(AddSegment,
      (value,   0, uint16_t, request_id),                       // chosen by the host; the answer repeats it
      (choice,  2, Waveform, waveform, kLastWaveform),          // waveform_list.inc
      (within,  3, uint32_t, cycles, 1U, 10'000'000U),
      (value,   7, uint32_t, stroke_nL),
      (value,  11, uint32_t, offset_nL),  // least volume of the cycle, from home (a hold: plus stroke)
      (within, 15, uint32_t, period_us, 1'000U, 600'000'000U),
      (value,  19, uint8_t, upload))  // number of the UploadWaveform, if waveform is uploaded
  static constexpr AddSegment example() {
    return {.request_id = 3,
            .waveform = Waveform::parabolic,
            .cycles = 10,
            .stroke_nL = 40'000'000,
            .offset_nL = 0,
            .period_us = 1'200'000};
  }
};

/// What a controller holds of uploaded waveforms, all of them together.
inline constexpr std::uint16_t kMaxWaveformPoints = 4096;
inline constexpr std::uint8_t kMaxWaveforms = 8;

// Host → controller: a waveform of the host's own follows in lots of WaveformPoints. It has `points` points at
// even phases, the first at phase 0, and is carried by the rises from each point to the next, the last one back
// to the first. Waveforms are numbered from 0 in the order of their upload; ClearProgram forgets them.
//
// Example UploadWaveform: 08 00 00 04 00 1E 1D EB 54
struct UploadWaveform {
  DIASTOLE_LAYOUT(UploadWaveform,
      (value,   0, uint16_t, request_id),                      // chosen by the host; the answer repeats it
      (value,   2, uint8_t, waveform),                         // number: as many as have been uploaded before
      (within,  3, uint16_t, points, 2U, kMaxWaveformPoints),  // a cycle
      (value,   5, uint32_t, crc))  // CRC-32 of all rises, as they stand in WaveformPoints
  static constexpr UploadWaveform example() {
    return {.request_id = 8, .waveform = 0, .points = 4, .crc = 0x54EB1D1E};
  }
};

// Host → controller: rises of the waveform that is being uploaded, in units of which the stroke has as many as
// the greatest sum of rises. With the last lot the whole is checked: the checksum, that it begins at its least
// volume and closes. A refusal drops the waveform.
//
// Example WaveformPoints: 09 00 00 00 04 00 40 FF 3F 01 C0 00 C0
struct WaveformPoints {
  static constexpr std::size_t kMaxCount = 100;
  DIASTOLE_LAYOUT(WaveformPoints,
      (value,  0, uint16_t, request_id),             // chosen by the host; the answer repeats it
      (value,  2, uint16_t, first),                  // number of the first of them, from 0
      (list,   4, count, int16_t, rise, kMaxCount))  // signed
  static constexpr WaveformPoints example() {
    return {.request_id = 9, .first = 0, .count = 4, .rise = {16'384, 16'383, -16'383, -16'384}};
  }
};

// Host → controller: checks the whole program against the limits. Accepted: StateChanged (armed), Ack, and
// behind the Ack one SegmentPlanned for every segment, in order; the plan is complete when as many have come
// as segments were added. Refused: Nak with the limit, the value asked and the value allowed.
//
// Example Arm: 04 00 01 00 40 42 0F 00 10 27 00 00 C0 45 04 00 00 00 00 00
struct Arm {
  DIASTOLE_LAYOUT(Arm,
      (value,   0, uint16_t, request_id),  // chosen by the host; the answer repeats it
      // R-wave at every n-th cycle; the TTL rises at every cycle
      (within,  2, uint16_t, gate_every, 1U, 10'000U),
      (within,  4, uint32_t, rest_us, 1'000U, 60'000'000U),  // from start of run to the first segment
      (within,  8, uint32_t, ttl_width_us, 10U, 1'000'000U),
      (within, 12, uint32_t, position_period_ticks, 1'000U, 1'000'000'000U),  // of the position stream
      // TTL and R-wave that long after the cycle's first step; 0 or from 100
      (within, 16, uint32_t, trigger_delay_us, 0U, 10'000'000U))
  static constexpr Arm example() {
    return {.request_id = 4,
            .gate_every = 1,
            .rest_us = 1'000'000,
            .ttl_width_us = 10'000,
            .position_period_ticks = 280'000,
            .trigger_delay_us = 0};
  }
};

// Controller → host: what one segment of the armed program asks of the rig. Follows Arm's Ack.
//
// Example SegmentPlanned: 00 00 40 42 0F 00 00 00 00 00 00 1B B7 00 00 00 00 00 D6 08 02 00 1D C8 06 00
//   D9 42 00 00 64 4C 00 00 0E 14 00 00
struct SegmentPlanned {
  DIASTOLE_LAYOUT(SegmentPlanned,
      (value,  0, uint16_t, segment),                      // index, from 0
      (value,  2, uint64_t, start_us),  // its first cycle begins this long after the start of run
      (value, 10, uint64_t, duration_us),                  // cycles times period
      (value, 18, uint32_t, peak_flow_uL_per_s),
      (value, 22, uint32_t, peak_acceleration_uL_per_s2),
      (value, 26, uint32_t, peak_step_rate_Hz),
      (value, 30, uint32_t, peak_pressure_Pa),             // see Configure
      (value, 34, uint32_t, cycle_microsteps))             // stroke in whole microsteps
  static constexpr SegmentPlanned example() {
    return {.segment = 0,
            .start_us = 1'000'000,
            .duration_us = 12'000'000,
            .peak_flow_uL_per_s = 133'334,
            .peak_acceleration_uL_per_s2 = 444'445,
            .peak_step_rate_Hz = 17'113,
            .peak_pressure_Pa = 19'556,
            .cycle_microsteps = 5'134};
  }
};

// clang-format on

}  // namespace diastole::wire
