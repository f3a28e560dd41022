// Floating point in the main program and in an interrupt that preempts it all the time: sums must come out
// right. seen: 0 the sum's bits, 1 the interrupt's, 2 done; 3 CONTROL.

#include "tests/tools/sim_board/images/chip.hpp"

namespace {
volatile float product = 1.0F;
}

extern "C" void tim2_irq() {
  tim2.sr = 0;
  float value = product;
  for (int i = 0; i < 5; ++i)
    value = value * 1.25F + 0.5F;
  product = value > 1000.0F ? 1.0F : value;
  seen[1] = seen[1] + 1;
}

extern "C" void image() {
  enable_fpu();
  enable_clocks(rcc.apb1enr, 1);
  tim2.arr = 200;
  tim2.dier = 1;
  enable_irq(28, 0x10);
  tim2.cr1 = 1;
  float sum = 0.0F, term = 1.0F, other = 3.0F;
  for (int i = 0; i < 20000; ++i) {
    sum += term * other;
    term = term * 0.5F + 0.125F;
    other = other * 0.25F + 1.5F;
  }
  tim2.cr1 = 0;
  union {
    float value;
    uint32_t bits;
  } result{sum};
  seen[0] = result.bits;
  uint32_t control = 0;
  asm volatile("mrs %0, control" : "=r"(control));
  seen[3] = control;
  seen[2] = 1;
}
