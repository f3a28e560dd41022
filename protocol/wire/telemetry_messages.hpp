#pragma once
// What happened, in the order in which it happened. All of it is sequenced: none of it may be lost.

#include <cstddef>
#include <cstdint>

#include "protocol/wire/faults.hpp"
#include "protocol/wire/field_codec.hpp"
#include "protocol/wire/message_type.hpp"
#include "protocol/wire/states.hpp"

namespace diastole::wire {

// clang-format off

// Controller → host.
//
// Example StateChanged: 01 02 00 BD 01 05 00 00 00 00
struct StateChanged {
  DIASTOLE_LAYOUT(StateChanged,
      (choice,  0, State, from, kLastState),
      (choice,  1, State, to, kLastState),
      (value,   2, uint64_t, tick))
  static constexpr StateChanged example() {
    return {.from = State::homing, .to = State::homed, .tick = 84'000'000};
  }
};

// Controller → host: run time zero.
//
// Example RunStarted: 00 7A 03 0A 00 00 00 00 01 00 0A 00 00 00
struct RunStarted {
  DIASTOLE_LAYOUT(RunStarted,
      (value,  0, uint64_t, tick),      // of the start of run
      (value,  8, uint16_t, segments),
      (value, 10, uint32_t, cycles))    // of all segments together
  static constexpr RunStarted example() { return {.tick = 168'000'000, .segments = 1, .cycles = 10}; }
};

// Controller → host: the first cycle of a segment begins.
//
// Example SegmentStarted: 00 00 00 37 05 0F 00 00 00 00
struct SegmentStarted {
  DIASTOLE_LAYOUT(SegmentStarted,
      (value,  0, uint16_t, segment),  // index, from 0
      (value,  2, uint64_t, tick))
  static constexpr SegmentStarted example() { return {.segment = 0, .tick = 252'000'000}; }
};

// Controller → host: the TTL rose, with the first step of a cycle or, in a hold, at the cycle's time, or
// Arm.trigger_delay_us after that. Or it should have and was not seen to.
//
// Example Trigger: 00 00 00 00 00 96 0A 0F 00 00 00 00 01 01
struct Trigger {
  DIASTOLE_LAYOUT(Trigger,
      (value,   0, uint32_t, cycle),          // from 0, over the whole run
      (value,   4, uint64_t, tick),           // of the rising edge
      (within, 12, uint8_t, r_wave, 0U, 1U),  // 1 if the R-wave was played
      // 1 if the board saw the pin rise at this tick; 0: it was due at this tick and was lost
      (within, 13, uint8_t, seen, 0U, 1U))
  static constexpr Trigger example() { return {.cycle = 0, .tick = 252'352'000, .r_wave = 1, .seen = 1}; }
};

// Controller → host: positions at first_tick + i period_ticks; first_index continues the batch before. A
// position counts the steps whose edge lies at or before its tick.
//
// Example PositionBatch: 58 02 00 00 00 F4 06 14 00 00 00 00 C0 45 04 00 03 64 00 00 00 65 00 00 00 FF FF
//   FF FF
struct PositionBatch {
  static constexpr std::size_t kMaxCount = 50;
  DIASTOLE_LAYOUT(PositionBatch,
      (value,  0, uint32_t, first_index),                           // 0 is the start of run
      (value,  4, uint64_t, first_tick),
      (value, 12, uint32_t, period_ticks),
      (list,  16, count, int32_t, position_microsteps, kMaxCount))  // count: 0 … 50, signed, inflate positive
  static constexpr PositionBatch example() {
    return {.first_index = 600,
            .first_tick = 336'000'000,
            .period_ticks = 280'000,
            .count = 3,
            .position_microsteps = {100, 101, -1}};
  }
};

// Controller → host: the motor is at rest and every position and trigger of the run has been sent.
//
// Example RunEnded: 00 00 D0 1B 50 00 00 00 00 0A 00 00 00 0A 00 00 00 0A 00 00 00 00 00 00 00 00 00 00 00
struct RunEnded {
  DIASTOLE_LAYOUT(RunEnded,
      (choice,  0, RunEnd, reason, kLastRunEnd),   // run_end_list.inc
      (value,   1, uint64_t, tick),                // of standstill
      (value,   9, uint32_t, cycles),              // completed
      (value,  13, uint32_t, triggers),            // of this run, as the board saw them rise
      (value,  17, uint32_t, r_waves),             // of this run
      (value,  21, int32_t, position_microsteps),
      (value,  25, uint32_t, triggers_lost))       // of this run: due, and not seen to rise
  static constexpr RunEnded example() {
    return {.reason = RunEnd::completed, .tick = 1'344'000'000, .cycles = 10, .triggers = 10, .r_waves = 10};
  }
};

// Controller → host: a fault was latched.
//
// Example FaultRaised: 01 00 A3 E1 11 00 00 00 00 2C 03 00 00 00 00 00 00
struct FaultRaised {
  DIASTOLE_LAYOUT(FaultRaised,
      (choice,  0, Fault, fault, kLastFault),  // fault_list.inc
      (value,   1, uint64_t, tick),
      (value,   9, int64_t, argument))         // position in microsteps, except event_overflow: events lost
  static constexpr FaultRaised example() {
    return {.fault = Fault::estop, .tick = 300'000'000, .argument = 812};
  }
};

// clang-format on

}  // namespace diastole::wire
