#include "firmware/boards/stm32f405/clocks.hpp"

#include "firmware/boards/stm32f405/registers.hpp"

namespace diastole::stm32 {

void start_clocks() {
  constexpr std::uint32_t kHseOn = 1U << 16, kHseReady = 1U << 17, kPllOn = 1U << 24, kPllReady = 1U << 25;
  rcc().CR.set(kHseOn);
  while ((rcc().CR.read() & kHseReady) == 0) {
  }
  // 5 wait states at 168 MHz and 3.3 V; prefetch, instruction and data cache (RM0090 3.5.1).
  flash().ACR.write(5U | 1U << 8 | 1U << 9 | 1U << 10);
  // VCO = crystal / M · 336, core = VCO / 2, 48 MHz = VCO / 7, source HSE.
  rcc().PLLCFGR.write(kCrystal_MHz | 336U << 6 | 0U << 16 | 1U << 22 | 7U << 24);
  rcc().CR.set(kPllOn);
  while ((rcc().CR.read() & kPllReady) == 0) {
  }
  // AHB undivided, APB1 / 4, APB2 / 2, system clock from the PLL.
  rcc().CFGR.write(5U << 10 | 4U << 13 | 2U);
  while ((rcc().CFGR.read() & 0xCU) != 0x8U) {
  }
  rcc().AHB1ENR.set(1U << 0 | 1U << 1 | 1U << 2 | 1U << 21);  // GPIOA, GPIOB, GPIOC, DMA1
  rcc().AHB2ENR.set(1U << 6);                                 // RNG
  rcc().APB1ENR.set(0xFU | 1U << 18 | 1U << 29);              // TIM2 … TIM5, USART3, DAC
  rcc().APB2ENR.set(1U << 14);                                // SYSCFG
}

void start_systick() {
  systick().LOAD.write(kCore_Hz / 1000 - 1);
  systick().VAL.write(0);
  systick().CTRL.write(7);
}

}  // namespace diastole::stm32
