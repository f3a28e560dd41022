#pragma once
// The last events in memory that outlives a reset: a ring of entries, each with a number that counts up and a CRC of
// its own, so that whatever stood there before, or was being written when the reset came, is not believed. After
// power-on the ring is emptied: its memory is arbitrary then.
//
//   entry   offset size
//                0   20 wire::BlackBoxEntry
//               20    4 CRC-32 (crc32.hpp) of those
//
// Main loop only.

#include <array>
#include <cstdint>

#include "firmware/core/crash_record.hpp"
#include "firmware/core/units.hpp"
#include "protocol/wire/black_box_messages.hpp"
#include "protocol/wire/states.hpp"

namespace diastole::firmware {

class BlackBox {
 public:
  static constexpr std::uint32_t kEntries = 160;
  using Slot = std::array<std::uint8_t, 24>;
  using Memory = std::array<Slot, kEntries>;

  explicit BlackBox(Memory& memory) : memory_(memory) {}

  /// Once after a reset: finds what is there, or empties it after power-on, and notes the start.
  void begin(wire::ResetCause cause, std::uint32_t boot_id, Ticks now);

  /// What is equal to the last note is noted once.
  void note(wire::Noted kind, std::uint8_t detail, std::int32_t argument, Ticks now);

  /// One entry a register.
  void note_crash(const CrashRecord& crash, Ticks now);

  [[nodiscard]] std::uint32_t newest() const { return newest_; }
  /// The first entry whose number is `from` or more; number 0 if there is none.
  [[nodiscard]] wire::BlackBoxEntry first_from(std::uint32_t from) const;

 private:
  [[nodiscard]] wire::BlackBoxEntry read(std::size_t slot) const;

  Memory& memory_;
  std::uint32_t newest_ = 0;
  std::uint16_t boot_ = 0;
  wire::BlackBoxEntry last_;
};

}  // namespace diastole::firmware
