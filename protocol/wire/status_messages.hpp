#pragma once
// Answers and the state at a moment.

#include <cstdint>

#include "protocol/wire/common_requests.hpp"
#include "protocol/wire/faults.hpp"
#include "protocol/wire/field_codec.hpp"
#include "protocol/wire/message_type.hpp"
#include "protocol/wire/states.hpp"

namespace diastole::wire {

// Host → controller: answer with Status.
//
//   offset size field
//        0    2 request_id                   chosen by the host; the answer repeats it
//
// Example StatusRequest: 07 01
using StatusRequest = BareRequest<MessageType::StatusRequest>;

// Controller → host: the request was carried out, or for a motion begun.
//
//   offset size field
//        0    2 request_id                   chosen by the host; the answer repeats it
//        2    1 request_type                 MessageType of the request
//
// Example Ack: 04 00 13
struct Ack {
  static constexpr MessageType kType = MessageType::Ack;
  std::uint16_t request_id = 0;
  std::uint8_t request_type = 0;

  static constexpr void layout(auto& self, auto& visit) { DIASTOLE_FIELDS(request_id, request_type); }
  static constexpr Ack example() { return {.request_id = 4, .request_type = 0x13}; }
};

// Controller → host: the request was refused and nothing was changed.
//
//   offset size field
//        0    2 request_id                   chosen by the host; the answer repeats it
//        2    1 request_type                 MessageType of the request
//        3    1 refusal                      refusal_list.inc
//        4    1 limit                        limit_list.inc; none unless refusal is limit_exceeded
//        5    2 segment                      the segment concerned, or the setting (setting_list.inc)
//        7    8 asked                        in the limit's unit
//       15    8 allowed                      in the limit's unit
//
// Example Nak: 04 00 13 09 03 00 00 80 84 1E 00 00 00 00 00 A0 F0 19 00 00 00 00 00
struct Nak {
  static constexpr MessageType kType = MessageType::Nak;
  std::uint16_t request_id = 0;
  std::uint8_t request_type = 0;
  Refusal refusal{};
  Limit limit{};
  std::uint16_t segment = 0;
  std::int64_t asked = 0;
  std::int64_t allowed = 0;

  static constexpr void layout(auto& self, auto& visit) {
    DIASTOLE_FIELDS(request_id, request_type);
    visit.choice("refusal", self.refusal, kLastRefusal);
    visit.choice("limit", self.limit, kLastLimit);
    DIASTOLE_FIELDS(segment, asked, allowed);
  }
  static constexpr Nak example() {
    return {.request_id = 4,
            .request_type = 0x13,
            .refusal = Refusal::limit_exceeded,
            .limit = Limit::acceleration,
            .segment = 0,
            .asked = 2'000'000,
            .allowed = 1'700'000};
  }
};

// Controller → host, the answer to StatusRequest. Counters count since reset; link counters are those of
// the controller.
//
//   offset size field
//        0    2 request_id                   chosen by the host; the answer repeats it
//        2    1 state                        state_list.inc
//        3    1 fault                        fault_list.inc
//        4    1 inputs                       bit 0 e-stop, 1 home switch, 2 far limit switch, 3 motor enabled
//        5    8 tick                         now
//       13    4 position_microsteps          steps issued, inflate positive
//       17    2 segment                      present segment
//       19    4 cycle                        cycles begun in this run
//       23    4 triggers
//       27    4 r_waves
//       31    8 steps
//       39    4 events_lost
//       43    4 frames_received
//       47    4 crc_errors
//       51    4 framing_errors
//       55    4 duplicates
//       59    4 out_of_order
//       63    4 retransmissions
//
// Example Status: 09 00 04 00 08 00 7A 03 0A 00 00 00 00 FE FF FF FF 00 00 03 00 00 00 03 00 00 00 02 00
//   00 00 54 78 00 00 00 00 00 00 00 00 00 00 28 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00
//   00 00 00 00
struct Status {
  static constexpr MessageType kType = MessageType::Status;
  std::uint16_t request_id = 0;
  State state{};
  Fault fault{};
  std::uint8_t inputs = 0U;
  std::uint64_t tick = 0;
  std::int32_t position_microsteps = 0;
  std::uint16_t segment = 0;
  std::uint32_t cycle = 0;
  std::uint32_t triggers = 0;
  std::uint32_t r_waves = 0;
  std::uint64_t steps = 0;
  std::uint32_t events_lost = 0;
  std::uint32_t frames_received = 0;
  std::uint32_t crc_errors = 0;
  std::uint32_t framing_errors = 0;
  std::uint32_t duplicates = 0;
  std::uint32_t out_of_order = 0;
  std::uint32_t retransmissions = 0;

  static constexpr void layout(auto& self, auto& visit) {
    visit.field("request_id", self.request_id);
    visit.choice("state", self.state, kLastState);
    visit.choice("fault", self.fault, kLastFault);
    visit.field("inputs", self.inputs, 0U, 15U);
    DIASTOLE_FIELDS(tick, position_microsteps, segment, cycle, triggers, r_waves, steps, events_lost,
                    frames_received, crc_errors, framing_errors, duplicates, out_of_order, retransmissions);
  }
  static constexpr Status example() {
    return {.request_id = 9,
            .state = State::running,
            .inputs = 8,
            .tick = 168'000'000,
            .position_microsteps = -2,
            .cycle = 3,
            .triggers = 3,
            .r_waves = 2,
            .steps = 30'804,
            .frames_received = 40};
  }
};

}  // namespace diastole::wire
