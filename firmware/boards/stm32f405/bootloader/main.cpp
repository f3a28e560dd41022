// The bootloader on the STM32F405. A start takes two passes: the first decides and leaves the slot in the
// hand-over, then resets; the second enters the slot before it has touched any peripheral, so that the
// application begins as if it had been started by the chip itself. A slot that does not read any more as it
// did when it was judged is not entered: the second pass decides anew.

#include <algorithm>
#include <bit>

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

/// What the first pass has read in the slot that it chose; the last word of the hand-over's memory is this.
volatile std::uint32_t& judged_reading() {
  return *reinterpret_cast<volatile std::uint32_t*>(kRetainedAddress + kHandOverBytes - 4);
}

/// A sum over a slot's header and code that any one changed bit changes: against cells that read now so, now so, not against
/// malice, for which the signature is.
std::uint32_t reading_of(std::uint32_t slot) {
  const std::span<const std::uint32_t> words = words_of(kSlotSectors[slot]);
  const std::size_t image_words = (wire::kImageHeaderArea + words[wire::kCodeBytesAt / 4]) / 4;
  std::uint32_t sum = 0;
  for (const std::uint32_t word : words.first(std::min(image_words, words.size())))
    sum = std::rotl(sum, 1) + word;
  return sum;
}

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
    if (reading_of(hand_over.slot) == judged_reading()) enter(hand_over.slot);
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
    judged_reading() = reading_of(hand_over.slot);
  }
  write_hand_over(hand_over);
  reset();
}
}
