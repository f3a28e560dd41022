#pragma once
// Who is there, is it still there, and what time is it: the messages that keep a session. HelloRequest and
// Hello keep this layout for ever.

#include <cstdint>

#include "protocol/wire/field_codec.hpp"
#include "protocol/wire/message_type.hpp"
#include "protocol/wire/states.hpp"

namespace diastole::wire {

// clang-format off

/// The schema hash by which a bootloader introduces itself: it speaks the messages of update_messages.hpp
/// only.
inline constexpr std::uint32_t kBootloaderSchema = 0xB007'10AD;

// Host → controller: the first message of a session.
//
// Example HelloRequest: 01 00 D4 C3 B2 A1 00 01 00
struct HelloRequest {
  DIASTOLE_LAYOUT(HelloRequest,
      (value,  0, uint16_t, request_id),    // chosen by the host; the answer repeats it
      (value,  2, uint32_t, schema_hash),   // kSchemaHash of the host
      (value,  6, uint8_t, version_major),  // of the host program
      (value,  7, uint8_t, version_minor),
      (value,  8, uint8_t, version_patch))
  static constexpr HelloRequest example() {
    return {.request_id = 1, .schema_hash = 0xA1B2C3D4, .version_minor = 1};
  }
};

// Controller → host, the answer to HelloRequest. If the hashes differ, every other request is refused with
// Refusal::schema_mismatch.
//
// Example Hello: 01 00 D4 C3 B2 A1 00 01 00 02 00 EE FF C0 00 00 BD 01 05 01
struct Hello {
  DIASTOLE_LAYOUT(Hello,
      (value,   0, uint16_t, request_id),                        // chosen by the host; the answer repeats it
      (value,   2, uint32_t, schema_hash),                       // kSchemaHash of the firmware
      (value,   6, uint8_t, version_major),                      // of the firmware
      (value,   7, uint8_t, version_minor),
      (value,   8, uint8_t, version_patch),
      (value,   9, uint16_t, board_id),                          // 1 recording board, 2 STM32F405
      (value,  11, uint32_t, boot_id),                           // differs after every reset
      (within, 15, uint32_t, tick_rate_Hz, 1U, 1'000'000'000U),  // of every tick in this protocol
      (choice, 19, ResetCause, reset_cause, kLastResetCause))    // why the controller last started
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
// Example Heartbeat: 44 33 22 11
struct Heartbeat {
  DIASTOLE_LAYOUT(Heartbeat,
      (value,  0, uint32_t, lease_id))  // chosen by the host for one session
  static constexpr Heartbeat example() { return {.lease_id = 0x11223344}; }
};

// Host → controller: what time is it with you?
//
// Example TimeSyncRequest: 4D 00 00 00
struct TimeSyncRequest {
  DIASTOLE_LAYOUT(TimeSyncRequest,
      (value,  0, uint32_t, token))  // the answer repeats it
  static constexpr TimeSyncRequest example() { return {.token = 77}; }
};

// Controller → host, the answer to TimeSyncRequest.
//
// Example TimeSync: 4D 00 00 00 00 BD 01 05 00 00 00 00 A4 BE 01 05 00 00 00 00
struct TimeSync {
  DIASTOLE_LAYOUT(TimeSync,
      (value,  0, uint32_t, token),          // from the request
      (value,  4, uint64_t, received_tick),  // when the request was taken from the line
      (value, 12, uint64_t, replied_tick))   // when this answer was handed to the line
  static constexpr TimeSync example() {
    return {.token = 77, .received_tick = 84'000'000, .replied_tick = 84'000'420};
  }
};

// clang-format on

}  // namespace diastole::wire
