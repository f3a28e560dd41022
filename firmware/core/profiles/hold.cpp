// Stays at offset + stroke, which is reached by the smooth ramp before the segment; no steps.

#include "firmware/core/profiles/profile.hpp"

namespace diastole::firmware {

const Profile hold_profile{nullptr, nullptr, 0, 0};

}  // namespace diastole::firmware
