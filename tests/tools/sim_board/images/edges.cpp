// Counts falling edges of PB0 through EXTI line 0 and mirrors the level to PA1.

#include "tests/tools/sim_board/images/chip.hpp"

extern "C" void exti0() {
  at(0x40013c14) = 1;
  seen[0] = seen[0] + 1;
  gpioa.bsrr = gpiob.idr & 1 ? 1 << 1 : 1 << 17;
}

extern "C" void image() {
  enable_clocks(rcc.ahb1enr, 3);
  enable_clocks(rcc.apb2enr, 1 << 14);
  gpioa.moder |= 1 << 2;
  gpioa.bsrr = 1 << 1;
  gpiob.pupdr = (gpiob.pupdr & ~3U) | 1;
  at(0x40013808) = 1;
  at(0x40013c0c) = 1;
  at(0x40013c00) = 1;
  enable_irq(6, 0x20);
}
