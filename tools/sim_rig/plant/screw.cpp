#include "tools/sim_rig/plant/screw.hpp"

#include <algorithm>
#include <cmath>

namespace diastole::sim_rig {

double Screw::stalled(double volume_mL) {
  const double change = volume_mL - before_mL_;
  before_mL_ = volume_mL;
  if (flaws_.missed_in_cycle > 0 && cycle_ >= flaws_.missed_in_cycle && change > 0)
    lost_mL_ = std::min(flaws_.missed_mL, lost_mL_ + change);
  return volume_mL - lost_mL_;
}

double Screw::stuck(double volume_mL) {
  if (flaws_.stick_share == 0) return volume_mL;
  const double change = volume_mL - held_mL_;
  const double direction = change > 0 ? 1 : (change < 0 ? -1 : direction_);
  if (!sticks_ && direction != direction_) {
    direction_ = direction;
    constexpr double whole = 18446744073709551616.0;  // 2^64
    sticks_ = static_cast<double>(random_()) / whole < flaws_.stick_share;
  }
  sticks_ = sticks_ && std::abs(change) < flaws_.stick_mL;
  if (!sticks_) held_mL_ = volume_mL;
  return held_mL_;
}

double Screw::follow(double counted_mL) {
  const double pushed_mL = stuck(stalled(counted_mL) * (1 + flaws_.gain));
  piston_mL_ = std::clamp(piston_mL_, pushed_mL - flaws_.backlash_mL, pushed_mL);
  return piston_mL_;
}

}  // namespace diastole::sim_rig
