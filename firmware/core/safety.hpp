#pragma once
// The safety state machine (drawn in protocol/wire/states.hpp): which state follows which, what is latched,
// and whether the position is still known. Anything not listed here cannot happen.

#include "protocol/wire/faults.hpp"
#include "protocol/wire/states.hpp"

namespace diastole::firmware {

/// True if `to` may follow `from`. Every state may become faulted.
constexpr bool may_follow(wire::State from, wire::State to) {
  using enum wire::State;
  switch (to) {
    case unhomed:
      return from == faulted || from == homed || from == armed || from == homing || from == jogging;
    case homing:
      return from == unhomed || from == homed || from == armed;
    case homed:
      return from == homing || from == armed || from == running || from == stopping || from == faulted ||
             from == jogging;
    case armed:
      return from == homed;
    case running:
      return from == armed;
    case stopping:
      return from == running;
    case jogging:
      return from == unhomed || from == homed;
    case faulted:
      return from != faulted;
  }
  return false;
}

/// Faults after which the motor is where the step count says: it came to rest under control.
constexpr bool keeps_position(wire::Fault fault) {
  return fault == wire::Fault::lease_lost || fault == wire::Fault::event_overflow;
}

class Safety {
 public:
  [[nodiscard]] wire::State state() const { return state_; }
  [[nodiscard]] wire::Fault fault() const { return fault_; }
  /// At rest and not faulted.
  [[nodiscard]] bool at_rest() const {
    return state_ == wire::State::unhomed || state_ == wire::State::homed || state_ == wire::State::armed;
  }
  [[nodiscard]] bool in_run() const {
    return state_ == wire::State::running || state_ == wire::State::stopping;
  }

  [[nodiscard]] bool position_known() const { return position_known_; }

  /// Changes the state if that is allowed; false leaves it.
  bool become(wire::State to) {
    if (!may_follow(state_, to)) return false;
    if (to == wire::State::homing || to == wire::State::unhomed) position_known_ = false;
    if (to == wire::State::homed && state_ == wire::State::homing) position_known_ = true;
    state_ = to;
    return true;
  }
  /// Latches the first fault; later ones do not replace it. False if one was latched before.
  bool latch(wire::Fault fault) {
    if (!keeps_position(fault)) position_known_ = false;
    if (!become(wire::State::faulted)) return false;
    fault_ = fault;
    return true;
  }
  /// The motor was without current: nobody knows where it is.
  void forget_position() { position_known_ = false; }
  /// Leaves faulted: homed if the position is still known, else unhomed. False if nothing is latched.
  bool clear() {
    if (state_ != wire::State::faulted) return false;
    fault_ = wire::Fault::none;
    return become(position_known_ ? wire::State::homed : wire::State::unhomed);
  }

 private:
  wire::State state_ = wire::State::unhomed;
  wire::Fault fault_ = wire::Fault::none;
  bool position_known_ = false;
};

}  // namespace diastole::firmware
