#pragma once
// The two settings sectors as SettingsStore sees them (firmware/core/settings_store.hpp). Each call holds the core up
// (flash.hpp): up to 0.5 s for an erase, for which the watchdog is given 8 s.

#include <cstdint>
#include <span>

#include "firmware/boards/stm32f405/memory_map.hpp"

namespace diastole::stm32 {

class SettingsFlash {
 public:
  [[nodiscard]] std::span<const std::uint8_t> sector(std::size_t index) const {
    const FlashSector& at = kSettingsSectors[index];
    return {reinterpret_cast<const std::uint8_t*>(at.address), at.bytes};
  }
  bool erase(std::size_t index);
  bool program(std::size_t index, std::size_t offset, std::span<const std::uint8_t> bytes);
};

}  // namespace diastole::stm32
