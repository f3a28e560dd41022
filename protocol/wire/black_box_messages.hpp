#pragma once
// The black box: the controller's last events, kept over a reset.

#include <cstddef>
#include <cstdint>

#include "protocol/wire/field_codec.hpp"
#include "protocol/wire/last_of.hpp"
#include "protocol/wire/message_type.hpp"

namespace diastole::wire {

// clang-format off

#define DIASTOLE_BLACK_BOX(number, name) name = number,
enum class Noted : std::uint8_t {
#include "protocol/wire/black_box_list.inc"
};
#define DIASTOLE_BLACK_BOX(number, name) Noted::name,
inline constexpr Noted kLastNoted = last_of({
#include "protocol/wire/black_box_list.inc"
});

#define DIASTOLE_CRASH_REGISTER(number, name) name = number,
enum class CrashRegister : std::uint8_t {
#include "protocol/wire/crash_register_list.inc"
};
#define DIASTOLE_CRASH_REGISTER(number, name) CrashRegister::name,
inline constexpr std::size_t kCrashRegisters = 1 + static_cast<std::size_t>(last_of({
#include "protocol/wire/crash_register_list.inc"
}));

/// One event.
///
///   kind      detail                      argument
///   started   ResetCause                  boot id (as a signed number)
///   state     the new state               the old one
///   fault     its number                  position in microsteps
///   refusal   its number                  type of the message refused
///   estop     1 pressed, 0 released       0
///   link      1 opened, 0 lost            session
///   settings  0                           number of the record written
///   crash     CrashRegister               its value when the processor fault came that ended the start before: one
///                                         entry a register, in order, behind the `started` of the start after it
struct BlackBoxEntry {
  std::uint32_t number = 0;  ///< counts up over resets, from 1
  std::uint16_t boot = 0;    ///< starts since the memory lost its power, from 1
  Noted kind = Noted::nothing;
  std::uint8_t detail = 0;
  std::uint64_t tick = 0;  ///< since that start
  std::int32_t argument = 0;

  static constexpr void layout(auto& self, auto& visit) {
    visit.field("number", self.number);
    visit.field("boot", self.boot);
    visit.choice("kind", self.kind, kLastNoted);
    visit.field("detail", self.detail);
    visit.field("tick", self.tick);
    visit.field("argument", self.argument);
  }
  constexpr bool operator==(const BlackBoxEntry&) const = default;
};

// Host → controller: answer with the first entry whose number is `from` or more.
//
// Example ReadBlackBox: 07 01 2A 00 00 00
struct ReadBlackBox {
  DIASTOLE_LAYOUT(ReadBlackBox,
      (value,  0, uint16_t, request_id),  // chosen by the host; the answer repeats it
      (value,  2, uint32_t, from))
  static constexpr ReadBlackBox example() { return {.request_id = 0x0107, .from = 42}; }
};

// Controller → host, the answer to ReadBlackBox. Entry number 0, kind nothing: there is none from there on.
//
//   offset size field
//        0    2 request_id                   chosen by the host; the answer repeats it
//        2    4 newest                       number of the newest entry
//        6    4 number
//       10    2 boot                         starts since the memory lost its power
//       12    1 kind                         black_box_list.inc
//       13    1 detail
//       14    8 tick                         since that start
//       22    4 argument                     signed
//
// Example BlackBoxReport: 07 01 2C 00 00 00 2A 00 00 00 02 00 03 01 00 7A 03 0A 00 00 00 00 2C 01 00 00
struct BlackBoxReport {
  static constexpr MessageType kType = MessageType::BlackBoxReport;
  std::uint16_t request_id = 0;
  std::uint32_t newest = 0;
  BlackBoxEntry entry;

  static constexpr void layout(auto& self, auto& visit) {
    visit.field("request_id", self.request_id);
    visit.field("newest", self.newest);
    BlackBoxEntry::layout(self.entry, visit);
  }
  static constexpr BlackBoxReport example() {
    return {.request_id = 0x0107, .newest = 44, .entry = {42, 2, Noted::fault, 1, 168'000'000, 300}};
  }
};

// clang-format on

}  // namespace diastole::wire
