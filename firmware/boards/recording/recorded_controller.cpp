#include "firmware/boards/recording/recorded_controller.hpp"

#include <algorithm>

namespace diastole::firmware {

void RecordedController::advance_to(Ticks tick) {
  while (true) {
    const std::optional<Ticks> event = board_.next_event();
    const Ticks next = event ? std::min(*event, next_turn_) : next_turn_;
    if (next > tick) break;
    bool inputs_changed = false;
    const bool matched = board_.run_to(next, inputs_changed);
    if (inputs_changed) controller_.on_inputs();
    if (matched) controller_.on_match();
    if (next_turn_ <= next) {
      controller_.poll();
      next_turn_ = next + turn_;
    }
  }
  bool inputs_changed = false;
  if (tick > board_.now()) board_.run_to(tick, inputs_changed);
}

void RecordedController::set_estop(bool pressed) {
  board_.set_estop(pressed);
  controller_.on_inputs();
}

void RecordedController::set_far_limit(bool closed) {
  board_.set_far_limit(closed);
  controller_.on_inputs();
}

void RecordedController::set_home(bool closed) {
  board_.set_home(closed);
  controller_.on_inputs();
}

}  // namespace diastole::firmware
