#pragma once
// SysTick: the core's 24-bit down-counter (ARMv7-M ARM, B3.3). The reference clock is the core's over 8.

#include "tools/sim_board/core/nvic.hpp"
#include "tools/sim_board/core/scheduler.hpp"

namespace diastole::board_model {

class SysTick final : public Device {
 public:
  SysTick(const Clock& clock, Scheduler& scheduler, Nvic& nvic);

  uint32_t read(uint32_t offset) override;  ///< 0x10 ... 0x1c, as in the system control space
  void write(uint32_t offset, uint32_t value, uint32_t mask) override;
  void reset() override;
  void on_event(Cycles at) override;

 private:
  [[nodiscard]] Cycles cycles_per_count() const { return (control_ & 4) != 0 ? 1 : 8; }
  [[nodiscard]] bool counting() const { return (control_ & 1) != 0 && reload_ != 0; }
  void settle();
  void ask();

  const Clock& clock_;
  Scheduler& scheduler_;
  Nvic& nvic_;
  Scheduler::Slot slot_;
  uint32_t control_ = 0, reload_ = 0;
  bool counted_ = false;
  Cycles zero_at_ = never;  ///< when the counter next reaches zero
};

}  // namespace diastole::board_model
