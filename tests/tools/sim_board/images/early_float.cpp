// Uses the FPU without enabling it: UsageFault (NOCP), which escalates to HardFault as it is not enabled.

#include "tests/tools/sim_board/images/chip.hpp"

extern "C" void hard_fault() {
  seen[1] = at(0xe000ed28);
  seen[2] = at(0xe000ed2c);
  for (;;) {
  }
}

extern "C" void image() {
  seen[0] = 1;
  asm volatile("vmov.f32 s0, #1.0");
  seen[3] = 1;
}
