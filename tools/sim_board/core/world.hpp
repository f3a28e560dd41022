#pragma once
// What happens to the board from outside at set times: levels on input pins.

#include <functional>
#include <map>
#include <optional>

#include "tools/sim_board/core/pins.hpp"
#include "tools/sim_board/core/scheduler.hpp"

namespace diastole::board_model {

class World final : public Device {
 public:
  using Drive = std::function<void(Pin, bool level, Cycles at)>;

  World(const Clock& clock, Scheduler& scheduler, Drive drive)
      : clock_(clock), scheduler_(scheduler), slot_(scheduler.add(*this)), drive_(std::move(drive)) {}

  /// Puts `level` on `pin` at `time_ns`, at once when that has passed.
  void plan(uint64_t time_ns, Pin pin, bool level) {
    planned_.emplace(time_ns, Change{pin, level});
    ask();
  }

  std::optional<uint32_t> read(uint32_t) override { return {}; }
  void write(uint32_t, uint32_t, uint32_t) override {}
  void reset() override { ask(); }
  void after_clock_change() override { ask(); }
  void on_event(Cycles at) override {
    while (!planned_.empty() && clock_.cycle_at(planned_.begin()->first) <= at) {
      const Change change = planned_.extract(planned_.begin()).mapped();
      drive_(change.pin, change.level, at);
    }
    ask();
  }

 private:
  struct Change {
    Pin pin;
    bool level = false;
  };

  void ask() {
    const Cycles due = planned_.empty() ? never : clock_.cycle_at(planned_.begin()->first);
    scheduler_.set(slot_, due == never ? never : std::max(due, clock_.now()));
  }

  const Clock& clock_;
  Scheduler& scheduler_;
  Scheduler::Slot slot_;
  Drive drive_;
  std::multimap<uint64_t, Change> planned_;
};

}  // namespace diastole::board_model
