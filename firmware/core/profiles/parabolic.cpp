// Constant acceleration +a for T/4, -a for T/2, +a for T/4 with a = 16 S/T²: the least peak acceleration that
// makes a given stroke in a given period. y = 8 phase² up to a quarter, mirrored about 1/4 and 1/2.

#include "firmware/core/profiles/profile.hpp"

namespace diastole::firmware {

namespace {

Q64 phase_rising(Q64 y) { return y <= kHalf ? square_root(y >> 3) : kHalf - square_root((0 - y) >> 3); }

Q64 phase_falling(Q64 y) { return 0 - phase_rising(y); }

}  // namespace

const Profile parabolic_profile{phase_rising, phase_falling, 4'000'000, 16'000'000};

}  // namespace diastole::firmware
