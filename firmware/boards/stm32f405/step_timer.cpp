#include "firmware/boards/stm32f405/step_timer.hpp"

namespace diastole::stm32 {

void StepTimer::start() {
  constexpr std::uint32_t kOnePulse = 1U << 3, kPwm2 = 7U << 4, kOutput = 1U << 0, kComparePulse = 3U << 4,
                          kStartedByTim2 = 0U << 4 | 6U;
  tim3().PSC.write(0);
  tim3().CCR1.write(kPulseDelay);
  tim3().ARR.write(static_cast<std::uint32_t>(firmware::kStepPulse.count) + kPulseDelay - 1);
  tim3().CCMR1.write(kPwm2);
  tim3().CCER.write(kOutput);
  tim3().CR1.write(kOnePulse);
  tim3().EGR.write(1);

  tim5().PSC.write(0);
  tim5().ARR.write(0xFFFF'FFFFU);
  tim5().CR2.write(kComparePulse);  // TRGO: a pulse at each match of CCR1, whatever its flag says (18.4.2)
  tim5().EGR.write(1);
  tim5().SMCR.write(kStartedByTim2);
  rest();
  enable_interrupt(kTim5, 1);
}

}  // namespace diastole::stm32
