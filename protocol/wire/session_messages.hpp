#pragma once
// Who is there, is it still there, and what time is it: the messages that keep a session. HelloRequest and
// Hello keep this layout for ever.

#include <cstdint>

#include "protocol/wire/field_codec.hpp"
#include "protocol/wire/message_type.hpp"
#include "protocol/wire/states.hpp"

namespace diastole::wire {

/// The schema hash by which a bootloader introduces itself: it speaks the messages of update_messages.hpp
/// only.
inline constexpr std::uint32_t kBootloaderSchema = 0xB007'10AD;

// Host → controller: the first message of a session.
//
//   offset size field
//        0    2 request_id                   chosen by the host; the answer repeats it
//        2    4 schema_hash                  kSchemaHash of the host
//        6    1 version_major                of the host program
//        7    1 version_minor
//        8    1 version_patch
//
// Example HelloRequest: 01 00 D4 C3 B2 A1 00 01 00
struct HelloRequest {
  static constexpr MessageType kType = MessageType::HelloRequest;
  std::uint16_t request_id = 0;
  std::uint32_t schema_hash = 0;
  std::uint8_t version_major = 0;
  std::uint8_t version_minor = 0;
  std::uint8_t version_patch = 0;

  static constexpr void layout(auto& self, auto& visit) {
    DIASTOLE_FIELDS(request_id, schema_hash, version_major, version_minor, version_patch);
  }
  static constexpr HelloRequest example() {
    return {.request_id = 1, .schema_hash = 0xA1B2C3D4, .version_minor = 1};
  }
};

// Controller → host, the answer to HelloRequest. If the hashes differ, every other request is refused with
// Refusal::schema_mismatch.
//
//   offset size field
//        0    2 request_id                   chosen by the host; the answer repeats it
//        2    4 schema_hash                  kSchemaHash of the firmware
//        6    1 version_major                of the firmware
//        7    1 version_minor
//        8    1 version_patch
//        9    2 board_id                     1 recording board, 2 STM32F405
//       11    4 boot_id                      differs after every reset
//       15    4 tick_rate_Hz                 of every tick in this protocol
//       19    1 reset_cause                  why the controller last started
//
// Example Hello: 01 00 D4 C3 B2 A1 00 01 00 02 00 EE FF C0 00 00 BD 01 05 01
struct Hello {
  static constexpr MessageType kType = MessageType::Hello;
  std::uint16_t request_id = 0;
  std::uint32_t schema_hash = 0;
  std::uint8_t version_major = 0;
  std::uint8_t version_minor = 0;
  std::uint8_t version_patch = 0;
  std::uint16_t board_id = 0;
  std::uint32_t boot_id = 0;
  std::uint32_t tick_rate_Hz = 1U;
  ResetCause reset_cause{};

  static constexpr void layout(auto& self, auto& visit) {
    DIASTOLE_FIELDS(request_id, schema_hash, version_major, version_minor, version_patch, board_id, boot_id);
    visit.field("tick_rate_Hz", self.tick_rate_Hz, 1U, 1'000'000'000U);
    visit.choice("reset_cause", self.reset_cause, kLastResetCause);
  }
  static constexpr Hello example() {
    return {.request_id = 1,
            .schema_hash = 0xA1B2C3D4,
            .version_minor = 1,
            .board_id = 2,
            .boot_id = 0x00C0FFEE,
            .tick_rate_Hz = 84'000'000,
            .reset_cause = ResetCause::power_on};
  }
};

// Host → controller, every 50 to 100 ms: holds the lease. While the motor moves and no heartbeat with the
// lease of Start or Home has come in time, the controller stops under control, at rest within
// Configure.lease_us of the last one.
//
//   offset size field
//        0    4 lease_id                     chosen by the host for one session
//
// Example Heartbeat: 44 33 22 11
struct Heartbeat {
  static constexpr MessageType kType = MessageType::Heartbeat;
  std::uint32_t lease_id = 0;

  static constexpr void layout(auto& self, auto& visit) { visit.field("lease_id", self.lease_id); }
  static constexpr Heartbeat example() { return {.lease_id = 0x11223344}; }
};

// Host → controller: what time is it with you?
//
//   offset size field
//        0    4 token                        the answer repeats it
//
// Example TimeSyncRequest: 4D 00 00 00
struct TimeSyncRequest {
  static constexpr MessageType kType = MessageType::TimeSyncRequest;
  std::uint32_t token = 0;

  static constexpr void layout(auto& self, auto& visit) { visit.field("token", self.token); }
  static constexpr TimeSyncRequest example() { return {.token = 77}; }
};

// Controller → host, the answer to TimeSyncRequest.
//
//   offset size field
//        0    4 token                        from the request
//        4    8 received_tick                when the request was taken from the line
//       12    8 replied_tick                 when this answer was handed to the line
//
// Example TimeSync: 4D 00 00 00 00 BD 01 05 00 00 00 00 A4 BE 01 05 00 00 00 00
struct TimeSync {
  static constexpr MessageType kType = MessageType::TimeSync;
  std::uint32_t token = 0;
  std::uint64_t received_tick = 0;
  std::uint64_t replied_tick = 0;

  static constexpr void layout(auto& self, auto& visit) {
    DIASTOLE_FIELDS(token, received_tick, replied_tick);
  }
  static constexpr TimeSync example() {
    return {.token = 77, .received_tick = 84'000'000, .replied_tick = 84'000'420};
  }
};

}  // namespace diastole::wire
