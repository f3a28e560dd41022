#include "firmware/boards/stm32f405/flash_slots.hpp"

#include <algorithm>
#include <array>
#include <cstring>

namespace diastole::stm32 {

/// In pieces of aligned words: messages lie anywhere in memory.
bool FlashSlots::write(std::uint32_t address, std::span<const std::uint8_t> bytes) {
  std::array<std::uint32_t, 16> words;
  while (!bytes.empty()) {
    const std::size_t count = std::min(bytes.size(), sizeof words);
    std::memcpy(words.data(), bytes.data(), count);
    if (program(address, std::span(words).first(count / 4)) != FlashFault::none) return false;
    address += count;
    bytes = bytes.subspan(count);
  }
  return true;
}

}  // namespace diastole::stm32
