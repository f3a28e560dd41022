// A carry that is made in the last instruction of a page and used in the first of the next, where the emulator
// begins a new block and may take an interrupt; interrupts that change the flags come all the time.
// seen: 0 interrupts, 1 wrong sums, 2 done.

#include "tests/tools/sim_board/images/chip.hpp"

extern "C" uint32_t carry_of(uint32_t a, uint32_t b);

asm(R"(
  .section .text.carry_of, "ax"
  .balign 4096
  .space 4092
  .thumb_func
  .global carry_of
carry_of:
  nop
  adds r0, r0, r1
  adc.w r0, r2, #0
  bx lr
)");

extern "C" void sys_tick() {
  const uint32_t count = seen[0] + 1;
  seen[0] = count;
  asm volatile("adds r0, %0, %0" ::"r"(count << 31) : "r0", "cc");
}

extern "C" void image() {
  at(0xe000e014) = 61;
  at(0xe000e018) = 0;
  at(0xe000e010) = 7;
  for (uint32_t i = 0; i < 20000; ++i) {
    const uint32_t a = i & 1 ? 0xffffffffU : 5;
    register uint32_t first asm("r0") = a;
    register uint32_t second asm("r1") = 7;
    register uint32_t zero asm("r2") = 0;
    asm volatile("bl carry_of" : "+r"(first) : "r"(second), "r"(zero) : "lr", "r3", "r12", "cc", "memory");
    if (first != (i & 1)) seen[1] = seen[1] + 1;
  }
  seen[2] = 1;
}
