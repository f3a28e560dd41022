#pragma once
// Orders that begin and end motion.

#include <cstdint>

#include "protocol/wire/common_requests.hpp"
#include "protocol/wire/field_codec.hpp"
#include "protocol/wire/message_type.hpp"

namespace diastole::wire {

// clang-format off

// Host → controller: finds the home switch (firmware/core/homing.hpp) and calls a place beside it position 0.
//
// Example Home: 05 00 44 33 22 11
using Home = LeaseRequest<MessageType::Home, 5>;

// Host → controller: moves the piston by a distance, from rest to rest, at a quarter of the allowed acceleration.
// StateChanged (jogging), Ack, and StateChanged when it is at rest. Unhomed it goes at most at the speed of homing; a
// switch that closes in the direction of motion is a fault. Away from a closed switch it may always go.
//
// Example Jog: 0A 00 44 33 22 11 C0 B4 B3 FF FF FF FF FF 88 13 00 00
struct Jog {
  DIASTOLE_LAYOUT(Jog,
      (value,   0, uint16_t, request_id),  // chosen by the host; the answer repeats it
      (value,   2, uint32_t, lease_id),  // the lease whose heartbeats keep the motor going
      (within,  6, int64_t, distance_nL, -50'000'000'000, 50'000'000'000),  // signed, inflate positive
      (within, 14, uint32_t, flow_uL_per_s, 1U, 10'000'000U))               // speed
  static constexpr Jog example() {
    return {.request_id = 10, .lease_id = 0x11223344, .distance_nL = -5'000'000, .flow_uL_per_s = 5'000};
  }
};

// Host → controller: runs the armed program. RunStarted reports the tick of the start of run.
//
// Example Start: 06 00 44 33 22 11
using Start = LeaseRequest<MessageType::Start, 6>;

// Host → controller: end the run when the present cycle is complete.
//
// Example StopAtCycleEnd: 07 01
using StopAtCycleEnd = BareRequest<MessageType::StopAtCycleEnd>;

// Host → controller: decelerate to rest now, at Configure.acceleration_uL_per_s2: a run, homing, a jog.
//
// Example StopNow: 07 01
using StopNow = BareRequest<MessageType::StopNow>;

// Host → controller: cut the motor off at once. Position is lost: Fault::halted.
//
// Example Halt: 07 01
using Halt = BareRequest<MessageType::Halt>;

// Host → controller: leave the state faulted. Position is kept only after lease_lost.
//
// Example ClearFault: 07 01
using ClearFault = BareRequest<MessageType::ClearFault>;

// clang-format on

}  // namespace diastole::wire
