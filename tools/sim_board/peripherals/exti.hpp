#pragma once
// EXTI and SYSCFG: which port feeds each line, edges, masks, pending bits, and their interrupts
// (RM0090, 9.2.6 and 12.3).

#include <array>
#include <cstdint>
#include <functional>

#include "tools/sim_board/core/device.hpp"
#include "tools/sim_board/core/nvic.hpp"
#include "tools/sim_board/core/pins.hpp"

namespace diastole::board_model {

/// SYSCFG: only the port selection of the EXTI lines has an effect.
class Syscfg final : public Device {
 public:
  uint32_t read(uint32_t offset) override {
    return offset / 4 < registers_.size() ? registers_[offset / 4] : 0;
  }
  void write(uint32_t offset, uint32_t value, uint32_t mask) override {
    if (offset / 4 >= registers_.size()) return;
    uint32_t& held = registers_[offset / 4];
    held = merged(held, value, mask);
  }
  void reset() override { registers_.fill(0); }

  [[nodiscard]] uint32_t port_of_line(uint32_t line) const {
    return registers_[2 + line / 4] >> (4 * (line % 4)) & 0xf;
  }

 private:
  std::array<uint32_t, 9> registers_{};
};

class Exti final : public RegisterBlock {
 public:
  Exti(const Syscfg& syscfg, PinLog& log, Nvic& nvic);

  void write(uint32_t offset, uint32_t value, uint32_t mask) override;
  void reset() override;

 private:
  uint32_t* word(uint32_t offset) override;
  void edge(Pin pin, bool level);
  void set_lines();

  const Syscfg& syscfg_;
  Nvic& nvic_;
  uint32_t imr_ = 0, emr_ = 0, rtsr_ = 0, ftsr_ = 0, swier_ = 0, pr_ = 0;
};

}  // namespace diastole::board_model
