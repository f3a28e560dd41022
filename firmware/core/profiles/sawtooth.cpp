// Up slowly for 3T/4, back quickly for T/4: flanks (flank.hpp) of r = 3/4 and 1/4, both with b = 1/25. The quick
// one sets the peaks: speed S/T / 0.21, acceleration S/T² / (0.21 · 0.04); the slow one has S/T / 0.71.

#include "firmware/core/profiles/flank.hpp"
#include "firmware/core/profiles/profile.hpp"

namespace diastole::firmware {

namespace {

constexpr Flank kSlow(75, 4, 100);
constexpr Flank kQuick(25, 4, 100);

Q64 phase_rising(Q64 y) { return kSlow.phase(y); }

Q64 phase_falling(Q64 y) { return 0 - kQuick.phase(y); }

}  // namespace

const Profile sawtooth_profile{phase_rising, phase_falling, 4'761'905, 119'047'620};

}  // namespace diastole::firmware
