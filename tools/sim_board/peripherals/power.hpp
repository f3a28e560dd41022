#pragma once
// PWR: the supply's voltage detector (RM0090 5.2.2; falling thresholds typical, datasheet table 19). The regulator is
// always ready.

#include <cstdint>
#include <optional>

#include "tools/sim_board/core/device.hpp"

namespace diastole::board_model {

class Power final : public RegisterBlock {
 public:
  std::optional<uint32_t> read(uint32_t offset) override {
    if (offset != 0x04) return RegisterBlock::read(offset);
    return (csr_ & (1U << 8 | 1U << 9)) | regulator_ready | (below() ? 1U << 2 : 0);
  }
  void reset() override {
    cr_ = 0x4000;
    csr_ = 0;
  }
  void set_supply_mV(uint32_t supply_mV) { supply_mV_ = supply_mV; }

 private:
  static constexpr uint32_t regulator_ready = 1U << 14;

  uint32_t* word(uint32_t offset) override { return in_order(offset, {&cr_, &csr_}); }
  [[nodiscard]] bool below() const {
    constexpr uint32_t falling_mV[] = {2040, 2190, 2350, 2510, 2660, 2840, 2930, 3030};
    return (cr_ >> 4 & 1) != 0 && supply_mV_ < falling_mV[cr_ >> 5 & 7];
  }

  uint32_t cr_ = 0x4000, csr_ = 0;
  uint32_t supply_mV_ = 3300;
};

}  // namespace diastole::board_model
