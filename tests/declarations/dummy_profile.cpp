// Up for 3T/5, back for 2T/5: flanks (flank.hpp) of r = 3/5 and 2/5, both with b = 1/10. The quicker one sets the peaks:
// speed S/T / 0.3, acceleration S/T² / (0.3 · 0.1).

#include "firmware/core/profiles/flank.hpp"
#include "firmware/core/profiles/profile.hpp"

namespace diastole::firmware {

namespace {

constexpr Flank kUp(6, 1, 10);
constexpr Flank kDown(4, 1, 10);

Q64 phase_rising(Q64 y) { return kUp.phase(y); }

Q64 phase_falling(Q64 y) { return 0 - kDown.phase(y); }

}  // namespace

const Profile dummy_profile{phase_rising, phase_falling, 3'333'334, 33'333'334};

}  // namespace diastole::firmware
