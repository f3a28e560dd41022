// Vector table and start-up of the test images. A handler that an image does not define ends in unexpected().

#include "tests/tools/sim_board/images/chip.hpp"

__attribute__((section(".seen"))) volatile uint32_t seen[64];

extern "C" {
void image();
extern uint32_t stack_top, data_start, data_end, data_load, bss_start, bss_end;

void unexpected() {
  seen[63] = 0xdead;
  for (;;) {
  }
}

void reset() {
  for (uint32_t i = 0; i < 64; ++i)
    seen[i] = 0;
  uint32_t* from = &data_load;
  for (uint32_t* to = &data_start; to < &data_end;)
    *to++ = *from++;
  for (uint32_t* to = &bss_start; to < &bss_end;)
    *to++ = 0;
  image();
  for (;;)
    wait_for_interrupt();
}

#define WEAK_HANDLER __attribute__((weak, alias("unexpected")))
void hard_fault() WEAK_HANDLER;
void usage_fault() WEAK_HANDLER;
void bus_fault() WEAK_HANDLER;
void sv_call() WEAK_HANDLER;
void pend_sv() WEAK_HANDLER;
void sys_tick() WEAK_HANDLER;
void exti0() WEAK_HANDLER;
void tim2_irq() WEAK_HANDLER;
void tim3_irq() WEAK_HANDLER;
void usart1_irq() WEAK_HANDLER;
void tim6_irq() WEAK_HANDLER;

using Handler = void (*)();
constexpr int first_irq = 16, irqs = 82;
struct Vectors {
  uint32_t* stack;
  Handler handlers[first_irq + irqs - 1];
};

constexpr Vectors make_vectors() {
  Vectors vectors{&stack_top, {}};
  for (Handler& handler : vectors.handlers)
    handler = unexpected;
  const auto set = [&](int number, Handler handler) { vectors.handlers[number - 1] = handler; };
  set(1, reset);
  set(3, hard_fault);
  set(5, bus_fault);
  set(6, usage_fault);
  set(11, sv_call);
  set(14, pend_sv);
  set(15, sys_tick);
  set(first_irq + 6, exti0);
  set(first_irq + 28, tim2_irq);
  set(first_irq + 29, tim3_irq);
  set(first_irq + 37, usart1_irq);
  set(first_irq + 54, tim6_irq);
  return vectors;
}

__attribute__((section(".vectors"), used)) constexpr Vectors vectors = make_vectors();
}
