// The sawtooth (sawtooth.cpp) backwards in time: up quickly for T/4, back slowly for 3T/4, with blends of T/25.

#include "firmware/core/profiles/profile.hpp"

namespace diastole::firmware {

namespace {

Q64 phase_rising(Q64 y) { return 0 - sawtooth_profile.phase_falling(y); }

Q64 phase_falling(Q64 y) { return 0 - sawtooth_profile.phase_rising(y); }

}  // namespace

const Profile reversed_sawtooth_profile{phase_rising, phase_falling, 4'761'905, 119'047'620};

}  // namespace diastole::firmware
