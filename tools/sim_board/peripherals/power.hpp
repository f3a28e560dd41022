#pragma once
// PWR: the supply's voltage detector (RM0090 5.2.3; thresholds typical, datasheet table 19; between the falling and the rising one it
// stays what it was, above when it is switched on). The regulator is always ready.

#include <cstdint>
#include <optional>

#include "tools/sim_board/core/device.hpp"

namespace diastole::board_model {

class Power final : public RegisterBlock {
 public:
  std::optional<uint32_t> read(uint32_t offset) override {
    if (offset != 0x04) return RegisterBlock::read(offset);
    return (csr_ & (1U << 8 | 1U << 9)) | regulator_ready | (below_ ? 1U << 2 : 0);
  }
  void write(uint32_t offset, uint32_t value, uint32_t mask) override {
    RegisterBlock::write(offset, value, mask);
    compare();
  }
  void reset() override {
    cr_ = 0x4000;
    csr_ = 0;
    compare();
  }
  void set_supply_mV(uint32_t supply_mV) {
    supply_mV_ = supply_mV;
    compare();
  }

 private:
  static constexpr uint32_t regulator_ready = 1U << 14;

  uint32_t* word(uint32_t offset) override { return in_order(offset, {&cr_, &csr_}); }
  void compare() {
    constexpr uint32_t falling_mV[] = {2040, 2190, 2350, 2510, 2660, 2840, 2930, 3030};
    constexpr uint32_t rising_mV[] = {2140, 2300, 2450, 2600, 2760, 2930, 3030, 3140};
    below_ = (cr_ >> 4 & 1) != 0 && supply_mV_ < (below_ ? rising_mV : falling_mV)[cr_ >> 5 & 7];
  }

  uint32_t cr_ = 0x4000, csr_ = 0;
  uint32_t supply_mV_ = 3300;
  bool below_ = false;
};

}  // namespace diastole::board_model
