#include "firmware/boards/stm32f405/settings_flash.hpp"

#include <cstring>

#include "firmware/boards/stm32f405/flash.hpp"
#include "firmware/boards/stm32f405/watchdog.hpp"

namespace diastole::stm32 {

bool SettingsFlash::erase(std::size_t index) {
  set_watchdog(WatchdogPeriod::patient);
  const FlashFault fault = stm32::erase(kSettingsSectors[index]);
  set_watchdog(WatchdogPeriod::strict);
  return fault == FlashFault::none;
}

bool SettingsFlash::program(std::size_t index, std::size_t offset, std::span<const std::uint8_t> bytes) {
  auto address = static_cast<std::uint32_t>(kSettingsSectors[index].address + offset);
  for (; bytes.size() >= 4; bytes = bytes.subspan(4), address += 4) {
    std::uint32_t word = 0;
    std::memcpy(&word, bytes.data(), sizeof word);
    if (stm32::program(address, {&word, 1}) != FlashFault::none) return false;
  }
  return bytes.empty();
}

}  // namespace diastole::stm32
