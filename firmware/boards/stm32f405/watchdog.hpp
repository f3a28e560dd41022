#pragma once
// The independent watchdog, RM0090 21: resets the chip unless it is fed in time. Once started it cannot be
// stopped, but its period may change.

#include "firmware/boards/stm32f405/registers.hpp"

namespace diastole::stm32 {

enum class WatchdogPeriod {
  strict,   ///< 250 ms: the main loop's
  patient,  ///< 4 s: while flash is erased
};

/// Sets the period and feeds it.
inline void set_watchdog(WatchdogPeriod period) {
  while (iwdg().SR.read() != 0) {  // the last change has not reached its clock yet: at most 0.2 ms
  }
  iwdg().KR.write(0x5555);
  iwdg().PR.write(period == WatchdogPeriod::strict ? 1 : 5);  // 32 kHz / 8 or / 128
  iwdg().RLR.write(1000);
  while (iwdg().SR.read() != 0) {
  }
  iwdg().KR.write(0xAAAA);
}

/// Precondition: not started before since reset.
inline void start_watchdog() {
  iwdg().KR.write(0x5555);
  iwdg().PR.write(1);
  iwdg().RLR.write(1000);
  iwdg().KR.write(0xCCCC);
}

}  // namespace diastole::stm32
