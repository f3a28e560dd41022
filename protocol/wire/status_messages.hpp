#pragma once
// Answers and the state at a moment.

#include <cstdint>

#include "protocol/wire/common_requests.hpp"
#include "protocol/wire/faults.hpp"
#include "protocol/wire/field_codec.hpp"
#include "protocol/wire/message_type.hpp"
#include "protocol/wire/states.hpp"

namespace diastole::wire {

// clang-format off

// Host → controller: answer with Status.
//
// Example StatusRequest: 07 01
using StatusRequest = BareRequest<MessageType::StatusRequest>;

// Controller → host: the request was carried out, or for a motion begun.
//
// Example Ack: 04 00 13
struct Ack {
  DIASTOLE_LAYOUT(Ack,
      (value,  0, uint16_t, request_id),   // chosen by the host; the answer repeats it
      (value,  2, uint8_t, request_type))  // MessageType of the request
  static constexpr Ack example() { return {.request_id = 4, .request_type = 0x13}; }
};

// Controller → host: the request was refused and nothing was changed.
//
// Example Nak: 04 00 13 09 03 00 00 80 84 1E 00 00 00 00 00 A0 F0 19 00 00 00 00 00
struct Nak {
  DIASTOLE_LAYOUT(Nak,
      (value,   0, uint16_t, request_id),            // chosen by the host; the answer repeats it
      (value,   2, uint8_t, request_type),           // MessageType of the request
      (choice,  3, Refusal, refusal, kLastRefusal),  // refusal_list.inc
      (choice,  4, Limit, limit, kLastLimit),        // limit_list.inc; none unless refusal is limit_exceeded
      (value,   5, uint16_t, segment),  // the segment concerned, or the setting (setting_list.inc)
      (value,   7, int64_t, asked),                  // in the limit's unit
      (value,  15, int64_t, allowed))                // in the limit's unit
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
// Example Status: 09 00 04 00 08 00 7A 03 0A 00 00 00 00 FE FF FF FF 00 00 03 00 00 00 03 00 00 00 02 00
//   00 00 54 78 00 00 00 00 00 00 00 00 00 00 28 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00
//   00 00 00 00 00
struct Status {
  DIASTOLE_LAYOUT(Status,
      (value,   0, uint16_t, request_id),          // chosen by the host; the answer repeats it
      (choice,  2, State, state, kLastState),      // state_list.inc
      (choice,  3, Fault, fault, kLastFault),      // fault_list.inc
      // bit 0 e-stop, 1 home switch, 2 far limit switch, 3 motor enabled
      (within,  4, uint8_t, inputs, 0U, 15U),
      (value,   5, uint64_t, tick),                // now
      (value,  13, int32_t, position_microsteps),  // steps issued, inflate positive
      (value,  17, uint16_t, segment),             // present segment
      (value,  19, uint32_t, cycle),               // cycles begun in this run
      (value,  23, uint32_t, triggers),
      (value,  27, uint32_t, r_waves),
      (value,  31, uint64_t, steps),
      (value,  39, uint32_t, events_lost),
      (value,  43, uint32_t, frames_received),
      (value,  47, uint32_t, crc_errors),
      (value,  51, uint32_t, framing_errors),
      (value,  55, uint32_t, duplicates),
      (value,  59, uint32_t, out_of_order),
      (value,  63, uint32_t, retransmissions),
      (within, 67, uint8_t, takes_unsigned_firmware, 0U, 1U))  // 1: the bootloader has no key
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

// clang-format on

}  // namespace diastole::wire
