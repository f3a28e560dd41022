// 30,000 rising edges a second on PA6 (TIM3 channel 1, compare-toggle), planned one edge ahead by its
// interrupt. With BUSY the core spins instead of sleeping between interrupts.

#include "tests/tools/sim_board/images/chip.hpp"

namespace {
constexpr uint32_t half_period_ticks = 84'000'000 / 60'000;
}

extern "C" void tim3_irq() {
  tim3.sr = 0x1e5f & ~2U;
  tim3.ccr[0] = tim3.ccr[0] + half_period_ticks;
  seen[0] = seen[0] + 1;
}

extern "C" void image() {
  clock_168_MHz();
  enable_clocks(rcc.ahb1enr, 1);
  enable_clocks(rcc.apb1enr, 2);
  gpioa.moder = (gpioa.moder & ~(3U << 12)) | 2 << 12;
  gpioa.afr[0] = 2 << 24;
  tim3.arr = 0xffff;
  tim3.ccmr1 = 3 << 4;
  tim3.ccr[0] = 0x8000;
  tim3.ccer = 1;
  tim3.dier = 2;
  enable_irq(29, 0x10);
  tim3.cr1 = 1;
#ifdef BUSY
  uint32_t value = 1;
  for (;;) {
    for (uint32_t i = 0; i < 64; ++i)
      value = value * 1664525 + 1013904223 + i;
    seen[1] = value;
  }
#endif
}
