// 30,000 rising edges a second on PA0 (TIM2 channel 1, compare-toggle), planned one edge ahead by its
// interrupt. With BUSY the core spins instead of sleeping between interrupts.

#include "tests/tools/sim_board/images/chip.hpp"

namespace {
constexpr uint32_t half_period_ticks = 84'000'000 / 60'000;
}

extern "C" void tim2_irq() {
  tim2.sr = ~2U;
  tim2.ccr[0] = tim2.ccr[0] + half_period_ticks;
  seen[0] = seen[0] + 1;
}

extern "C" void image() {
  clock_168_MHz();
  rcc.ahb1enr |= 1;
  rcc.apb1enr |= 1;
  gpioa.moder = (gpioa.moder & ~3U) | 2;
  gpioa.afr[0] = 1;
  tim2.arr = 0xffffffff;
  tim2.ccmr1 = 3 << 4;
  tim2.ccr[0] = 84'000;
  tim2.ccer = 1;
  tim2.dier = 2;
  enable_irq(28, 0x10);
  tim2.cr1 = 1;
#ifdef BUSY
  uint32_t value = 1;
  for (;;) {
    for (uint32_t i = 0; i < 64; ++i)
      value = value * 1664525 + 1013904223 + i;
    seen[1] = value;
  }
#endif
}
