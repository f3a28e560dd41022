#pragma once
// Erasing and programming the chip's flash, 32 bits at a time (2.7 to 3.6 V).
//
// The code that runs lies in the same flash, so the core stands still meanwhile: 16 us a word, 0.25 s for a
// sector of 16 KB, 1 s for 128 KB (typical; at most 100 us, 0.5 s and 2 s). Interrupts wait as long. Timers
// go on: an edge that is already scheduled happens, nothing follows it. Only at rest, and a sector's erase
// only while the watchdog's period is longer than that.
//
// Before each operation the supply is asked for: what is begun below 2.7 V leaves cells that read now so, now so.
//
// Programming turns ones into zeros; only an erase turns zeros into ones. When power fails in the middle of
// either, what it was writing is undefined: keep a checksum with everything.

#include <cstdint>
#include <span>

#include "firmware/boards/stm32f405/memory_map.hpp"

namespace diastole::stm32 {

enum class FlashFault : std::uint8_t {
  none = 0,
  not_erased,     ///< a zero would have to become a one: erase the sector first
  refused,        ///< the interface set an error flag (write protection, sequence, alignment)
  verify_failed,  ///< it reads back otherwise
  supply_low,     ///< below what the flash needs (supply.hpp): nothing was begun
};

/// Makes every byte of the sector 0xFF.
[[nodiscard]] FlashFault erase(const FlashSector& sector);

/// Programs words one after the other and reads them back; words that stay erased are left alone, others are programmed
/// even if they read as they should: a cut may have hit them, and their cells read so by chance. Stops at the first fault.
/// Precondition: `address` is a multiple of 4.
[[nodiscard]] FlashFault program(std::uint32_t address, std::span<const std::uint32_t> words);

/// The sector as it reads now.
inline std::span<const std::uint32_t> words_of(const FlashSector& sector) {
  return {reinterpret_cast<const std::uint32_t*>(sector.address), sector.bytes / 4};
}

}  // namespace diastole::stm32
