#pragma once
// EXTI and SYSCFG: which port feeds each line, edges, masks, pending bits, and their interrupts
// (RM0090, 9.2.6 and 12.3).

#include <array>
#include <cstdint>

#include "tools/sim_board/core/device.hpp"
#include "tools/sim_board/core/nvic.hpp"
#include "tools/sim_board/core/pins.hpp"

namespace diastole::board_model {

/// SYSCFG: only the port selection of the EXTI lines has an effect.
class Syscfg final : public RegisterBlock {
 public:
  void reset() override { registers_.fill(0); }

  [[nodiscard]] uint32_t port_of_line(uint32_t line) const {
    return registers_[2 + line / 4] >> (4 * (line % 4)) & 0xf;
  }

 private:
  uint32_t* word(uint32_t offset) override { return in_order(offset, registers_); }

  std::array<uint32_t, 9> registers_{};
};

class Exti final : public RegisterBlock {
 public:
  Exti(const Syscfg& syscfg, PinLog& log, Nvic& nvic) : syscfg_(syscfg), nvic_(nvic) {
    log.on_change([this](Pin pin, bool level, Cycles) { edge(pin, level); });
  }

  void write(uint32_t offset, uint32_t value, uint32_t mask) override {
    const uint32_t bits = value & mask;
    if (offset == 0x10) {
      swier_ |= bits;
      pr_ |= bits & imr_;
    } else if (offset == 0x14) {
      pr_ &= ~bits;
      swier_ &= ~bits;
    } else {
      RegisterBlock::write(offset, value, mask);
    }
    set_lines();
  }
  void reset() override {
    imr_ = emr_ = rtsr_ = ftsr_ = swier_ = pr_ = 0;
    set_lines();
  }

 private:
  struct Line {
    uint32_t bits, irq;
  };
  static constexpr Line lines[] = {{1 << 0, 6},  {1 << 1, 7},  {1 << 2, 8}, {1 << 3, 9},
                                   {1 << 4, 10}, {0x03e0, 23}, {0xfc00, 40}};

  uint32_t* word(uint32_t offset) override {
    return in_order(offset, {&imr_, &emr_, &rtsr_, &ftsr_, &swier_, &pr_});
  }
  void edge(Pin pin, bool level) {
    const uint32_t bit = 1U << pin.number;
    if (((level ? rtsr_ : ftsr_) & bit) == 0 || syscfg_.port_of_line(pin.number) != pin.port) return;
    pr_ |= bit;
    set_lines();
  }
  void set_lines() {
    for (const Line& line : lines)
      nvic_.set_line(line.irq, (pr_ & imr_ & line.bits) != 0);
  }

  const Syscfg& syscfg_;
  Nvic& nvic_;
  uint32_t imr_ = 0, emr_ = 0, rtsr_ = 0, ftsr_ = 0, swier_ = 0, pr_ = 0;
};

}  // namespace diastole::board_model
