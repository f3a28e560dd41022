#include "tools/sim_rig/plant/piston.hpp"

#include <algorithm>
#include <numbers>

namespace diastole::sim_rig {

Piston::Piston(double lag_ms, double step_s)
    : step_s_(step_s), rotor_(1000 / (2 * std::numbers::pi * lag_ms), 1.0, step_s) {}

void Piston::displace(double time_s, double volume_mL) { coming_.push_back({time_s, volume_mL}); }

void Piston::advance() {
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

}  // namespace diastole::sim_rig
