#pragma once
// IWDG: the independent watchdog on the 32 kHz internal oscillator (RM0090, 21). Once started only a reset
// stops it; it counts whatever the core's clock does.

#include <algorithm>
#include <functional>
#include <optional>

#include "tools/sim_board/core/scheduler.hpp"

namespace diastole::board_model {

class Watchdog final : public RegisterBlock {
 public:
  Watchdog(const Clock& clock, Scheduler& scheduler)
      : clock_(clock), scheduler_(scheduler), slot_(scheduler.add(*this)) {}

  /// Updates of prescaler and reload are immediate: SR stays 0.
  std::optional<uint32_t> read(uint32_t offset) override {
    return offset == 0x0c ? 0U : RegisterBlock::read(offset);
  }
  void write(uint32_t offset, uint32_t value, uint32_t mask) override {
    const uint32_t bits = value & mask;
    if (offset == 0x00) {
      unlocked_ = bits == key_unlock;
      if (bits == key_start) running_ = true;
      if (bits == key_start || bits == key_reload) reload();
    } else if (unlocked_) {
      if (offset == 0x04) prescaler_ = bits & 7;
      if (offset == 0x08) reload_ = bits & 0xfff;
    }
  }
  void reset() override {
    prescaler_ = 0;
    reload_ = 0xfff;
    unlocked_ = running_ = false;
    ask();
  }
  void on_event(Cycles) override {
    running_ = false;
    if (bite_) bite_();
  }
  void after_clock_change() override { ask(); }

  /// Stands still while `held`: the core is stopped by a debugger and DBGMCU_APB1_FZ says so (RM0090 38.16.4).
  void hold(bool held) {
    if (held == held_) return;
    const uint64_t now_ns = clock_.ns(clock_.now());
    held_ = held;
    bites_at_ns_ = held ? bites_at_ns_ - std::min(bites_at_ns_, now_ns) : bites_at_ns_ + now_ns;
    ask();
  }

  void on_bite(std::function<void()> bite) { bite_ = std::move(bite); }

 private:
  static constexpr uint32_t key_reload = 0xaaaa, key_unlock = 0x5555, key_start = 0xcccc;
  static constexpr uint64_t tick_ns = 31'250;  // LSI, typical

  uint32_t* word(uint32_t offset) override { return in_order(offset, {nullptr, &prescaler_, &reload_}); }
  void reload() {
    const uint64_t divider = 4U << std::min(prescaler_, 6U);
    bites_at_ns_ = clock_.ns(clock_.now()) + (uint64_t{reload_} + 1) * divider * tick_ns;
    ask();
  }
  void ask() { scheduler_.set(slot_, running_ && !held_ ? clock_.cycle_at(bites_at_ns_) : never); }

  const Clock& clock_;
  Scheduler& scheduler_;
  Scheduler::Slot slot_;
  std::function<void()> bite_;
  uint32_t prescaler_ = 0, reload_ = 0xfff;
  bool unlocked_ = false, running_ = false, held_ = false;
  uint64_t bites_at_ns_ = 0;  ///< while held: what was left
};

}  // namespace diastole::board_model
