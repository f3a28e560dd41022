#include "firmware/boards/stm32f405/option_bytes.hpp"

#include "firmware/boards/stm32f405/registers.hpp"
#include "firmware/boards/stm32f405/supply.hpp"

namespace diastole::stm32 {

OptionBytes secure_option_bytes() {
  // FLASH_OPTCR, RM0090 3.9.7. BOR_LEV 0 is level 3; a sector's nWRP bit is 0 if it is protected.
  constexpr std::uint32_t kLocked = 1U << 0, kStart = 1U << 1, kNotLevel3 = 3U << 2,
                          kBootloaderOpen = 1U << 16;
  constexpr std::uint32_t kUnwanted = kNotLevel3 | kBootloaderOpen, kBusy = 1U << 16;
  const std::uint32_t held = flash().OPTCR.read();
  if ((held & kUnwanted) == 0) return OptionBytes::as_wanted;
  if (!supply_suffices()) return OptionBytes::refused;
  flash().OPTKEYR.write(0x0819'2A3B);
  flash().OPTKEYR.write(0x4C5D'6E7F);
  const std::uint32_t wanted = held & ~(kUnwanted | kLocked | kStart);
  flash().OPTCR.write(wanted);
  flash().OPTCR.write(wanted | kStart);
  while ((flash().SR.read() & kBusy) != 0) {
  }
  flash().OPTCR.write(wanted | kLocked);
  return (flash().OPTCR.read() & kUnwanted) == 0 ? OptionBytes::written : OptionBytes::refused;
}

}  // namespace diastole::stm32
