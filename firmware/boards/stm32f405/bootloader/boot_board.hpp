#pragma once
// The STM32F405 as the bootloader's hardware (firmware/boot/bootloader.hpp).

#include "firmware/boards/stm32f405/flash_slots.hpp"
#include "firmware/boards/stm32f405/serial_port.hpp"
#include "firmware/boards/stm32f405/watchdog.hpp"

namespace diastole::stm32 {

class BootBoard : public FlashSlots {
 public:
  /// Clocks, outputs off, option bytes as they must be, serial port, a clock of milliseconds.
  void start(std::uint32_t starts);

  [[nodiscard]] std::uint64_t now_us() const { return std::uint64_t{milliseconds_} * 1000; }
  std::optional<std::uint8_t> serial_read() { return serial_.read(); }
  [[nodiscard]] std::size_t serial_room() const { return serial_.room(); }
  void serial_write(std::span<const std::uint8_t> bytes) { serial_.write(bytes); }
  /// Starts the watchdog at the first call.
  void feed_watchdog();
  void idle() { asm volatile("wfi" ::: "memory"); }
  [[nodiscard]] std::uint32_t boot_id() const { return boot_id_; }
  [[nodiscard]] wire::ResetCause reset_cause() const { return reset_cause_; }

  // Interrupts.
  void serial_interrupt() { serial_.interrupt(); }
  void tick() { milliseconds_ = milliseconds_ + 1; }

 private:
  SerialPort serial_;
  volatile std::uint32_t milliseconds_ = 0;
  std::uint32_t boot_id_ = 0;
  wire::ResetCause reset_cause_ = wire::ResetCause::unknown;
  bool watched_ = false;
};

}  // namespace diastole::stm32
