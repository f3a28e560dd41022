// From reset to main(): floating-point unit, data, memory protection, constructors; and the vector table.

#include <cstddef>
#include <cstdint>

#include "firmware/boards/stm32f405/memory_guard.hpp"

extern "C" {
extern std::uint32_t __data_load, __data_start, __data_end, __bss_start, __bss_end, __stack_top;
extern void (*const __init_array_start[])();
extern void (*const __init_array_end[])();

int main();
/// A program's own: a processor fault, or an interrupt that nobody enabled. `frame` is the stack pointer at which the core
/// has left the registers, or meant to; nothing that it stacks may be relied on. Does not return.
[[noreturn]] void Stray_Handler(const std::uint32_t* frame);
[[noreturn]] void Reset_Handler();
[[noreturn]] void start();

/// Begins the stack anew, for it may be the stack that is broken.
[[gnu::naked]] void Stray_Entry() noexcept {
  asm volatile(
      "mov r0, sp          \n"
      "ldr r1, =__stack_top \n"
      "mov sp, r1          \n"
      "b Stray_Handler     \n");
}

// A program defines the handlers of the interrupts that it enables.
[[gnu::weak, gnu::alias("Stray_Entry")]] void TIM2_IRQHandler() noexcept;
[[gnu::weak, gnu::alias("Stray_Entry")]] void TIM5_IRQHandler() noexcept;
[[gnu::weak, gnu::alias("Stray_Entry")]] void USART3_IRQHandler() noexcept;
[[gnu::weak, gnu::alias("Stray_Entry")]] void DMA1_Stream5_IRQHandler() noexcept;
[[gnu::weak, gnu::alias("Stray_Entry")]] void EXTI_IRQHandler() noexcept;
[[gnu::weak, gnu::alias("Stray_Entry")]] void SysTick_Handler() noexcept;

/// Nothing may use a floating-point register before the unit is on, not even a prologue; hence no C++ here.
/// CPACR (0xE000ED88): full access to coprocessors 10 and 11.
[[gnu::naked]] void Reset_Handler() {
  asm volatile(
      "ldr r0, =0xE000ED88 \n"
      "ldr r1, [r0]        \n"
      "orr r1, r1, #(0xF << 20) \n"
      "str r1, [r0]        \n"
      "dsb                 \n"
      "isb                 \n"
      "b start             \n");
}

void start() {
  const std::uint32_t* from = &__data_load;
  for (std::uint32_t* to = &__data_start; to < &__data_end;)
    *to++ = *from++;
  for (std::uint32_t* to = &__bss_start; to < &__bss_end;)
    *to++ = 0;
  diastole::stm32::guard_memory();
  for (auto constructor = __init_array_start; constructor < __init_array_end; ++constructor)
    (*constructor)();
  main();
  for (;;) {
  }
}

/// What the C library calls when a program ends; this one does not.
[[noreturn]] void _exit(int) {
  for (;;) {
  }
}
}

namespace {

using Vector = void (*)();

struct VectorTable {
  const void* stack_top;
  Vector handlers[15 + DIASTOLE_INTERRUPTS];
};

constexpr std::size_t of_interrupt(std::size_t number) { return 15 + number; }

constexpr VectorTable make_vectors() {
  VectorTable table{&__stack_top, {}};
  for (Vector& handler : table.handlers)
    handler = Stray_Entry;
  table.handlers[0] = Reset_Handler;
  table.handlers[14] = SysTick_Handler;
  table.handlers[of_interrupt(6)] = EXTI_IRQHandler;
  table.handlers[of_interrupt(7)] = EXTI_IRQHandler;
  table.handlers[of_interrupt(8)] = EXTI_IRQHandler;
  table.handlers[of_interrupt(16)] = DMA1_Stream5_IRQHandler;
  table.handlers[of_interrupt(28)] = TIM2_IRQHandler;
  table.handlers[of_interrupt(39)] = USART3_IRQHandler;
  if (DIASTOLE_INTERRUPTS > 50) table.handlers[of_interrupt(50)] = TIM5_IRQHandler;
  return table;
}

[[gnu::section(".vectors"), gnu::used]] constinit const VectorTable kVectors = make_vectors();

}  // namespace
