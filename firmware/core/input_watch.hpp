#pragma once
// What cuts a motion off in hardware time: e-stop and switches, each according to what is moving, and whatever else trips
// it. The interrupt only cuts and remembers; the main loop latches the fault.

#include <atomic>

#include "firmware/core/board.hpp"
#include "firmware/core/safety.hpp"
#include "firmware/core/step_engine.hpp"

namespace diastole::firmware {

/// What the input interrupt has to watch for; the e-stop always.
enum class Watch : std::uint8_t {
  rest,
  run,
  approach_home,
  leave_home,
  inflating,
  withdrawing,
  withdrawing_from_far
};

template <Board B>
class InputWatch {
 public:
  InputWatch(B& board, StepEngine<B>& engine, const Safety& safety)
      : board_(board), engine_(engine), safety_(safety) {}

  void watch(Watch watch) { watch_ = watch; }
  [[nodiscard]] Watch watching() const { return watch_; }

  /// Input interrupt, and once a turn in case that an edge was too short for it. E-stop first.
  void on_inputs() {
    const Inputs inputs = board_.inputs();
    const Watch watch = watch_;
    if (inputs.estop) {
      trip(wire::Fault::estop);
    } else if (watch == Watch::run && inputs.far_limit) {
      trip(wire::Fault::limit_switch);
    } else if (watch == Watch::run && inputs.home) {
      trip(wire::Fault::home_switch);
    } else if ((watch == Watch::approach_home && inputs.home) ||
               (watch == Watch::leave_home && !inputs.home)) {
      engine_.cut();
    } else if ((watch == Watch::leave_home || watch == Watch::inflating || watch == Watch::withdrawing) &&
               inputs.far_limit) {
      trip(wire::Fault::limit_switch);
    } else if ((watch == Watch::withdrawing || watch == Watch::withdrawing_from_far) && inputs.home) {
      trip(wire::Fault::home_switch);
    }
  }

  /// Cuts the motion off at once; the main loop does the rest. Interrupt or main loop.
  void trip(wire::Fault fault) {
    if (tripped_ != wire::Fault::none || safety_.state() == wire::State::faulted) return;
    tripped_ = fault;
    engine_.cut();
    board_.set_motor_enabled(false);
    board_.show_fault(static_cast<std::uint8_t>(fault));
  }
  /// What has cut the motion off and is not latched yet; none: nothing.
  [[nodiscard]] wire::Fault tripped() const { return tripped_; }
  /// It is latched now.
  void forget_trip() { tripped_ = wire::Fault::none; }

 private:
  B& board_;
  StepEngine<B>& engine_;
  const Safety& safety_;
  std::atomic<Watch> watch_{Watch::rest};
  std::atomic<wire::Fault> tripped_{wire::Fault::none};
};

}  // namespace diastole::firmware
