#pragma once
// Orders that begin and end motion.

#include <cstdint>

#include "protocol/wire/message_type.hpp"

namespace diastole::wire {

// Host → controller: finds the home switch by withdrawing slowly, leaves it, and calls that position 0.
//
//   offset size field
//        0    2 request_id                   chosen by the host; the answer repeats it
//        2    4 lease_id                     the lease whose heartbeats keep the motor going
//
// Example Home: 05 00 44 33 22 11
struct Home {
  static constexpr MessageType kType = MessageType::Home;
  std::uint16_t request_id = 0;
  std::uint32_t lease_id = 0;

  template <class Self, class Visitor>
  static constexpr void layout([[maybe_unused]] Self& self, [[maybe_unused]] Visitor& visit) {
    visit.field("request_id", self.request_id);
    visit.field("lease_id", self.lease_id);
  }
  static constexpr Home example() {
    Home message;
    message.request_id = 5;
    message.lease_id = 0x11223344;
    return message;
  }
};

// Host → controller: runs the armed program. RunStarted tells the tick of the start of run.
//
//   offset size field
//        0    2 request_id                   chosen by the host; the answer repeats it
//        2    4 lease_id                     the lease whose heartbeats keep the motor going
//
// Example Start: 06 00 44 33 22 11
struct Start {
  static constexpr MessageType kType = MessageType::Start;
  std::uint16_t request_id = 0;
  std::uint32_t lease_id = 0;

  template <class Self, class Visitor>
  static constexpr void layout([[maybe_unused]] Self& self, [[maybe_unused]] Visitor& visit) {
    visit.field("request_id", self.request_id);
    visit.field("lease_id", self.lease_id);
  }
  static constexpr Start example() {
    Start message;
    message.request_id = 6;
    message.lease_id = 0x11223344;
    return message;
  }
};

// Host → controller: end the run when the present cycle is complete.
//
//   offset size field
//        0    2 request_id                   chosen by the host; the answer repeats it
//
// Example StopAtCycleEnd: 07 01
struct StopAtCycleEnd {
  static constexpr MessageType kType = MessageType::StopAtCycleEnd;
  std::uint16_t request_id = 0;

  template <class Self, class Visitor>
  static constexpr void layout([[maybe_unused]] Self& self, [[maybe_unused]] Visitor& visit) {
    visit.field("request_id", self.request_id);
  }
  static constexpr StopAtCycleEnd example() {
    StopAtCycleEnd message;
    message.request_id = 0x0107;
    return message;
  }
};

// Host → controller: decelerate to rest now, at Configure.acceleration_uL_per_s2.
//
//   offset size field
//        0    2 request_id                   chosen by the host; the answer repeats it
//
// Example StopNow: 07 01
struct StopNow {
  static constexpr MessageType kType = MessageType::StopNow;
  std::uint16_t request_id = 0;

  template <class Self, class Visitor>
  static constexpr void layout([[maybe_unused]] Self& self, [[maybe_unused]] Visitor& visit) {
    visit.field("request_id", self.request_id);
  }
  static constexpr StopNow example() {
    StopNow message;
    message.request_id = 0x0107;
    return message;
  }
};

// Host → controller: cut the motor off at once. Position is lost: Fault::halted.
//
//   offset size field
//        0    2 request_id                   chosen by the host; the answer repeats it
//
// Example Halt: 07 01
struct Halt {
  static constexpr MessageType kType = MessageType::Halt;
  std::uint16_t request_id = 0;

  template <class Self, class Visitor>
  static constexpr void layout([[maybe_unused]] Self& self, [[maybe_unused]] Visitor& visit) {
    visit.field("request_id", self.request_id);
  }
  static constexpr Halt example() {
    Halt message;
    message.request_id = 0x0107;
    return message;
  }
};

// Host → controller: leave the state faulted. Position is kept only after lease_lost.
//
//   offset size field
//        0    2 request_id                   chosen by the host; the answer repeats it
//
// Example ClearFault: 07 01
struct ClearFault {
  static constexpr MessageType kType = MessageType::ClearFault;
  std::uint16_t request_id = 0;

  template <class Self, class Visitor>
  static constexpr void layout([[maybe_unused]] Self& self, [[maybe_unused]] Visitor& visit) {
    visit.field("request_id", self.request_id);
  }
  static constexpr ClearFault example() {
    ClearFault message;
    message.request_id = 0x0107;
    return message;
  }
};

}  // namespace diastole::wire
