// Up for T/4, at the stroke for T/4, down for T/4, at the least volume for T/4. The flanks (flank.hpp) have
// r = 1/4 and b = 1/20, a fifth of the flank: speed 5 S/T, acceleration 100 S/T².

#include "firmware/core/profiles/flank.hpp"
#include "firmware/core/profiles/profile.hpp"

namespace diastole::firmware {

namespace {

constexpr Flank kFlank(5, 1, 20);
constexpr Q64 kDown = 3 * (kHalf >> 1);

Q64 phase_rising(Q64 y) { return kFlank.phase(y); }

Q64 phase_falling(Q64 y) { return kDown - kFlank.phase(y); }

}  // namespace

const Profile trapezoidal_profile{phase_rising, phase_falling, 5'000'000, 100'000'000};

}  // namespace diastole::firmware
