#pragma once
// What the controller reports by itself: events in order, and the last status brought forward by them.

#include <utility>
#include <vector>

#include "host/controller/controller.hpp"

namespace diastole {

class TelemetryIntake {
 public:
  void take(ControllerEvent event) {
    // A status is ahead of the events that waited for the line when it was asked for.
    const auto is_news = [&](uint64_t tick) { return tick > last_known_.tick; };
    std::visit(
        wire::overloaded{
            [&](const wire::StateChanged& change) { last_known_.state = change.to; },
            [&](const wire::FaultRaised& raised) { last_known_.fault = raised.fault; },
            [&](const wire::SegmentStarted& started) { last_known_.segment = started.segment; },
            [&](const wire::Trigger& trigger) {
              if (!is_news(trigger.tick)) return;
              last_known_.triggers += trigger.seen;
              last_known_.r_waves += trigger.r_wave;
              last_known_.cycle = trigger.cycle + 1;
            },
            [&](const wire::PositionBatch& batch) {
              if (batch.count > 0 &&
                  is_news(batch.first_tick + uint64_t{batch.period_ticks} * (batch.count - 1U)))
                last_known_.position_microsteps = batch.position_microsteps[batch.count - 1U];
            },
            [&](const wire::RunEnded& ended) { last_known_.position_microsteps = ended.position_microsteps; },
            [](const auto&) {}},
        event);
    events_.push_back(std::move(event));
  }
  void take(const wire::Status& status) { last_known_ = status; }
  /// Those since the last call.
  std::vector<ControllerEvent> take_events() { return std::exchange(events_, {}); }
  [[nodiscard]] const wire::Status& last_known() const { return last_known_; }

 private:
  wire::Status last_known_;
  std::vector<ControllerEvent> events_;
};

}  // namespace diastole
