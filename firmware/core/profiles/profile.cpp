#include "firmware/core/profiles/profile.hpp"

namespace diastole::firmware {

const Profile* find_profile(wire::Waveform waveform) {
  switch (waveform) {
#define DIASTOLE_PROFILE(number, name) \
  case wire::Waveform::name:           \
    return &name##_profile;
#include "protocol/wire/waveform_list.inc"
    default:
      return nullptr;
  }
}

}  // namespace diastole::firmware
