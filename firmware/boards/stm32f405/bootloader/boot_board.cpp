#include "firmware/boards/stm32f405/bootloader/boot_board.hpp"

#include "firmware/boards/stm32f405/clocks.hpp"
#include "firmware/boards/stm32f405/pins.hpp"

namespace diastole::stm32 {

void BootBoard::start(std::uint32_t starts) {
  reset_cause_ = take_reset_cause();
  start_clocks();
  configure_pins();
  boot_id_ = make_boot_id(starts);
  serial_.start();
  start_systick();
}

void BootBoard::feed_watchdog() {
  if (!watched_) start_watchdog(WatchdogPeriod::patient);
  watched_ = true;
  stm32::feed_watchdog();
}

}  // namespace diastole::stm32
