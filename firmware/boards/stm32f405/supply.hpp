#pragma once
// Whether the supply is high enough for the flash: programming 32 bits at a time needs 2.7 V (datasheet table 39). The
// voltage detector's threshold 6 (datasheet table 19, PLS = 110) lies at 2.85 to 2.99 V, 2.93 typically, when the supply falls,
// and 0.1 V higher when it rises: above the brown-out reset's 2.75 to 2.88 V (option_bytes.hpp), below a sound supply's 3.2 V.

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
