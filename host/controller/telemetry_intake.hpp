#pragma once
// What the controller reports by itself: events in order, and the last status brought forward by them.

#include <utility>
#include <vector>

#include "host/controller/controller.hpp"

namespace diastole {

class TelemetryIntake {
 public:
  void take(ControllerEvent event);
  void take(const wire::Status& status) { last_known_ = status; }
  /// Those since the last call.
  std::vector<ControllerEvent> take_events() { return std::exchange(events_, {}); }
  [[nodiscard]] const wire::Status& last_known() const { return last_known_; }

 private:
  wire::Status last_known_;
  std::vector<ControllerEvent> events_;
};

}  // namespace diastole
