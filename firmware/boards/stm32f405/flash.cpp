#include "firmware/boards/stm32f405/flash.hpp"

#include "firmware/boards/stm32f405/registers.hpp"
#include "firmware/boards/stm32f405/supply.hpp"

namespace diastole::stm32 {

namespace {

// FLASH_CR, RM0090 3.9.6
constexpr std::uint32_t kProgram = 1U << 0, kSectorErase = 1U << 1, kBy32 = 2U << 8, kStart = 1U << 16,
                        kLock = 1U << 31;
// FLASH_SR, 3.9.5
constexpr std::uint32_t kErrors = 0xF0, kEndOfOperation = 1U << 0, kBusy = 1U << 16;
// FLASH_ACR, 3.9.1
constexpr std::uint32_t kCaches = 3U << 9, kCacheReset = 3U << 11;

constexpr std::uint32_t kErased = 0xFFFF'FFFF;

/// The interface takes orders while one of these lives. The caches are emptied at the end: they may hold what
/// was there before.
class Unlocked {
 public:
  explicit Unlocked(std::uint32_t control) {
    flash().KEYR.write(0x4567'0123);
    flash().KEYR.write(0xCDEF'89AB);
    flash().SR.write(kErrors | kEndOfOperation);
    flash().CR.write(kBy32 | control);
  }
  ~Unlocked() {
    flash().CR.write(kLock);
    const std::uint32_t enabled = flash().ACR.read() & kCaches;
    flash().ACR.clear(kCaches);
    flash().ACR.set(kCacheReset);
    flash().ACR.clear(kCacheReset);
    flash().ACR.set(enabled);
  }
  Unlocked(const Unlocked&) = delete;
  Unlocked& operator=(const Unlocked&) = delete;

  /// Waits for the end of the operation; false if it was refused.
  [[nodiscard]] static bool done() {
    while ((flash().SR.read() & kBusy) != 0) {
    }
    return (flash().SR.read() & kErrors) == 0;
  }
};

volatile std::uint32_t& word_at(std::uint32_t address) {
  return *reinterpret_cast<volatile std::uint32_t*>(address);
}

}  // namespace

FlashFault erase(const FlashSector& sector) {
  if (!supply_suffices()) return FlashFault::supply_low;
  {
    const std::uint32_t control = kSectorErase | sector.number << 3;
    const Unlocked unlocked(control);
    flash().CR.write(kBy32 | control | kStart);
    if (!Unlocked::done()) return FlashFault::refused;
  }
  for (std::uint32_t offset = 0; offset < sector.bytes; offset += 4)
    if (word_at(sector.address + offset) != kErased) return FlashFault::verify_failed;
  return FlashFault::none;
}

FlashFault program(std::uint32_t address, std::span<const std::uint32_t> words) {
  {
    const Unlocked unlocked(kProgram);
    std::uint32_t at = address;
    for (const std::uint32_t word : words) {
      volatile std::uint32_t& place = word_at(at);
      at += 4;
      if (word == kErased && place == word) continue;
      if ((place & word) != word) return FlashFault::not_erased;
      if (!supply_suffices()) return FlashFault::supply_low;
      place = word;
      if (!Unlocked::done()) return FlashFault::refused;
    }
  }
  for (const std::uint32_t word : words) {
    if (word_at(address) != word) return FlashFault::verify_failed;
    address += 4;
  }
  return FlashFault::none;
}

}  // namespace diastole::stm32
