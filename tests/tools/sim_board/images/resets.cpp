// First start: asks for a software reset. Second: starts the watchdog and hangs. Third: stops here.
// seen[8] counts starts (start-up code clears it, so a backup register keeps it), seen[9] holds RCC_CSR.

#include "tests/tools/sim_board/images/chip.hpp"

extern "C" void image() {
  enable_clocks(rcc.apb1enr, 1 << 28);
  volatile uint32_t& starts = at(0x40002850);
  const uint32_t flags = rcc.csr;
  starts = starts + 1;
  seen[8] = starts;
  seen[9] = flags;
  rcc.csr = rcc.csr | 1 << 24;
  if (starts == 1) at(0xe000ed0c) = 0x05fa0004;
  if (starts == 2) {
    iwdg.kr = 0xcccc;
    iwdg.kr = 0x5555;
    iwdg.pr = 0;
    iwdg.rlr = 799;  // 800 ticks of 4/32000 s: 100 ms
    iwdg.kr = 0xaaaa;
    for (;;) {
    }
  }
}
