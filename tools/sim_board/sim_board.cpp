#include "tools/sim_board/sim_board.hpp"

#include <algorithm>
#include <cstdio>
#include <utility>

#include "protocol/contract/input_error.hpp"
#include "tools/sim_board/chip.hpp"

namespace diastole {
namespace {

using board_model::Cycles;
using board_model::ResetCause;

const char* name_of(ResetCause cause) {
  switch (cause) {
    case ResetCause::power:
      return "power";
    case ResetCause::pin:
      return "pin";
    case ResetCause::software:
      return "software";
    case ResetCause::independent_watchdog:
      return "watchdog";
  }
  return "unknown";
}

constexpr uint32_t core_exception_base = 0x8000'0000;

}  // namespace

struct SimBoard::Board {
  explicit Board(const SimBoardOptions& options)
      : chip(
            options.crystal_Hz, options.random_seed, options.device_id, options.flash_timing,
            {[this](uint8_t byte, Cycles at) {
               sent.push_back({chip.clock.ns(at), byte});
             },
             [this](uint8_t timer, uint8_t channel, Cycles late_by) { note_missed(timer, channel, late_by); },
             [this](ResetCause cause) {
               requested = cause;
               chip.cpu.interrupt();
             },
             [this] {
               power_fails = true;
               chip.cpu.interrupt();
             },
             [this](uint32_t offset, uint32_t bytes) {
               if (flash_listener) flash_listener(offset, bytes);
             }}) {
    if (options.cell_seed) chip.flash.randomise_cut_cells(*options.cell_seed);
  }

  void note_missed(uint8_t timer, uint8_t channel, Cycles late_by) {
    ++missed;
    if (!missed_listener) return;
    const Cycles now = chip.clock.now();
    missed_listener({chip.clock.ns(now), timer, channel, chip.clock.ns(now + late_by) - chip.clock.ns(now)});
  }

  void reset(ResetCause cause) {
    requested.reset();
    chip.reset(cause);
    resets.push_back({chip.clock.ns(chip.clock.now()), name_of(cause)});
  }

  /// Bytes between the initial stack pointer and the deepest word that differs from the power-up pattern.
  [[nodiscard]] uint32_t stack_used() {
    const uint32_t top = chip.memory.word(0).value_or(0);
    const auto ram =
        top - board_model::ccm_base <= board_model::ccm_bytes ? chip.memory.ccm() : chip.memory.sram();
    const uint32_t base = top - board_model::ccm_base <= board_model::ccm_bytes ? board_model::ccm_base
                                                                                : board_model::sram_base;
    if (top < base || top - base > ram.size()) return 0;
    // The longest untouched run below the top separates static data (below) from the stack (above).
    uint32_t run = 0, longest = 0, end_of_longest = 0;
    for (uint32_t at = 0; at < top - base; ++at) {
      run = ram[at] == board_model::untouched ? run + 1 : 0;
      if (run > longest) {
        longest = run;
        end_of_longest = at + 1;
      }
    }
    return top - base - (end_of_longest & ~3U);
  }

