#pragma once
// SysTick: the core's 24-bit down-counter (ARMv7-M ARM, B3.3). The reference clock is the core's over 8.

#include "tools/sim_board/core/nvic.hpp"
#include "tools/sim_board/core/scheduler.hpp"

namespace diastole::board_model {

class SysTick final : public Device {
 public:
  SysTick(const Clock& clock, Scheduler& scheduler, Nvic& nvic)
      : clock_(clock), scheduler_(scheduler), nvic_(nvic), slot_(scheduler.add(*this)) {}

  /// Offsets 0x10 ... 0x1c, as in the system control space.
  uint32_t read(uint32_t offset) override {
    settle();
    switch (offset) {
      case 0x10: {
        const uint32_t value = control_ | (counted_ ? 1U << 16 : 0);
        counted_ = false;
        return value;
      }
      case 0x14:
        return reload_;
      case 0x18:
        return counting() ? static_cast<uint32_t>((zero_at_ - clock_.now()) / cycles_per_count()) : 0;
      default:
        return 0;
    }
  }
  void write(uint32_t offset, uint32_t value, uint32_t mask) override {
    settle();
    const bool ran = counting();
    if (offset == 0x10) control_ = merged(control_, value, mask) & 7;
    if (offset == 0x14) reload_ = merged(reload_, value, mask) & 0x00ff'ffff;
    if (offset == 0x18) counted_ = false;
    if (counting() && (!ran || offset == 0x18)) zero_at_ = clock_.now() + turn();
    ask();
  }
  void reset() override {
    control_ = reload_ = 0;
    counted_ = false;
    zero_at_ = never;
    ask();
  }
  void on_event(Cycles at) override {
    counted_ = true;
    zero_at_ = at + turn();
    nvic_.set_pending(exception::sys_tick);
    ask();
  }

 private:
  [[nodiscard]] Cycles cycles_per_count() const { return (control_ & 4) != 0 ? 1 : 8; }
  /// From one zero to the next.
  [[nodiscard]] Cycles turn() const { return (uint64_t{reload_} + 1) * cycles_per_count(); }
  [[nodiscard]] bool counting() const { return (control_ & 1) != 0 && reload_ != 0; }
  /// Without its interrupt nobody calls at zero: catch up when looked at.
  void settle() {
    if (!counting() || zero_at_ > clock_.now()) return;
    zero_at_ += ((clock_.now() - zero_at_) / turn() + 1) * turn();
    counted_ = true;
  }
  void ask() { scheduler_.set(slot_, counting() && (control_ & 2) != 0 ? zero_at_ : never); }

  const Clock& clock_;
  Scheduler& scheduler_;
  Nvic& nvic_;
  Scheduler::Slot slot_;
  uint32_t control_ = 0, reload_ = 0;
  bool counted_ = false;
  Cycles zero_at_ = never;  ///< when the counter next reaches zero
};

}  // namespace diastole::board_model
