// The bootloader on the STM32F405. A start takes two passes: the first decides and leaves the slot in the
// hand-over, then resets; the second enters the slot before it has touched any peripheral, so that the
// application begins as if it had been started by the chip itself.

#include "firmware/boards/stm32f405/bootloader/boot_board.hpp"
#include "firmware/boards/stm32f405/hand_over.hpp"
#include "firmware/boards/stm32f405/registers.hpp"
#include "firmware/boot/bootloader.hpp"

namespace {

using namespace diastole;
using namespace diastole::stm32;

asm(".section .signing_key,\"a\",%progbits\n"
    ".incbin \"" DIASTOLE_PUBLIC_KEY
    "\"\n"
    ".previous\n");

BootBoard board;
boot::Bootloader<BootBoard> bootloader(board);

/// Loads the stack pointer and the program counter from the application's vector table.
[[gnu::naked, noreturn]] void jump(std::uint32_t /*vectors*/) {
  asm volatile(
      "ldr r1, [r0]     \n"
      "ldr r2, [r0, #4] \n"
      "msr msp, r1      \n"
      "bx r2            \n");
}

[[noreturn]] void enter(std::uint32_t slot) {
  take_reset_cause();  // this pass's own reset says nothing
  start_watchdog(WatchdogPeriod::starting);
  const std::uint32_t vectors = kSlotSectors[slot].address + wire::kImageHeaderArea;
  system_control().VTOR.write(vectors);
  asm volatile("dsb \n isb" ::: "memory");
  jump(vectors);
}

}  // namespace

extern "C" {

void USART3_IRQHandler() { board.serial_interrupt(); }
void SysTick_Handler() { board.tick(); }

/// A processor fault or an interrupt that nobody enabled: start anew.
void Stray_Handler(const std::uint32_t*) { reset(); }

int main() {
  HandOver hand_over = read_hand_over().value_or(HandOver{});
  const HandOverCommand command = hand_over.command;
  hand_over.command = HandOverCommand::none;
  if (command == HandOverCommand::start && hand_over.slot < kSlotSectors.size()) {
    write_hand_over(hand_over);
    enter(hand_over.slot);
  }
  ++hand_over.starts;
  write_hand_over(hand_over);
  board.start(hand_over.starts);
  hand_over.reset_cause = board.reset_cause();
  const boot::Start start = bootloader.run(command == HandOverCommand::stay);
  if (start.slot != wire::ImageSlot::none) {
    hand_over.command = HandOverCommand::start;
    hand_over.slot = static_cast<std::uint32_t>(start.slot);
    hand_over.trial = start.trial ? 1 : 0;
  }
  write_hand_over(hand_over);
  reset();
}
}
