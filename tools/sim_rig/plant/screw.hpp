#pragma once
// From the volume that the controller counts to that of the piston: gain, stall, sticking seal and play.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>

#include "tools/sim_rig/plant/flaws.hpp"

namespace diastole::sim_rig {

class Screw {
 public:
  Screw(const DriveFlaws& flaws, uint64_t seed) : flaws_(flaws), random_(seed) {}

  void begin_cycle() { ++cycle_; }
  /// What the piston has displaced once the controller has counted to this volume.
  [[nodiscard]] double follow(double counted_mL) {
    const double pushed_mL = stuck(stalled(counted_mL) * (1 + flaws_.gain));
    piston_mL_ = std::clamp(piston_mL_, pushed_mL - flaws_.backlash_mL, pushed_mL);
    return piston_mL_;
  }

 private:
  [[nodiscard]] double stalled(double volume_mL) {
    const double change = volume_mL - before_mL_;
    before_mL_ = volume_mL;
    if (flaws_.missed_in_cycle > 0 && cycle_ >= flaws_.missed_in_cycle && change > 0)
      lost_mL_ = std::min(flaws_.missed_mL, lost_mL_ + change);
    return volume_mL - lost_mL_;
  }
  [[nodiscard]] double stuck(double volume_mL) {
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

  DriveFlaws flaws_;
  std::mt19937_64 random_;
  int cycle_ = 0;
  double before_mL_ = 0;  // counted last
  double lost_mL_ = 0;    // by the stall so far
  double direction_ = 0;  // of the last change
  double held_mL_ = 0;    // by the seal
  bool sticks_ = false;
  double piston_mL_ = 0;
};

}  // namespace diastole::sim_rig
