#pragma once
// What is to be run and within which limits. The whole program lies on the controller before motion begins.

#include <array>
#include <cstddef>
#include <cstdint>

#include "protocol/wire/common_requests.hpp"
#include "protocol/wire/field_codec.hpp"
#include "protocol/wire/message_type.hpp"
#include "protocol/wire/states.hpp"

namespace diastole::wire {

// Host → controller: geometry and limits; allowed while nothing moves; clears the program. The commanded
// volume is position times microstep_pL, exactly. Pressure is what accelerates the fluid in the hose,
// inertance times volume acceleration: 1e-9 inertance_kg_per_m4 acceleration_uL_per_s2, in Pa; friction
// and the specimen come on top.
//
//   offset size field
//        0    2 request_id                   chosen by the host; the answer repeats it
//        2    4 microstep_pL                 volume of one microstep
//        6    4 travel_uL                    largest volume displaced, from the home position
//       10    4 flow_uL_per_s                limit
//       14    4 acceleration_uL_per_s2       limit; also the deceleration of a controlled stop
//       18    4 step_rate_Hz                 limit, in microsteps
//       22    4 pressure_Pa                  limit
//       26    4 inertance_kg_per_m4          of the hose; 0 switches the pressure limit off
//       30    4 lease_us                     last heartbeat to standstill at most
//       34    4 homing_flow_uL_per_s         speed of homing
//
// Example Configure: 02 00 21 E4 76 00 C0 CF 6A 00 A0 61 1C 00 A0 F0 19 00 80 A9 03 00 C4 35 01 00 00 63
//   9F 02 20 A1 07 00 88 13 00 00
struct Configure {
  static constexpr MessageType kType = MessageType::Configure;
  std::uint16_t request_id = 0;
  std::uint32_t microstep_pL = 1U;
  std::uint32_t travel_uL = 1U;
  std::uint32_t flow_uL_per_s = 1U;
  std::uint32_t acceleration_uL_per_s2 = 1U;
  std::uint32_t step_rate_Hz = 1U;
  std::uint32_t pressure_Pa = 1U;
  std::uint32_t inertance_kg_per_m4 = 0;
  std::uint32_t lease_us = 100'000U;
  std::uint32_t homing_flow_uL_per_s = 1U;

