#pragma once
// Whether the supply is high enough for the flash: programming 32 bits at a time needs 2.7 V (datasheet table 39). The
// voltage detector's threshold 6 lies at 2.85 V at least when the supply falls (datasheet table 19, PLS = 110).

#include "firmware/boards/stm32f405/registers.hpp"

namespace diastole::stm32 {

/// Precondition: the clock of PWR is on.
inline void start_supply_detector() {
  constexpr std::uint32_t kDetectorOn = 1U << 4, kThreshold6 = 6U << 5;
  power().CR.change(7U << 5, kThreshold6 | kDetectorOn);
}

inline bool supply_suffices() {
  constexpr std::uint32_t kBelow = 1U << 2;
  return (power().CSR.read() & kBelow) == 0;
}

}  // namespace diastole::stm32
