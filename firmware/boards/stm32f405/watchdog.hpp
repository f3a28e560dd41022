#pragma once
// The independent watchdog, RM0090 21: resets the chip unless it is fed in time. Once started it cannot be
// stopped, but its period may change. Its clock is no crystal: 17 to 47 kHz for 32, so every period is 0.7 to 1.9 times
// what is said here. The patient one must still hold the slowest erase of a slot and of the records, 2.5 s.

#include "firmware/boards/stm32f405/registers.hpp"

namespace diastole::stm32 {

enum class WatchdogPeriod {
  strict,    ///< 250 ms: the main loop's
  starting,  ///< 1 s: from the bootloader's leave to the main loop's first turn
  patient,   ///< 8 s: while flash is erased
};

inline void feed_watchdog() { iwdg().KR.write(0xAAAA); }

/// Sets the period and feeds it.
inline void set_watchdog(WatchdogPeriod period) {
  while (iwdg().SR.read() != 0) {  // the last change has not reached its clock yet: at most 0.2 ms
  }
  iwdg().KR.write(0x5555);
  // 32 kHz / 8, / 32 or / 256
  iwdg().PR.write(period == WatchdogPeriod::strict ? 1 : period == WatchdogPeriod::starting ? 3 : 6);
  iwdg().RLR.write(1000);
  while (iwdg().SR.read() != 0) {
  }
  feed_watchdog();
}

/// It stands still while a debugger has stopped the core (DBG_IWDG_STOP, RM0090 38.16.4).
inline void start_watchdog(WatchdogPeriod period) {
  debug().APB1_FZ.set(1U << 12);
  iwdg().KR.write(0xCCCC);
  set_watchdog(period);
}

}  // namespace diastole::stm32
