#pragma once
// The piston between the controller's step edges and the hose: what each step displaces arrives through the
// motor's magnetic spring and the screw as a critically damped second-order lag of a few milliseconds, so
// that a step is a soft push and not a hammer blow.

#include <algorithm>
#include <deque>
#include <numbers>

#include "tools/sim_rig/plant/second_order.hpp"

namespace diastole::sim_rig {

class Piston {
 public:
  /// `lag_ms` is the time constant of each of the two equal poles; `step_s` the plant's time step.
  Piston(double lag_ms, double step_s)
      : step_s_(step_s), rotor_(1000 / (2 * std::numbers::pi * lag_ms), 1.0, step_s) {}

  /// The controller has displaced `volume_mL` in all since `time_s`. Times do not decrease and are not before
  /// the piston's present.
  void displace(double time_s, double volume_mL) { coming_.push_back({time_s, volume_mL}); }

  /// One step on; afterwards flow_mL_s() is the flow at the step's end. The trapezoidal sum of the flow is
  /// exactly the volume displaced, one step late.
  void advance() {
    const double end_s = static_cast<double>(++step_count_) * step_s_;
    double mean_mL = issued_mL_;
    while (!coming_.empty() && coming_.front().time_s <= end_s) {
      const Edge edge = coming_.front();
      coming_.pop_front();
      mean_mL += (edge.volume_mL - issued_mL_) * std::min(1.0, (end_s - edge.time_s) / step_s_);
      issued_mL_ = edge.volume_mL;
    }
    rotor_.advance(mean_mL);
    flow_mL_s_ = (rotor_.value() - displaced_before_mL_) / (2 * step_s_);
    displaced_before_mL_ = displaced_mL_;
    displaced_mL_ = rotor_.value();
  }

  [[nodiscard]] double flow_mL_s() const { return flow_mL_s_; }

 private:
  struct Edge {
    double time_s;
    double volume_mL;
  };

  double step_s_;
  long step_count_ = 0;
  std::deque<Edge> coming_;
  double issued_mL_ = 0;
  SecondOrder rotor_;
  double displaced_mL_ = 0;         // by the rotor, at the last step
  double displaced_before_mL_ = 0;  // and at the one before
  double flow_mL_s_ = 0;
};

}  // namespace diastole::sim_rig
