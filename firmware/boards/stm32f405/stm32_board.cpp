#include "firmware/boards/stm32f405/stm32_board.hpp"

#include <initializer_list>

#include "firmware/boards/stm32f405/boot_identity.hpp"
#include "firmware/boards/stm32f405/clocks.hpp"
#include "firmware/boards/stm32f405/crash.hpp"
#include "firmware/boards/stm32f405/pins.hpp"
#include "firmware/boards/stm32f405/registers.hpp"
#include "firmware/boards/stm32f405/supply.hpp"
#include "firmware/boards/stm32f405/watchdog.hpp"

namespace diastole::stm32 {

namespace {

/// The number behind the FAULT pin, at 0x20000000 (stm32f405.ld) for whoever looks from outside.
[[gnu::section(".shown"), gnu::used]] volatile std::uint8_t shown_fault;

/// Not written at start-up: what it holds outlives a reset.
[[gnu::section(".retained")]] firmware::BlackBox::Memory retained_memory;

}  // namespace

void Stm32Board::start() {
  start_cycle_counter();
  clock_sound_ = start_clocks() == ClockSource::crystal;
  start_supply_detector();
  identity_ = read_identity();
  shown_fault = 0;
  configure_pins();
  timer_.start();
  r_wave_.start();
  started_ = true;
  if (signals_) use_signals(*signals_);
  serial_.start();
  for (const Interrupt input : {kExti0, kExti1, kExti2})
    enable_interrupt(input, 1);
  start_systick();
  start_watchdog(WatchdogPeriod::strict);
}

/// Settings are read before the clocks run: they count from start() on.
void Stm32Board::use_signals(const firmware::SignalSettings& signals) {
  signals_ = signals;
  if (!started_) return;
  timer_.use(signals.ttl_active_low);
  r_wave_.use(signals);
}

void Stm32Board::prepare_r_wave(bool play) {
  if (play)
    r_wave_.arm();
  else
    r_wave_.disarm();
}

void Stm32Board::cancel_pulses() {
  r_wave_.disarm();
  timer_.cancel();
}

void Stm32Board::set_motor_enabled(bool enabled) {
  gpio_b().BSRR.write(enabled ? kEnablePin : kEnablePin << 16);
}

void Stm32Board::show_fault(std::uint8_t number) {
  shown_fault = number;
  gpio_b().BSRR.write(number != 0 ? kFaultPin : kFaultPin << 16);
}

firmware::Inputs Stm32Board::inputs() const {
  const std::uint32_t levels = gpio_c().IDR.read();
  return {(levels & kEstopPin) != 0, (levels & kHomePin) != 0, (levels & kFarLimitPin) != 0};
}

firmware::BlackBox::Memory& Stm32Board::retained() { return retained_memory; }

std::optional<firmware::CrashRecord> Stm32Board::take_crash() { return stm32::take_crash(); }

bool Stm32Board::supply_sound() const { return supply_suffices(); }

void Stm32Board::feed_watchdog() { stm32::feed_watchdog(); }

/// An interrupt that comes between the question and the sleep ends the sleep, although it is served after it.
void Stm32Board::sleep() {
  while (!turn_due_.exchange(false, std::memory_order_relaxed)) {
    const InterruptLock lock(*this);
    if (!turn_due_.load(std::memory_order_relaxed)) asm volatile("wfi" ::: "memory");
  }
}

void Stm32Board::input_interrupt() {
  exti().PR.write(kEstopPin | kHomePin | kFarLimitPin);
  turn_due_ = true;
}

}  // namespace diastole::stm32
