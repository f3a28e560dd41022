#pragma once
// Between the controller's steps and the piston: a motor that stalls and loses steps, and a coupling on the screw that
// slips under load. The controller counts all of them.

#include <optional>

namespace diastole::sim_rig {

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

}  // namespace diastole::sim_rig
