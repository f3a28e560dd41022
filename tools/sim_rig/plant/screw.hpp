#pragma once
// From the volume that the controller counts to that of the piston: gain, stall, sticking seal and play.

#include <cstdint>
#include <random>

#include "tools/sim_rig/plant/flaws.hpp"

namespace diastole::sim_rig {

class Screw {
 public:
  Screw(const DriveFlaws& flaws, uint64_t seed) : flaws_(flaws), random_(seed) {}

  void begin_cycle() { ++cycle_; }
  /// What the piston has displaced once the controller has counted to this volume.
  [[nodiscard]] double follow(double counted_mL);

 private:
  [[nodiscard]] double stalled(double volume_mL);
  [[nodiscard]] double stuck(double volume_mL);

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
