#pragma once
// A clock that tells somebody each time its user goes to sleep: proof that a loop goes on.

#include <functional>
#include <memory>
#include <utility>

#include "host/transport/clock.hpp"

namespace diastole {

class WatchedClock final : public Clock {
 public:
  WatchedClock(std::unique_ptr<Clock> clock, std::function<void()> on_sleep)
      : clock_(std::move(clock)), on_sleep_(std::move(on_sleep)) {}

  [[nodiscard]] uint64_t now_ns() override { return clock_->now_ns(); }
  void sleep_until_ns(uint64_t until_ns, ByteLine* line) override {
    on_sleep_();
    clock_->sleep_until_ns(until_ns, line);
  }
  void line_opened(ByteLine& line) override { clock_->line_opened(line); }
  [[nodiscard]] bool stands_still() const override { return clock_->stands_still(); }

 private:
  std::unique_ptr<Clock> clock_;
  std::function<void()> on_sleep_;
};

}  // namespace diastole
