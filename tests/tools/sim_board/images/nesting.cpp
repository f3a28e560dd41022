// Preemption and tail-chaining. seen[1 + k] is the k-th mark:
//   10 low starts, 20 high preempts it, 21 high ends, 11 low ends, then tail-chained 30, 31 (an equal
//   priority waited), 40 high again only after PRIMASK is lifted, 50 after BASEPRI is lifted.

#include "tests/tools/sim_board/images/chip.hpp"

namespace {
void mark(uint32_t value) {
  const uint32_t count = seen[0];
  seen[1 + count] = value;
  seen[0] = count + 1;
}
volatile uint32_t phase = 0;
}  // namespace

extern "C" void tim3_irq() {  // low priority
  mark(10);
  pend_irq(54);  // equal: waits
  pend_irq(28);  // higher: at once
  asm volatile("dsb\n isb");
  mark(11);
}

extern "C" void tim2_irq() {  // high priority
  if (phase == 0) {
    mark(20);
    mark(21);
  } else {
    mark(phase);
  }
}

extern "C" void tim6_irq() {
  mark(30);
  mark(31);
}

extern "C" void image() {
  enable_irq(28, 0x10);
  enable_irq(29, 0x40);
  enable_irq(54, 0x40);
  pend_irq(29);
  asm volatile("dsb\n isb");
  phase = 40;
  asm volatile("cpsid i");
  pend_irq(28);
  asm volatile("dsb\n isb");
  mark(39);
  asm volatile("cpsie i\n isb");
  phase = 50;
  uint32_t mask = 0x10;
  asm volatile("msr basepri, %0" ::"r"(mask));
  pend_irq(28);
  asm volatile("dsb\n isb");
  mark(49);
  mask = 0;
  asm volatile("msr basepri, %0\n isb" ::"r"(mask));
  mark(99);
}
