#include "firmware/boards/stm32f405/bootloader/boot_board.hpp"

#include "firmware/boards/stm32f405/clocks.hpp"
#include "firmware/boards/stm32f405/hand_over.hpp"
#include "firmware/boards/stm32f405/option_bytes.hpp"
#include "firmware/boards/stm32f405/pins.hpp"
#include "firmware/boards/stm32f405/supply.hpp"

namespace diastole::stm32 {

void BootBoard::start(std::uint32_t starts) {
  (void)start_clocks();  // on the chip's own oscillator it serves updates as well
  configure_pins();
  start_supply_detector();
  if (secure_option_bytes() == OptionBytes::written) reset();
  reset_cause_ = take_reset_cause();
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
