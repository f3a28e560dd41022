#pragma once
// A waveform as the planner needs it: when does the ideal motion cross a given volume?
//
// y(phase) is the volume over the stroke: 0 at phase 0, where the cycle begins at its least volume and at
// rest, up to 1, and back to 0 by phase 1; it may dwell at 1 and at 0. It rises once and falls once. Phases
// and volumes are Q64. A profile that does not move stays at y = 1 and crosses nothing.

#include <cstdint>

#include "firmware/core/arithmetic/fixed_point.hpp"
#include "protocol/wire/states.hpp"

namespace diastole::firmware {

struct Profile {
  /// The phase at which the rising, or the falling, motion crosses y; null if it does not move.
  /// Precondition: 0 < y < 1.
  Q64 (*phase_rising)(Q64 y);
  Q64 (*phase_falling)(Q64 y);
  /// max |dy/dphase| and max |d²y/dphase²|, in millionths, rounded up.
  std::uint32_t peak_speed_millionths;
  std::uint32_t peak_acceleration_millionths;

  [[nodiscard]] bool moves() const { return phase_rising != nullptr; }
};

#define DIASTOLE_PROFILE(number, name) extern const Profile name##_profile;
#include "protocol/wire/waveform_list.inc"

/// The profile of a waveform, or nullptr if this firmware has none.
const Profile* find_profile(wire::Waveform waveform);

}  // namespace diastole::firmware
