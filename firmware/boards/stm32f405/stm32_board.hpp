#pragma once
// The STM32F405 as the core's Board (firmware/core/board.hpp).
//
// Interrupts: the timers and the inputs share priority 1 and so never interrupt each other; the serial port
// has 2, the R-wave's end 3. InterruptLock masks all of them.
//
// The main loop sleeps between two turns. A turn is due every millisecond, when a frame has come in, and when an
// input has changed; a step alone does not cost one.

#include <atomic>
#include <cstdint>
#include <optional>
#include <span>

#include "firmware/boards/stm32f405/loop_back.hpp"
#include "firmware/boards/stm32f405/pulse_timer.hpp"
#include "firmware/boards/stm32f405/r_wave_player.hpp"
#include "firmware/boards/stm32f405/running_image.hpp"
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

  void use_signals(const firmware::SignalSettings& signals);
  [[nodiscard]] firmware::Ticks now() const { return timer_.now(); }
  [[nodiscard]] std::int32_t ticks_until(std::uint32_t tick) const { return timer_.ticks_until(tick); }
  void schedule(const firmware::PulseOrder& order) {
    if (order.ttl) prepare_r_wave(order.r_wave);
    timer_.schedule(order);
  }
  void schedule_trigger(std::uint32_t tick, firmware::Ticks width, bool r_wave) {
    prepare_r_wave(r_wave);
    timer_.raise_ttl(tick, width);
  }
  [[nodiscard]] std::optional<std::uint32_t> ttl_rise(std::uint32_t tick) const {
    return timer_.ttl_rise(tick);
  }
  void rest() { timer_.rest(); }
  void cancel_pulses();
  void set_motor_enabled(bool enabled);
  void show_fault(std::uint8_t number);
  [[nodiscard]] firmware::Inputs inputs() const;
  [[nodiscard]] firmware::Identity identity() const { return identity_; }
  std::optional<std::uint8_t> serial_read() { return serial_.read(); }
  [[nodiscard]] std::size_t serial_room() const { return serial_.room(); }
  void serial_write(std::span<const std::uint8_t> bytes) { serial_.write(bytes); }
  void feed_watchdog();
  [[nodiscard]] bool clock_sound() const { return clock_sound_; }
  [[nodiscard]] bool supply_sound() const;
  firmware::BlackBox::Memory& retained();
  std::optional<firmware::CrashRecord> take_crash();
  SettingsFlash& settings_flash() { return settings_flash_; }
  [[nodiscard]] firmware::RunningImage running_image() const { return stm32::running_image(); }
  [[nodiscard]] bool takes_unsigned_firmware() const { return stm32::takes_unsigned_firmware(); }
  bool confirm_image() { return confirm_running_image(); }
  wire::SelfTestReport self_test(const wire::SelfTest& request) {
    const bool ttl_active_low = signals_ && signals_->ttl_active_low;
    return LoopBack(timer_, r_wave_).measure(request.item, request.argument, ttl_active_low);
  }
  void restart(bool into_bootloader) { stm32::restart(into_bootloader); }

  /// Main loop: until a turn is due.
  void sleep();

  // Interrupt handlers.
  void timer_interrupt() { timer_.interrupt(); }
  void serial_interrupt() {
    if (serial_.interrupt()) turn_due_ = true;
  }
  void r_wave_interrupt() { r_wave_.interrupt(); }
  void input_interrupt();
  void millisecond_interrupt() { turn_due_ = true; }

 private:
  void prepare_r_wave(bool play);

  PulseTimer timer_;
  RWavePlayer r_wave_;
  SerialPort serial_;
  SettingsFlash settings_flash_;
  firmware::Identity identity_;
  std::optional<firmware::SignalSettings> signals_;  ///< nothing, so that the board has no initial data
  bool clock_sound_ = false, started_ = false;
  std::atomic<bool> turn_due_{false};
};

}  // namespace diastole::stm32
