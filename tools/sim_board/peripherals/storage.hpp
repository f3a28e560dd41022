#pragma once
// Register blocks that a program writes and reads back and that do nothing else here: PWR (its voltage is
// always ready), RTC backup registers, DBGMCU; and the random number generator.

#include <array>
#include <cstdint>
#include <optional>
#include <utility>

#include "tools/sim_board/core/device.hpp"

namespace diastole::board_model {

class Storage final : public RegisterBlock {
 public:
  /// `always_set` bits of the register at `status_offset` read 1; with `kept`, contents survive system
  /// resets.
  explicit Storage(uint32_t status_offset = 0, uint32_t always_set = 0, bool kept = false)
      : status_offset_(status_offset), always_set_(always_set), kept_(kept) {}

  std::optional<uint32_t> read(uint32_t offset) override {
    const std::optional<uint32_t> held = RegisterBlock::read(offset);
    return held && offset == status_offset_ ? *held | always_set_ : held;
  }
  void reset() override {
    if (!kept_) registers_.fill(0);
  }

 private:
  uint32_t* word(uint32_t offset) override { return in_order(offset, registers_); }

  uint32_t status_offset_, always_set_;
  bool kept_;
  std::array<uint32_t, 256> registers_{};
};

/// RNG: always ready, the same numbers in every run that starts from the same seed; resets do not rewind it. The first number
/// after RNGEN, which is not to be used (RM0090 24.3.1), is the same on every chip.
class RandomNumbers final : public Device {
 public:
  explicit RandomNumbers(uint32_t seed) : state_(seed != 0 ? seed : 1) {}

  std::optional<uint32_t> read(uint32_t offset) override {
    if (offset == 0x00) return control_;
    if (offset == 0x04) return (control_ & 4) != 0 ? 1U : 0U;
    if (offset != 0x08) return {};
    if (std::exchange(first_, false)) return 0x5555'5555U;
    state_ ^= state_ << 13;
    state_ ^= state_ >> 17;
    state_ ^= state_ << 5;
    return state_;
  }
  void write(uint32_t offset, uint32_t value, uint32_t mask) override {
    if (offset != 0x00) return;
    const bool was_enabled = (control_ & 4) != 0;
    control_ = merged(control_, value, mask);
    if (!was_enabled && (control_ & 4) != 0) first_ = true;
  }
  void reset() override { control_ = 0; }

 private:
  uint32_t state_;
  uint32_t control_ = 0;
  bool first_ = false;
};

}  // namespace diastole::board_model
