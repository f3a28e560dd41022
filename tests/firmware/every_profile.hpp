#pragma once
// The profiles of profile_list.inc by name, as parameters of tests.

#include <ostream>
#include <string>
#include <vector>

#include "firmware/core/profiles/profile.hpp"

namespace diastole::firmware {

struct NamedProfile {
  std::string name;
  wire::Waveform waveform;
  const Profile* profile;
};
inline void PrintTo(const NamedProfile& named, std::ostream* out) { *out << named.name; }

inline std::vector<NamedProfile> every_profile() {
  return {
#define DIASTOLE_PROFILE(name) {#name, wire::Waveform::name, &name##_profile},
#include "firmware/core/profiles/profile_list.inc"
#undef DIASTOLE_PROFILE
  };
}

inline std::vector<NamedProfile> every_moving_profile() {
  std::vector<NamedProfile> moving = every_profile();
  std::erase_if(moving, [](const NamedProfile& named) { return !named.profile->moves(); });
  return moving;
}

}  // namespace diastole::firmware
