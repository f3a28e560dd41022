#pragma once
// An STM32F405 board in software: executes a real image, instruction by instruction, with the chip's
// peripherals modelled at register level, and shows what a wire on each pin would carry. Virtual time; two
// runs with the same inputs are equal to the byte.
//
//   SimBoard board;
//   board.load(image, 0x0800'0000);
//   board.power_on();
//   board.drive({1, 12}, false, 2'000'000'000);   // PB12 falls after two seconds
//   board.advance_to(3'000'000'000);
//   for (const PinEvent& event : board.take_pin_events()) ...
//
// What is modelled, how exactly, and what is not: tools/sim_board/README.md.

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tools/sim_board/core/notes.hpp"
#include "tools/sim_board/core/pins.hpp"
#include "tools/sim_board/processor/flash_access.hpp"

namespace diastole {

struct SimBoardOptions {
  uint32_t crystal_Hz = 8'000'000;   ///< Olimex STM32-H405: 8 MHz, Feather F405: 12 MHz; 0: it never starts
  uint32_t random_seed = 1;          ///< of the chip's random number generator
  uint32_t device_id = 0x1007'6413;  ///< DBGMCU_IDCODE: revision Y; 0x2000'6411 is revision A
  board_model::FlashTiming flash_timing = board_model::FlashTiming::hits;  ///< of wait states
  std::optional<uint32_t>
      cell_seed{};  ///< power cuts leave arbitrary bits and marginal cells, drawn from this
};

/// A byte that left through the board's serial port; the time is the end of its stop bit.
struct SentByte {
  uint64_t time_ns = 0;
  uint8_t value = 0;
};

/// A compare value reached the timer after the counter had passed it: the edge is lost or a whole turn late.
struct MissedDeadline {
  uint64_t time_ns = 0;
  uint8_t timer = 0, channel = 0;
  uint64_t late_ns = 0;
};

struct InterruptStatistics {
  uint32_t irq = 0;  ///< interrupt number; exceptions of the core count from 0x8000'0000 + exception number
  uint64_t count = 0;
  uint64_t worst_instructions = 0;
  uint64_t worst_latency_cycles = 0;
};

struct BoardReset {
  uint64_t time_ns = 0;
  std::string cause;  ///< "power", "pin", "software", "watchdog"
};

struct BoardStatistics {
  uint64_t time_ns = 0;
  uint64_t cycles = 0;
  uint64_t instructions = 0;
  uint64_t flash_wait_cycles = 0;  ///< see processor/flash_access.hpp
  uint64_t asleep_cycles = 0;      ///< in WFI, waiting for an interrupt
  uint32_t core_Hz = 0;
  uint32_t stack_top = 0;         ///< initial stack pointer
  uint32_t stack_used_bytes = 0;  ///< deepest word touched below stack_top since power-up
  uint64_t flash_operations = 0;
  uint64_t flash_broken_off = 0;  ///< of them, by a reset or a failing supply
  uint64_t serial_overruns = 0;
  uint64_t missed_deadlines = 0;
  std::vector<InterruptStatistics> interrupts;
  std::vector<BoardReset> resets;
  std::map<std::string, board_model::Note> notes;
  std::string last_fault;  ///< in words; empty: none
  bool locked_up = false;
};

class SimBoard {
 public:
  using Pin = board_model::Pin;
  using PinEvent = board_model::PinEvent;

  explicit SimBoard(SimBoardOptions options = {});
  ~SimBoard();
  SimBoard(SimBoard&&) noexcept;
  SimBoard& operator=(SimBoard&&) noexcept;

  /// Puts bytes into flash or RAM, as a debugger would. Throws InputError when they do not fit a memory.
  void load(std::span<const uint8_t> bytes, uint32_t address);
  /// The whole megabyte, to be kept for another day; load() puts it back.
  [[nodiscard]] std::span<const uint8_t> flash() const;

  void power_on();
  void power_off();
  void power_cycle() {
    power_off();
    power_on();
  }
  /// The reset button.
  void reset();
  [[nodiscard]] bool powered() const;

