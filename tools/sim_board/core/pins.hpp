#pragma once
// The package's pins: who drives each one, its level, and the log of changes.
//
// A pin's level comes from its port's output register, from a timer channel through the alternate function,
// or from outside (an input). The ports own the choice; timers and the world only deliver levels.

#include <array>
#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

#include "tools/sim_board/core/clock.hpp"

namespace diastole::board_model {

inline constexpr uint32_t port_count = 9;  // A ... I
inline constexpr uint32_t pins_per_port = 16;

/// A pin of the package: PA0 is {0, 0}, PB7 is {1, 7}.
struct Pin {
  uint8_t port = 0, number = 0;
  [[nodiscard]] uint32_t index() const { return port * pins_per_port + number; }
  bool operator==(const Pin&) const = default;
};

/// A change of a pin's level, or of a DAC channel's code (`dac` 1 or 2 and `value` 0...4095).
struct PinEvent {
  Cycles cycle = 0;
  uint64_t time_ns = 0;
  Pin pin;
  uint8_t dac = 0;
  uint16_t value = 0;
};

class PinLog {
 public:
  explicit PinLog(const Clock& clock) : clock_(clock) {}

  /// Sets the level as seen at the pin; a change is logged. False when nothing changed.
  bool set_level(Pin pin, bool level, Cycles at) {
    bool& held = levels_[pin.index()];
    if (held == level) return false;
    held = level;
    events_.push_back({at, clock_.ns(at), pin, 0, static_cast<uint16_t>(level)});
    for (const auto& listener : listeners_)
      listener(pin, level, at);
    return true;
  }
  [[nodiscard]] bool level(Pin pin) const { return levels_[pin.index()]; }

  void log_dac(uint8_t channel, uint16_t code, Cycles at) {
    events_.push_back({at, clock_.ns(at), Pin{}, channel, code});
  }

  /// Called on every change of level (EXTI).
  void on_change(std::function<void(Pin, bool, Cycles)> listener) {
    listeners_.push_back(std::move(listener));
  }

  /// Hands over what was logged since the last call, in order of time.
  std::vector<PinEvent> take() { return std::exchange(events_, {}); }

 private:
  const Clock& clock_;
  std::array<bool, port_count * pins_per_port> levels_{};
  std::vector<PinEvent> events_;
  std::vector<std::function<void(Pin, bool, Cycles)>> listeners_;
};

}  // namespace diastole::board_model
