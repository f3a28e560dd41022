// The application: the controller on the STM32F405.

#include "firmware/boards/stm32f405/crash.hpp"
#include "firmware/boards/stm32f405/pins.hpp"
#include "firmware/boards/stm32f405/registers.hpp"
#include "firmware/boards/stm32f405/step_path.hpp"
#include "firmware/boards/stm32f405/stm32_board.hpp"
#include "firmware/core/controller.hpp"

namespace {

// Interrupt handlers take no argument, so what they serve has static storage.
diastole::stm32::Stm32Board board;
diastole::firmware::Controller<diastole::stm32::Stm32Board> controller(board);

/// What a handler has stored reaches its peripheral before the handler returns. Else the core may clear one interrupt's pending
/// state and run another one's handler in its place (Arm 838869, errata sheet ES0182 2.1.3).
struct StoresBeforeReturn {
  StoresBeforeReturn() = default;
  StoresBeforeReturn(const StoresBeforeReturn&) = delete;
  StoresBeforeReturn& operator=(const StoresBeforeReturn&) = delete;
  ~StoresBeforeReturn() { asm volatile("dsb" ::: "memory"); }
};

}  // namespace

extern "C" {

/// A step: the compare event has started its pulse.
void TIM5_IRQHandler() {
  const StoresBeforeReturn stores;
  controller.on_match();
}

void TIM2_IRQHandler() {
  const StoresBeforeReturn stores;
  board.timer_interrupt();
}

void EXTI_IRQHandler() {
  const StoresBeforeReturn stores;
  board.input_interrupt();
  controller.on_inputs();
}

void USART3_IRQHandler() {
  const StoresBeforeReturn stores;
  board.serial_interrupt();
}

void DMA1_Stream5_IRQHandler() {
  const StoresBeforeReturn stores;
  board.r_wave_interrupt();
}

void SysTick_Handler() {
  const StoresBeforeReturn stores;
  board.millisecond_interrupt();
}

/// A processor fault, the crystal's failure, or an interrupt that nobody enabled: motor off, what is known of it kept, and
/// the watchdog starts anew.
void Stray_Handler(const std::uint32_t* frame) {
  asm volatile("cpsid i" ::: "memory");
  diastole::stm32::gpio_b().BSRR.write(diastole::stm32::kEnablePin << 16);
  diastole::stm32::tim2().CCMR1.write(4U << 12);  // the TTL at rest, whichever level that is
  diastole::stm32::tim3().CCER.write(0);
  diastole::stm32::keep_crash(frame);
  for (;;) {
  }
}

int main() {
  board.start();
  for (;;) {
    controller.poll();
    board.sleep();
  }
}
}
