#include "firmware/core/profiles/profile.hpp"

namespace diastole::firmware {

const Profile* find_profile(wire::Waveform waveform) {
  switch (waveform) {
#define DIASTOLE_PROFILE(name) \
  case wire::Waveform::name:   \
    return &name##_profile;
#include "firmware/core/profiles/profile_list.inc"
#undef DIASTOLE_PROFILE
    default:
      return nullptr;
  }
}

}  // namespace diastole::firmware
