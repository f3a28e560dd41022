// Spins until the PLL is ready, then says what it found: reset flags, CFGR, an output high on PA1 afterwards.

#include "tests/tools/sim_board/images/chip.hpp"

extern "C" void image() {
  seen[0] = rcc.csr;
  clock_168_MHz();
  seen[1] = rcc.cfgr;
  enable_clocks(rcc.ahb1enr, 1);
  gpioa.moder |= 1 << 2;
  gpioa.bsrr = 1 << 1;
  seen[2] = 1;
}
