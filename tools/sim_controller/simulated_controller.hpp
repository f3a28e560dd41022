#pragma once
// The pump's controller as the simulated rig sees it: bytes and a switch in, bytes and pin changes out, in
// its own time. Whatever runs the firmware (built for this machine, or its image in an emulator) stands
// behind this.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace diastole::sim_controller {

enum class Pin : uint8_t { step, dir, enable, ttl, rwave_uV, fault };

/// The name in a pin trace: "STEP", "RWAVE_uV", ...
constexpr std::string_view pin_name(Pin pin) {
  constexpr std::array<std::string_view, 6> names{"STEP", "DIR", "ENABLE", "TTL", "RWAVE_uV", "FAULT"};
  return names[static_cast<std::size_t>(pin)];
}

/// One change of one pin; the time is the board's, from its reset.
struct PinEdge {
  uint64_t time_ns = 0;
  Pin pin = Pin::step;
  int32_t value = 0;
};

/// The switches that it watches.
enum class Switch : uint8_t { estop, home, far_limit };

class SimulatedController {
 public:
  /// What happened while it ran, in order; valid until the next call of advance_to.
  struct Output {
    std::span<const uint8_t> sent;
    std::span<const PinEdge> edges;
  };

  /// Where the carriage stands at power-on and where homing ends, in microsteps from the home switch.
  struct Places {
    int64_t parked = 0;
    int64_t home = 0;
  };

  virtual ~SimulatedController() = default;

  [[nodiscard]] virtual Places places() const = 0;

  /// When its own clock, which its messages report, read 0.
  [[nodiscard]] virtual uint64_t tick_zero_ns() const { return 0; }

  /// Bytes that have arrived on its serial line.
  virtual void receive(std::span<const uint8_t> bytes) = 0;
  /// Runs on to until_ns (not before its present).
  virtual Output advance_to(uint64_t until_ns) = 0;

  /// From now on a switch is held active by hand; or follows the carriage again (the e-stop is released). Without
  /// effect on one that has no such switch.
  virtual void hold_switch(Switch, bool /*active*/) {}
  /// Takes its supply away, or gives it back; the settings in its flash remain. Time passes without supply too.
  virtual void set_power(bool /*on*/) {}
};

}  // namespace diastole::sim_controller