  static constexpr void layout(auto& self, auto& visit) {
    visit.field("request_id", self.request_id);
    visit.field("microstep_pL", self.microstep_pL, 1U, 4'000'000'000U);
    visit.field("travel_uL", self.travel_uL, 1U, 50'000'000U);
    visit.field("flow_uL_per_s", self.flow_uL_per_s, 1U, 10'000'000U);
    visit.field("acceleration_uL_per_s2", self.acceleration_uL_per_s2, 1U, 1'000'000'000U);
    visit.field("step_rate_Hz", self.step_rate_Hz, 1U, 400'000U);
    visit.field("pressure_Pa", self.pressure_Pa, 1U, 10'000'000U);
    visit.field("inertance_kg_per_m4", self.inertance_kg_per_m4);
    visit.field("lease_us", self.lease_us, 100'000U, 5'000'000U);
    visit.field("homing_flow_uL_per_s", self.homing_flow_uL_per_s, 1U, 10'000'000U);
  }
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
//   offset size field
//        0    2 request_id                   chosen by the host; the answer repeats it
//
// Example ClearProgram: 07 01
using ClearProgram = BareRequest<MessageType::ClearProgram>;

// Host → controller: appends one segment. V(t) = offset + stroke times the waveform, repeated `cycles`
// times; a smooth ramp leads to the offset before it. The experiment file describes the same in mL and s.
//
//   offset size field
//        0    2 request_id                   chosen by the host; the answer repeats it
//        2    1 waveform                     waveform_list.inc
//        3    4 cycles
//        7    4 stroke_nL
//       11    4 offset_nL                    least volume of the cycle, from home (a hold: plus stroke)
//       15    4 period_us
//       19    1 upload                       number of the UploadWaveform, if waveform is uploaded
//
// Example AddSegment: 03 00 00 0A 00 00 00 00 5A 62 02 00 00 00 00 80 4F 12 00 00
struct AddSegment {
  static constexpr MessageType kType = MessageType::AddSegment;
  std::uint16_t request_id = 0;
  Waveform waveform{};
  std::uint32_t cycles = 1U;
  std::uint32_t stroke_nL = 0;
  std::uint32_t offset_nL = 0;
  std::uint32_t period_us = 1'000U;
  std::uint8_t upload = 0U;

  static constexpr void layout(auto& self, auto& visit) {
    visit.field("request_id", self.request_id);
    visit.choice("waveform", self.waveform, kLastWaveform);
    visit.field("cycles", self.cycles, 1U, 10'000'000U);
    DIASTOLE_FIELDS(stroke_nL, offset_nL);
    visit.field("period_us", self.period_us, 1'000U, 600'000'000U);
    visit.field("upload", self.upload);
  }
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
//   offset size field
//        0    2 request_id                   chosen by the host; the answer repeats it
//        2    1 waveform                     number: as many as have been uploaded before
//        3    2 points                       a cycle
//        5    4 crc                          CRC-32 of all rises, as they stand in WaveformPoints
//
// Example UploadWaveform: 08 00 00 04 00 1E 1D EB 54
struct UploadWaveform {
  static constexpr MessageType kType = MessageType::UploadWaveform;
  std::uint16_t request_id = 0;
  std::uint8_t waveform = 0U;
  std::uint16_t points = 2U;
  std::uint32_t crc = 0;

  static constexpr void layout(auto& self, auto& visit) {
    DIASTOLE_FIELDS(request_id, waveform);
    visit.field("points", self.points, 2U, kMaxWaveformPoints);
    visit.field("crc", self.crc);
  }
  static constexpr UploadWaveform example() {
    return {.request_id = 8, .waveform = 0, .points = 4, .crc = 0x54EB1D1E};
  }
};

// Host → controller: rises of the waveform that is being uploaded, in units of which the stroke has as many as
// the greatest sum of rises. With the last lot the whole is checked: the checksum, that it begins at its least
// volume and closes. A refusal drops the waveform.
//
//   offset size field
//        0    2 request_id                   chosen by the host; the answer repeats it
//        2    2 first                        number of the first of them, from 0
//        4    1 count
//        5   2n rise                         signed
//
// Example WaveformPoints: 09 00 00 00 04 00 40 FF 3F 01 C0 00 C0
struct WaveformPoints {
  static constexpr MessageType kType = MessageType::WaveformPoints;
  static constexpr std::size_t kMaxCount = 100;
  std::uint16_t request_id = 0;
  std::uint16_t first = 0;
  std::uint8_t count = 0U;
  std::array<std::int16_t, kMaxCount> rise{};

  static constexpr void layout(auto& self, auto& visit) {
    DIASTOLE_FIELDS(request_id, first);
    visit.list("rise", self.count, self.rise);
  }
  static constexpr WaveformPoints example() {
    return {.request_id = 9, .first = 0, .count = 4, .rise = {16'384, 16'383, -16'383, -16'384}};
  }
};

// Host → controller: checks the whole program against the limits. Accepted: StateChanged (armed), Ack, and
// behind the Ack one SegmentPlanned for every segment, in order; the plan is complete when as many have come
// as segments were added. Refused: Nak with the limit, the value asked and the value allowed.
//
//   offset size field
//        0    2 request_id                   chosen by the host; the answer repeats it
//        2    2 gate_every                   R-wave at every n-th cycle; the TTL rises at every cycle
//        4    4 rest_us                      from start of run to the first segment
//        8    4 ttl_width_us
//       12    4 position_period_ticks        of the position stream
//       16    4 trigger_delay_us             TTL and R-wave that long after the cycle's first step; 0 or from 100
//
// Example Arm: 04 00 01 00 40 42 0F 00 10 27 00 00 C0 45 04 00 00 00 00 00
struct Arm {
  static constexpr MessageType kType = MessageType::Arm;
  std::uint16_t request_id = 0;
  std::uint16_t gate_every = 1U;
  std::uint32_t rest_us = 1'000U;
  std::uint32_t ttl_width_us = 10U;
  std::uint32_t position_period_ticks = 1'000U;
  std::uint32_t trigger_delay_us = 0U;

  static constexpr void layout(auto& self, auto& visit) {
    visit.field("request_id", self.request_id);
    visit.field("gate_every", self.gate_every, 1U, 10'000U);
    visit.field("rest_us", self.rest_us, 1'000U, 60'000'000U);
    visit.field("ttl_width_us", self.ttl_width_us, 10U, 1'000'000U);
    visit.field("position_period_ticks", self.position_period_ticks, 1'000U, 1'000'000'000U);
    visit.field("trigger_delay_us", self.trigger_delay_us, 0U, 10'000'000U);
  }
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
//   offset size field
//        0    2 segment                      index, from 0
//        2    8 start_us                     its first cycle begins this long after the start of run
//       10    8 duration_us                  cycles times period
//       18    4 peak_flow_uL_per_s
//       22    4 peak_acceleration_uL_per_s2
//       26    4 peak_step_rate_Hz
//       30    4 peak_pressure_Pa             see Configure
//       34    4 cycle_microsteps             stroke in whole microsteps
//
// Example SegmentPlanned: 00 00 40 42 0F 00 00 00 00 00 00 1B B7 00 00 00 00 00 D6 08 02 00 1D C8 06 00
//   D9 42 00 00 64 4C 00 00 0E 14 00 00
struct SegmentPlanned {
  static constexpr MessageType kType = MessageType::SegmentPlanned;
  std::uint16_t segment = 0;
  std::uint64_t start_us = 0;
  std::uint64_t duration_us = 0;
  std::uint32_t peak_flow_uL_per_s = 0;
  std::uint32_t peak_acceleration_uL_per_s2 = 0;
  std::uint32_t peak_step_rate_Hz = 0;
  std::uint32_t peak_pressure_Pa = 0;
  std::uint32_t cycle_microsteps = 0;

  static constexpr void layout(auto& self, auto& visit) {
    DIASTOLE_FIELDS(segment, start_us, duration_us, peak_flow_uL_per_s, peak_acceleration_uL_per_s2,
                    peak_step_rate_Hz, peak_pressure_Pa, cycle_microsteps);
  }
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

}  // namespace diastole::wire