  std::vector<SentByte> sent;
  std::vector<BoardReset> resets;
  std::function<void(const MissedDeadline&)> missed_listener;
  std::function<void(uint32_t, uint32_t)> flash_listener;
  uint64_t missed = 0;
  std::optional<ResetCause> requested;
  double supply_V = 3.3;
  bool powered = false, power_fails = false, browned_out = false;
  board_model::Chip chip;
};

SimBoard::SimBoard(SimBoardOptions options) : board_(std::make_unique<Board>(options)) {}
SimBoard::~SimBoard() = default;
SimBoard::SimBoard(SimBoard&&) noexcept = default;
SimBoard& SimBoard::operator=(SimBoard&&) noexcept = default;

void SimBoard::load(std::span<const uint8_t> bytes, uint32_t address) {
  const auto place = board_->chip.memory.at(address, static_cast<uint32_t>(bytes.size()));
  if (place.size() != bytes.size()) {
    char text[120];
    std::snprintf(text, sizeof text, "%zu bytes at 0x%08x do not fit into a memory of the STM32F405",
                  bytes.size(), address);
    throw InputError({"", "load address", text, "Flash is 1 MB at 0x08000000, RAM 128 KB at 0x20000000."});
  }
  std::ranges::copy(bytes, place.begin());
  if (address - board_model::flash_base < board_model::flash_bytes) {
    board_->chip.cpu.forget_code(address - board_model::flash_base, static_cast<uint32_t>(bytes.size()));
  }
}

std::span<const uint8_t> SimBoard::flash() const { return board_->chip.memory.flash(); }

void SimBoard::power_on() {
  if (std::exchange(board_->powered, true)) return;
  board_->power_fails = false;
  board_->chip.memory.forget_ram();
  board_->reset(ResetCause::power);
}

void SimBoard::set_supply_mV(uint32_t supply_mV) {
  constexpr uint32_t ram_keeps_mV = 1700;
  Board& board = *board_;
  board.chip.power.set_supply_mV(supply_mV);
  board.chip.flash.set_supply_mV(supply_mV);
  board.chip.adc.set_supply_mV(supply_mV);
  board.supply_V = 1e-3 * supply_mV;
  if (board.powered && supply_mV < board.chip.flash.brown_out().falling_mV) {
    power_off();
    board.browned_out = true;
  }
  if (!board.browned_out) return;
  if (supply_mV < ram_keeps_mV) board.chip.memory.forget_ram();
  if (supply_mV < board.chip.flash.brown_out().rising_mV) return;
  board.browned_out = false;
  board.powered = true;
  board.power_fails = false;
  board.reset(ResetCause::power);
}

std::size_t SimBoard::marginal_words() const { return board_->chip.flash.marginal_words(); }

void SimBoard::make_marginal(uint32_t address, uint32_t bits) {
  board_->chip.flash.make_marginal(address - board_model::flash_base, bits);
}

uint32_t SimBoard::option_bytes() const { return board_->chip.flash.option_bytes(); }

uint32_t SimBoard::flash_access_control() const { return board_->chip.flash.access_control(); }

void SimBoard::hold_core(bool held) {
  constexpr uint32_t apb1_freeze = 0xe004'2008, watchdog_stops = 1U << 12;
  board_model::Chip& chip = board_->chip;
  chip.cpu.hold(held);
  chip.watchdog.hold(held && (chip.bus.read(apb1_freeze, 4) & watchdog_stops) != 0);
}

void SimBoard::stall_after_store(uint32_t address, uint64_t time_ns) {
  board_->chip.cpu.stall_after_store(address, board_->chip.clock.cycles_in(time_ns));
}

void SimBoard::stick_dma(uint32_t stream) { board_->chip.dma1.stick(stream); }
void SimBoard::fail_crystal() { board_->chip.rcc.fail_crystal(); }

void SimBoard::power_off() {
  board_->powered = false;
  board_->chip.bus.reset_all();  // every output goes to rest
}

void SimBoard::reset() {
  if (board_->powered) board_->reset(ResetCause::pin);
}

bool SimBoard::powered() const { return board_->powered; }

void SimBoard::advance_to(uint64_t time_ns) {
  Board& board = *board_;
  board_model::Clock& clock = board.chip.clock;
  while (clock.ns(clock.now()) < time_ns) {
    // A change of clocks moves the cycle that `time_ns` falls on: hence in pieces, each ending at a boundary.
    const Cycles limit = clock.cycle_at(time_ns);
    if (!board.powered) {
      clock.set_now(limit);
      board.chip.scheduler.run_until(limit);
      return;
    }
    board.chip.cpu.run_until(std::min(limit, clock.now() + clock.cycles_in(10'000'000)));
    if (std::exchange(board.power_fails, false)) {
      power_off();
      return;
    }
    if (board.requested) board.reset(*board.requested);
    if (clock.now() >= limit && clock.cycle_at(time_ns) <= clock.now()) return;
  }
}

uint64_t SimBoard::now_ns() const { return board_->chip.clock.ns(board_->chip.clock.now()); }

void SimBoard::send(std::span<const uint8_t> bytes) {
  board_model::Usart* port = board_->chip.serial();
  if (port == nullptr) return;
  for (const uint8_t byte : bytes)
    port->receive(byte);
}

void SimBoard::send_unframed(std::span<const uint8_t> bytes) {
  if (board_model::Usart* port = board_->chip.serial())
    for (const uint8_t byte : bytes)
      port->receive(byte, false);
}

std::vector<SentByte> SimBoard::take_sent() { return std::exchange(board_->sent, {}); }

std::size_t SimBoard::bytes_on_the_way() const {
  const board_model::Usart* port = board_->chip.serial();
  return port == nullptr ? 0 : port->waiting_bytes();
}

void SimBoard::drive(Pin pin, bool level, uint64_t time_ns) { board_->chip.world.plan(time_ns, pin, level); }

void SimBoard::short_pin(Pin pin, std::optional<bool> level) {
  board_model::Chip& chip = board_->chip;
  chip.ports[pin.port]->short_to(pin.number, level, chip.clock.now());
}

bool SimBoard::level(Pin pin) const { return board_->chip.pins.level(pin); }

void SimBoard::drive_analog(Pin pin, std::function<double(uint64_t)> volts) {
  board_->chip.analog[pin.index()] = std::move(volts);
}

double SimBoard::dac_V(uint8_t channel, uint64_t time_ns) const {
  const board_model::Chip& chip = board_->chip;
  return board_->supply_V * chip.dac.share_at(channel - 1U, chip.clock.cycle_at(time_ns));
}

std::vector<SimBoard::PinEvent> SimBoard::take_pin_events() { return board_->chip.pins.take(); }

void SimBoard::on_pin_change(std::function<void(Pin, bool, uint64_t)> listener) {
  board_model::Chip& chip = board_->chip;
  chip.pins.on_change([&chip, listener = std::move(listener)](Pin pin, bool level, Cycles at) {
    listener(pin, level, chip.clock.ns(at));
  });
}

void SimBoard::cut_power_at_flash_operation(std::optional<uint64_t> operation) {
  board_->chip.flash.cut_power_at(operation);
}

void SimBoard::on_flash_change(std::function<void(uint32_t, uint32_t)> listener) {
  board_->flash_listener = std::move(listener);
}

void SimBoard::on_missed_deadline(std::function<void(const MissedDeadline&)> listener) {
  board_->missed_listener = std::move(listener);
}

std::optional<uint32_t> SimBoard::word(uint32_t address) const { return board_->chip.memory.word(address); }

uint32_t SimBoard::peripheral_word(uint32_t address) { return board_->chip.bus.read(address, 4); }

uint32_t SimBoard::timer_count(uint8_t number) const {
  constexpr uint32_t counter = 0x24;
  const auto& timers = board_->chip.timers;
  const auto timer =
      std::ranges::find_if(timers, [number](const auto& each) { return each->shape().number == number; });
  return (*timer)->read(counter).value();
}

BoardStatistics SimBoard::statistics() const {
  Board& board = *board_;
  board_model::Chip& chip = board.chip;
  BoardStatistics found;
  found.time_ns = now_ns();
  found.cycles = chip.clock.now();
  found.instructions = chip.cpu.instructions();
  found.flash_wait_cycles = chip.cpu.flash_wait_cycles();
  found.asleep_cycles = chip.cpu.asleep_cycles();
  found.core_Hz = chip.clock.tree().core_Hz;
  found.stack_top = chip.memory.word(0).value_or(0);
  found.stack_used_bytes = board.stack_used();
  found.flash_operations = chip.flash.operations();
  found.flash_broken_off = chip.flash.broken_off();
  found.serial_overruns = chip.serial_overruns();
  found.missed_deadlines = board.missed;
  for (uint32_t number = 0; number < board_model::exception_count; ++number) {
    const board_model::InterruptCost& cost = chip.nvic.costs()[number];
    if (cost.count == 0) continue;
    const uint32_t irq = number >= board_model::exception::first_irq
                             ? number - board_model::exception::first_irq
                             : core_exception_base + number;
    found.interrupts.push_back({irq, cost.count, cost.worst_instructions, cost.worst_latency_cycles});
  }
  found.resets = board.resets;
  found.notes = chip.notes.all();
  found.last_fault = chip.cpu.last_fault();
  found.locked_up = chip.cpu.locked_up();
  return found;
}

}  // namespace diastole
