#pragma once
// The STM32F405 as the core's Board (firmware/core/board.hpp).
//
// Interrupts: the timer and the inputs share priority 1 and so never interrupt each other; the serial port
// has 2, the R-wave's end 3. InterruptLock masks all of them.

#include <cstdint>
#include <optional>
#include <span>

#include "firmware/boards/stm32f405/pulse_timer.hpp"
#include "firmware/boards/stm32f405/r_wave_player.hpp"
#include "firmware/boards/stm32f405/serial_port.hpp"
#include "firmware/boards/stm32f405/settings_flash.hpp"
#include "firmware/core/board.hpp"

namespace diastole::stm32 {

class Stm32Board {
 public:
  using SettingsFlash = stm32::SettingsFlash;

  class InterruptLock {
   public:
    explicit InterruptLock(const Stm32Board&) {
      asm volatile("mrs %0, primask \n cpsid i" : "=r"(before_)::"memory");
    }
    ~InterruptLock() { asm volatile("msr primask, %0" ::"r"(before_) : "memory"); }
    InterruptLock(const InterruptLock&) = delete;
    InterruptLock& operator=(const InterruptLock&) = delete;

   private:
    std::uint32_t before_;
  };

  /// Clocks, pins, timers, serial port, watchdog (250 ms). Call before anything else.
  void start();

  [[nodiscard]] firmware::Ticks now() const { return timer_.now(); }
  void schedule(const firmware::PulseOrder& order);
  void cancel_pulses();
  void set_motor_enabled(bool enabled);
  void show_fault(std::uint8_t number);
  [[nodiscard]] firmware::Inputs inputs() const;
  [[nodiscard]] firmware::Identity identity() const { return identity_; }
  std::optional<std::uint8_t> serial_read() { return serial_.read(); }
  [[nodiscard]] std::size_t serial_room() const { return serial_.room(); }
  void serial_write(std::span<const std::uint8_t> bytes) { serial_.write(bytes); }
  void feed_watchdog();
  SettingsFlash& settings_flash() { return settings_flash_; }

  // Interrupt handlers.
  bool timer_interrupt() { return timer_.interrupt(); }
  void serial_interrupt() { serial_.interrupt(); }
  void r_wave_interrupt() { r_wave_.interrupt(); }
  void input_interrupt();

 private:
  PulseTimer timer_;
  RWavePlayer r_wave_;
  SerialPort serial_;
  SettingsFlash settings_flash_;
  firmware::Identity identity_;
};

}  // namespace diastole::stm32
