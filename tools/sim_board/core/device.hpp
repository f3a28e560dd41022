#pragma once
// What every peripheral of the board is to the rest of the model.

#include <cstdint>

#include "tools/sim_board/core/clock.hpp"

namespace diastole::board_model {

/// A block of 32-bit registers with a life of its own in virtual time.
class Device {
 public:
  Device() = default;
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;
  virtual ~Device() = default;

  /// Register at `offset` (a multiple of 4), with the side effects of reading it.
  virtual uint32_t read(uint32_t offset) = 0;

  /// Writes the bits of `mask` (0xff.. for narrower accesses, shifted into place) of the register at
  /// `offset`.
  virtual void write(uint32_t offset, uint32_t value, uint32_t mask) = 0;

  /// The state after a reset of the block (system reset or its bit in RCC_xxxRSTR).
  virtual void reset() = 0;

  /// Called at the time the device asked the scheduler for; it must ask again.
  virtual void on_event(Cycles) {}

  /// The clock tree changes now: settle what was counted at the old rate, then ask anew at the new one.
  virtual void before_clock_change() {}
  virtual void after_clock_change() {}
};

/// `old` with the bits of `mask` replaced by those of `value`.
constexpr uint32_t merged(uint32_t old, uint32_t value, uint32_t mask) {
  return (old & ~mask) | (value & mask);
}

}  // namespace diastole::board_model
