// SysTick every millisecond toggles PA1; SVC and PendSV are taken in order. seen: 0 ticks, 1 SVC, 2 PendSV.

#include "tests/tools/sim_board/images/chip.hpp"

extern "C" void sys_tick() {
  seen[0] = seen[0] + 1;
  gpioa.odr = gpioa.odr ^ 1 << 1;
  at(0xe000ed04) = 1 << 28;
}
extern "C" void sv_call() { seen[1] = seen[1] + 1; }
extern "C" void pend_sv() { seen[2] = seen[2] + 1; }

extern "C" void image() {
  enable_clocks(rcc.ahb1enr, 1);
  gpioa.moder |= 1 << 2;
  asm volatile("svc #0");
  at(0xe000e014) = 15999;
  at(0xe000e018) = 0;
  at(0xe000e010) = 7;
}