  /// Executes until `time_ns` after the first power-up; nothing when that has passed. Time passes for a board
  /// without power too. Ends early, at the moment of it, when power is cut (see
  /// cut_power_at_flash_operation).
  void advance_to(uint64_t time_ns);
  [[nodiscard]] uint64_t now_ns() const;

  /// Bytes for the board's serial port: back to back from now on, at the rate the firmware set; lost while
  /// the firmware does not listen.
  void send(std::span<const uint8_t> bytes);
  /// The same, disturbed so that their stop bits are low: a framing error each.
  void send_unframed(std::span<const uint8_t> bytes);
  /// What left through the serial port since the last call.
  std::vector<SentByte> take_sent();
  /// Bytes given to send() that have not reached the receiver yet.
  [[nodiscard]] std::size_t bytes_on_the_way() const;

  /// Drives a pin from outside from `time_ns` on. Undriven inputs follow their pull-up, else they are low.
  void drive(Pin pin, bool level, uint64_t time_ns);
  /// A short to ground or to the supply from now on: the pin has this level whatever the chip puts out; nullopt: no more.
  void short_pin(Pin pin, std::optional<bool> level);
  [[nodiscard]] bool level(Pin pin) const;
  /// Volts on a pin from outside, as the converter sees them when it asks. Others have 0 V.
  void drive_analog(Pin pin, std::function<double(uint64_t time_ns)> volts);
  /// The output of DAC channel 1 or 2, at a moment between the change before last and now.
  [[nodiscard]] double dac_V(uint8_t channel, uint64_t time_ns) const;
  /// Changes of pins and DAC codes since the last call, in order of time.
  std::vector<PinEvent> take_pin_events();

  /// Called at each change of a pin, while it happens; may call drive(). For switches that follow a carriage.
  void on_pin_change(std::function<void(Pin, bool level, uint64_t time_ns)> listener);

  /// Power fails in the middle of flash operation `operation` (1 is the next one); nullopt: never.
  void cut_power_at_flash_operation(std::optional<uint64_t> operation);

  /// The supply from now on. Below the brown-out threshold of the option bytes (level 3: 2.83 V; 1.68 V without one) the chip is
  /// held in reset, outputs off, until it has risen some 0.1 V above it (2.92 V; 1.72 V); below 1.7 V RAM forgets. Flash
  /// operations below 2.7 V leave marginal cells.
  void set_supply_mV(uint32_t supply_mV);
  /// Words of flash with cells that each reset reads anew.
  [[nodiscard]] std::size_t marginal_words() const;
  /// These bits of a word of flash are of that kind from now on. Precondition: `address` is a multiple of 4, in flash.
  void make_marginal(uint32_t address, uint32_t bits);
  /// The user option bytes as OPTCR shows them, bits 2 to 27.
  [[nodiscard]] uint32_t option_bytes() const;
  /// FLASH_ACR: wait states, caches, prefetch.
  [[nodiscard]] uint32_t flash_access_control() const;
  /// When the program next stores to the register at `address`, the core stands still behind it for so long; all else goes on.
  void stall_after_store(uint32_t address, uint64_t time_ns);
  /// From now on the stream of DMA1 brings nothing and cannot be switched off, until a reset.
  void stick_dma(uint32_t stream);
  /// The crystal stops for good.
  void fail_crystal();
  /// A debugger stops the core, or lets it go on. The peripherals run on, but for a watchdog that the firmware has bound to it.
  void hold_core(bool held);

  /// Called after each operation on the flash with the bytes that it changed, counted from the start of flash.
  void on_flash_change(std::function<void(uint32_t offset, uint32_t bytes)> listener);

  void on_missed_deadline(std::function<void(const MissedDeadline&)> listener);

  /// A word of memory, nullopt outside it; how tests and reports look at the firmware's variables.
  [[nodiscard]] std::optional<uint32_t> word(uint32_t address) const;
  /// A register of a peripheral, read as the core would; its clock is on.
  [[nodiscard]] uint32_t peripheral_word(uint32_t address);
  /// The counter of timer TIMn now. Precondition: the chip has it.
  [[nodiscard]] uint32_t timer_count(uint8_t number) const;
  [[nodiscard]] BoardStatistics statistics() const;

 private:
  struct Board;
  std::unique_ptr<Board> board_;
};

}  // namespace diastole
