#pragma once
// What every peripheral of the board is to the rest of the model.

#include <cstdint>
#include <initializer_list>
#include <optional>
#include <span>

#include "tools/sim_board/core/clock.hpp"

namespace diastole::board_model {

/// A block of 32-bit registers with a life of its own in virtual time.
class Device {
 public:
  Device() = default;
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;
  virtual ~Device() = default;

  /// Register at `offset` (a multiple of 4), with the side effects of reading it; none: it is not modelled.
  virtual std::optional<uint32_t> read(uint32_t offset) = 0;

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

/// A device whose registers mostly read back what was written; what has side effects overrides read() or write() and
/// leaves the rest to these.
class RegisterBlock : public Device {
 public:
  std::optional<uint32_t> read(uint32_t offset) override {
    const uint32_t* held = word(offset);
    return held != nullptr ? std::optional(*held) : std::nullopt;
  }
  void write(uint32_t offset, uint32_t value, uint32_t mask) override {
    if (uint32_t* held = word(offset)) *held = merged(*held, value, mask);
  }

 protected:
  /// Where the register at `offset` is kept; null: it is not modelled as such, and writing it has no effect.
  virtual uint32_t* word(uint32_t offset) = 0;

  /// The word at `offset` among `words`, which lie one after the other; null for a gap, or beyond the last.
  static uint32_t* in_order(uint32_t offset, std::initializer_list<uint32_t*> words) {
    return offset / 4 < words.size() ? words.begin()[offset / 4] : nullptr;
  }
  static uint32_t* in_order(uint32_t offset, std::span<uint32_t> words) {
    return offset / 4 < words.size() ? &words[offset / 4] : nullptr;
  }
};

}  // namespace diastole::board_model
