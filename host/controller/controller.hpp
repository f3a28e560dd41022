#pragma once
// The controller as the acquisition sees it: load a program, start, stop, and a stream of what happened.
// ControllerClient talks to the real one over a ByteLine; tests have a scripted one.
//
// Nothing here waits for an answer while a run is on: start and stop are sent, and what became of them comes
// back as events.

#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "host/transport/byte_line.hpp"
#include "protocol/wire/messages.hpp"

namespace diastole {

/// Controller tick and host time of one moment (clock_map.hpp).
struct ClockReading {
  uint64_t host_ns = 0;
  uint64_t tick = 0;
  uint64_t half_round_trip_ns = 0;
};

/// The line broke, the controller was reset, or it answers no more.
struct LinkBroken {
  std::string reason;
};

using ControllerEvent =
    std::variant<wire::StateChanged, wire::RunStarted, wire::SegmentStarted, wire::Trigger,
                 wire::PositionBatch, wire::RunEnded, wire::FaultRaised, wire::Nak, ClockReading, LinkBroken>;

class Controller {
 public:
  virtual ~Controller() = default;

  /// Takes in what arrived and sends what is due (heart-beat, time question, repetitions).
  virtual void service() = 0;
  /// When service() has something to send next.
  [[nodiscard]] virtual uint64_t next_due_ns() const = 0;
  /// What happened since the last call, in order.
  virtual std::vector<ControllerEvent> take_events() = 0;

  virtual void start() = 0;
  virtual void stop_at_cycle_end() = 0;
  virtual void stop_now() = 0;
  /// Cuts the motion off at once; leaves the fault `halted`, and the position is lost.
  virtual void halt() = 0;

  /// For sleeping on input; null while there is none.
  virtual ByteLine* line() = 0;
};

}  // namespace diastole
