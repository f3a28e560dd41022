#include "tools/sim_board/peripherals/systick.hpp"

namespace diastole::board_model {

SysTick::SysTick(const Clock& clock, Scheduler& scheduler, Nvic& nvic)
    : clock_(clock), scheduler_(scheduler), nvic_(nvic), slot_(scheduler.add(*this)) {}

void SysTick::reset() {
  control_ = reload_ = 0;
  counted_ = false;
  zero_at_ = never;
  ask();
}

/// Without its interrupt nobody calls at zero: catch up when looked at.
void SysTick::settle() {
  if (!counting() || zero_at_ > clock_.now()) return;
  const Cycles turn = (uint64_t{reload_} + 1) * cycles_per_count();
  zero_at_ += ((clock_.now() - zero_at_) / turn + 1) * turn;
  counted_ = true;
}

uint32_t SysTick::read(uint32_t offset) {
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

void SysTick::write(uint32_t offset, uint32_t value, uint32_t mask) {
  settle();
  const Cycles turn = (uint64_t{reload_} + 1);
  switch (offset) {
    case 0x10: {
      const bool ran = counting();
      control_ = merged(control_, value, mask) & 7;
      if (counting() && !ran) zero_at_ = clock_.now() + turn * cycles_per_count();
      break;
    }
    case 0x14: {
      const bool ran = counting();
      reload_ = merged(reload_, value, mask) & 0x00ff'ffff;
      if (counting() && !ran) zero_at_ = clock_.now() + (uint64_t{reload_} + 1) * cycles_per_count();
      break;
    }
    case 0x18:
      counted_ = false;
      if (counting()) zero_at_ = clock_.now() + turn * cycles_per_count();
      break;
    default:
      break;
  }
  ask();
}

void SysTick::on_event(Cycles at) {
  counted_ = true;
  zero_at_ = at + (uint64_t{reload_} + 1) * cycles_per_count();
  nvic_.set_pending(exception::sys_tick);
  ask();
}

void SysTick::ask() { scheduler_.set(slot_, counting() && (control_ & 2) != 0 ? zero_at_ : never); }

}  // namespace diastole::board_model
