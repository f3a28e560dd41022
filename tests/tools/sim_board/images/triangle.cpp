// DAC channel 1 plays up and down once, a code every 100 µs, paced by TIM6 updates as its hardware trigger.

#include "tests/tools/sim_board/images/chip.hpp"

namespace {
uint32_t step = 0;
}  // namespace

extern "C" void tim6_irq() {
  tim6.sr = 0;
  ++step;
  dac.dhr12r1 = step <= 150 ? step * 20 : step <= 300 ? (300 - step) * 20 : 0;
  if (step > 301) tim6.cr1 = 0;
}

extern "C" void image() {
  clock_168_MHz();
  enable_clocks(rcc.apb1enr, 1 << 29 | 1 << 4);
  dac.cr = 1 | 1 << 2;
  tim6.psc = 83;
  tim6.arr = 99;
  tim6.egr = 1;
  tim6.sr = 0;
  tim6.cr2 = 2 << 4;
  tim6.dier = 1;
  enable_irq(54, 0x20);
  tim6.cr1 = 1;
}
