#include "tools/sim_board/peripherals/exti.hpp"

namespace diastole::board_model {
namespace {

struct Line {
  uint32_t bits, irq;
};
constexpr Line lines[] = {{1 << 0, 6},  {1 << 1, 7},  {1 << 2, 8}, {1 << 3, 9},
                          {1 << 4, 10}, {0x03e0, 23}, {0xfc00, 40}};

}  // namespace

Exti::Exti(const Syscfg& syscfg, PinLog& log, Nvic& nvic) : syscfg_(syscfg), nvic_(nvic) {
  log.on_change([this](Pin pin, bool level, Cycles) { edge(pin, level); });
}

void Exti::reset() {
  imr_ = emr_ = rtsr_ = ftsr_ = swier_ = pr_ = 0;
  set_lines();
}

void Exti::edge(Pin pin, bool level) {
  const uint32_t bit = 1U << pin.number;
  if (((level ? rtsr_ : ftsr_) & bit) == 0 || syscfg_.port_of_line(pin.number) != pin.port) return;
  pr_ |= bit;
  set_lines();
}

uint32_t* Exti::word(uint32_t offset) {
  return in_order(offset, {&imr_, &emr_, &rtsr_, &ftsr_, &swier_, &pr_});
}

void Exti::write(uint32_t offset, uint32_t value, uint32_t mask) {
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

void Exti::set_lines() {
  for (const Line& line : lines)
    nvic_.set_line(line.irq, (pr_ & imr_ & line.bits) != 0);
}

}  // namespace diastole::board_model
