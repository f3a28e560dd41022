#pragma once
// The piston's carriage on its screw: counts the microsteps, closes the home switch, and tells the volume
// that the line has received.
//
//      home switch closed <= | 0 ... parked ... | far end          position in microsteps
//
// At power-on the carriage is parked clear of the switch and the operator's stopcock vents the line; the line
// is closed when the carriage leaves the switch at the end of homing, so that home is the unloaded specimen.

#include <cstdint>
#include <optional>

#include "tools/sim_rig/simulated_controller.hpp"

namespace diastole::sim_rig {

class Carriage {
 public:
  explicit Carriage(double microstep_mL, int64_t parked_microsteps = 200)
      : microstep_mL_(microstep_mL), position_(parked_microsteps) {}

  /// Takes a pin change; returns the volume displaced into the line if this one moved it.
  std::optional<double> take(const PinEdge& edge);

  [[nodiscard]] bool home_switch_closed() const { return position_ <= 0; }
  [[nodiscard]] int64_t position_microsteps() const { return position_; }

 private:
  double microstep_mL_;
  int64_t position_;
  bool inflate_ = false;
  bool was_on_switch_ = false;
  bool vented_ = true;
};

}  // namespace diastole::sim_rig
