#pragma once
// IWDG: the independent watchdog on the 32 kHz internal oscillator (RM0090, 21). Once started only a reset
// stops it; it counts whatever the core's clock does.

#include <functional>

#include "tools/sim_board/core/scheduler.hpp"

namespace diastole::board_model {

class Watchdog final : public Device {
 public:
  Watchdog(const Clock& clock, Scheduler& scheduler);

  uint32_t read(uint32_t offset) override;
  void write(uint32_t offset, uint32_t value, uint32_t mask) override;
  void reset() override;
  void on_event(Cycles at) override;
  void after_clock_change() override { ask(); }

  void on_bite(std::function<void()> bite) { bite_ = std::move(bite); }

 private:
  void reload();
  void ask();

  const Clock& clock_;
  Scheduler& scheduler_;
  Scheduler::Slot slot_;
  std::function<void()> bite_;
  uint32_t prescaler_ = 0, reload_ = 0xfff;
  bool unlocked_ = false, running_ = false;
  uint64_t bites_at_ns_ = 0;
};

}  // namespace diastole::board_model
