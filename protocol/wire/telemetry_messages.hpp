#pragma once
// What happened, in the order in which it happened. All of it is sequenced: none of it may be lost.

#include <array>
#include <cstddef>
#include <cstdint>

#include "protocol/wire/faults.hpp"
#include "protocol/wire/field_codec.hpp"
#include "protocol/wire/message_type.hpp"
#include "protocol/wire/states.hpp"

namespace diastole::wire {

// Controller → host.
//
//   offset size field
//        0    1 from
//        1    1 to
//        2    8 tick
//
// Example StateChanged: 01 02 00 BD 01 05 00 00 00 00
struct StateChanged {
  static constexpr MessageType kType = MessageType::StateChanged;
  State from{};
  State to{};
  std::uint64_t tick = 0;

  static constexpr void layout(auto& self, auto& visit) {
    visit.choice("from", self.from, kLastState);
    visit.choice("to", self.to, kLastState);
    visit.field("tick", self.tick);
  }
  static constexpr StateChanged example() {
    return {.from = State::homing, .to = State::homed, .tick = 84'000'000};
  }
};

// Controller → host: run time zero.
//
//   offset size field
//        0    8 tick                         of the start of run
//        8    2 segments
//       10    4 cycles                       of all segments together
//
// Example RunStarted: 00 7A 03 0A 00 00 00 00 01 00 0A 00 00 00
struct RunStarted {
  static constexpr MessageType kType = MessageType::RunStarted;
  std::uint64_t tick = 0;
  std::uint16_t segments = 0;
  std::uint32_t cycles = 0;

  static constexpr void layout(auto& self, auto& visit) { DIASTOLE_FIELDS(tick, segments, cycles); }
  static constexpr RunStarted example() { return {.tick = 168'000'000, .segments = 1, .cycles = 10}; }
};

// Controller → host: the first cycle of a segment begins.
//
//   offset size field
//        0    2 segment                      index, from 0
//        2    8 tick
//
// Example SegmentStarted: 00 00 00 37 05 0F 00 00 00 00
struct SegmentStarted {
  static constexpr MessageType kType = MessageType::SegmentStarted;
  std::uint16_t segment = 0;
  std::uint64_t tick = 0;

  static constexpr void layout(auto& self, auto& visit) { DIASTOLE_FIELDS(segment, tick); }
  static constexpr SegmentStarted example() { return {.segment = 0, .tick = 252'000'000}; }
};

// Controller → host: the TTL rose, with the first step of a cycle or, in a hold, at the cycle's time, or
// Arm.trigger_delay_us after that.
//
//   offset size field
//        0    4 cycle                        from 0, over the whole run
//        4    8 tick                         of the rising edge
//       12    1 r_wave                       1 if the R-wave was played
//
// Example Trigger: 00 00 00 00 00 96 0A 0F 00 00 00 00 01
struct Trigger {
  static constexpr MessageType kType = MessageType::Trigger;
  std::uint32_t cycle = 0;
  std::uint64_t tick = 0;
  std::uint8_t r_wave = 0U;

  static constexpr void layout(auto& self, auto& visit) {
    DIASTOLE_FIELDS(cycle, tick);
    visit.field("r_wave", self.r_wave, 0U, 1U);
  }
  static constexpr Trigger example() { return {.cycle = 0, .tick = 252'352'000, .r_wave = 1}; }
};

// Controller → host: positions at first_tick + i period_ticks; first_index continues the batch before. A
// position counts the steps whose edge lies at or before its tick.
//
//   offset size field
//        0    4 first_index                  0 is the start of run
//        4    8 first_tick
//       12    4 period_ticks
//       16    1 count                        0 … 50
//       17   4n position_microsteps          signed, inflate positive
//
// Example PositionBatch: 58 02 00 00 00 F4 06 14 00 00 00 00 C0 45 04 00 03 64 00 00 00 65 00 00 00 FF FF
//   FF FF
struct PositionBatch {
  static constexpr MessageType kType = MessageType::PositionBatch;
  std::uint32_t first_index = 0;
  std::uint64_t first_tick = 0;
  std::uint32_t period_ticks = 0;
  static constexpr std::size_t kMaxCount = 50;
  std::uint8_t count = 0;
  std::array<std::int32_t, kMaxCount> position_microsteps{};

  static constexpr void layout(auto& self, auto& visit) {
    DIASTOLE_FIELDS(first_index, first_tick, period_ticks);
    visit.list("position_microsteps", self.count, self.position_microsteps);
  }
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
//   offset size field
//        0    1 reason                       run_end_list.inc
//        1    8 tick                         of standstill
//        9    4 cycles                       completed
//       13    4 triggers                     of this run
//       17    4 r_waves                      of this run
//       21    4 position_microsteps
//
// Example RunEnded: 00 00 D0 1B 50 00 00 00 00 0A 00 00 00 0A 00 00 00 0A 00 00 00 00 00 00 00
struct RunEnded {
  static constexpr MessageType kType = MessageType::RunEnded;
  RunEnd reason{};
  std::uint64_t tick = 0;
  std::uint32_t cycles = 0;
  std::uint32_t triggers = 0;
  std::uint32_t r_waves = 0;
  std::int32_t position_microsteps = 0;

  static constexpr void layout(auto& self, auto& visit) {
    visit.choice("reason", self.reason, kLastRunEnd);
    DIASTOLE_FIELDS(tick, cycles, triggers, r_waves, position_microsteps);
  }
  static constexpr RunEnded example() {
    return {.reason = RunEnd::completed, .tick = 1'344'000'000, .cycles = 10, .triggers = 10, .r_waves = 10};
  }
};

// Controller → host: a fault was latched.
//
//   offset size field
//        0    1 fault                        fault_list.inc
//        1    8 tick
//        9    8 argument                     position in microsteps, except event_overflow: events lost
//
// Example FaultRaised: 01 00 A3 E1 11 00 00 00 00 2C 03 00 00 00 00 00 00
struct FaultRaised {
  static constexpr MessageType kType = MessageType::FaultRaised;
  Fault fault{};
  std::uint64_t tick = 0;
  std::int64_t argument = 0;

  static constexpr void layout(auto& self, auto& visit) {
    visit.choice("fault", self.fault, kLastFault);
    DIASTOLE_FIELDS(tick, argument);
  }
  static constexpr FaultRaised example() {
    return {.fault = Fault::estop, .tick = 300'000'000, .argument = 812};
  }
};

}  // namespace diastole::wire
