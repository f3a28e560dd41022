#pragma once
// The piston's carriage on its screw: counts the microsteps and returns the volume that the line has received.
//
//      home switch | 0 ... home ... parked ... | far end          position in microsteps from the switch
//
// At power-on the carriage is parked and the operator's stopcock vents the line; it is closed when homing
// ends, so that home is the unloaded specimen.

#include <cstdint>
#include <optional>

#include "tools/sim_controller/simulated_controller.hpp"

namespace diastole::sim_rig {

/// Between the controller's steps and the piston: a motor that stalls and loses steps, and a coupling on the screw that
/// slips under load. The controller counts all of them.
class Slip {
 public:
  /// A share of all steps is lost, evenly: every second one for 0.5, all for 1. 0: none.
  void lose(double share) { lost_share_ = share; }
  /// Inflating steps are lost while the pressure at the piston is above this; none: the coupling holds.
  void slip_above(std::optional<double> pressure_kPa) { grip_kPa_ = pressure_kPa; }

  /// Whether the piston follows one more step.
  [[nodiscard]] bool follows(bool inflating, double piston_kPa) {
    if (grip_kPa_ && inflating && piston_kPa > *grip_kPa_) return false;
    owed_ += lost_share_;
    if (owed_ < 1) return true;
    owed_ -= 1;
    return false;
  }

 private:
  double lost_share_ = 0;
  double owed_ = 0;
  std::optional<double> grip_kPa_;
};

class Carriage {
 public:
  Carriage(double microstep_mL, sim_controller::SimulatedController::Places places)
      : microstep_mL_(microstep_mL),
        home_(places.home),
        position_(places.parked),
        was_on_switch_(places.parked <= 0) {}

  /// Takes a pin change; returns the volume displaced into the line since home if this one moved it.
  /// `piston_kPa` is the load on it, under which a coupling may slip.
  std::optional<double> take(const sim_controller::PinEdge& edge, double piston_kPa) {
    if (edge.pin == sim_controller::Pin::dir) inflate_ = edge.value != 0;
    if (edge.pin != sim_controller::Pin::step || edge.value == 0) return std::nullopt;
    if (!slip_.follows(inflate_, piston_kPa)) return std::nullopt;
    position_ += inflate_ ? 1 : -1;
    was_on_switch_ = was_on_switch_ || position_ <= 0;
    if (was_on_switch_ && position_ >= home_) vented_ = false;
    if (vented_) return std::nullopt;
    return static_cast<double>(position_ - home_) * microstep_mL_;
  }

  /// What lies between the controller's steps and the piston.
  [[nodiscard]] Slip& slip() { return slip_; }

 private:
  double microstep_mL_;
  int64_t home_;
  int64_t position_;
  bool was_on_switch_;
  bool inflate_ = false;
  bool vented_ = true;
  Slip slip_;
};

}  // namespace diastole::sim_rig
