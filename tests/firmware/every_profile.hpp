#pragma once
// The waveforms that the firmware can run, by name, as parameters of tests: the profiles of waveform_list.inc and
// an uploaded one.

#include <ostream>
#include <string>
#include <vector>

#include "firmware/core/plan_check.hpp"
#include "firmware/core/profiles/profile.hpp"
#include "firmware/core/uploaded/crossings.hpp"
#include "tests/firmware/uploaded_waveform.hpp"

namespace diastole::firmware {

struct NamedProfile {
  std::string name;
  wire::Waveform waveform;
  const Profile* profile;  ///< null: uploaded
  const UploadedWaveform* uploaded = nullptr;

  [[nodiscard]] Segment segment(std::uint32_t cycles, std::uint32_t stroke_nL, std::uint32_t offset_nL,
                                std::uint32_t period_us) const {
    return {waveform, cycles, stroke_nL, offset_nL, period_us, uploaded};
  }
  [[nodiscard]] bool moves() const { return segment(1, 0, 0, 1).moves(); }
  [[nodiscard]] double peak_speed() const {
    return 1e-6 * (profile != nullptr ? profile->peak_speed_millionths : uploaded->peak_speed_millionths);
  }
  [[nodiscard]] double peak_acceleration() const {
    return 1e-6 * (profile != nullptr ? profile->peak_acceleration_millionths
                                      : uploaded->peak_acceleration_millionths);
  }
};
inline void PrintTo(const NamedProfile& named, std::ostream* out) { *out << named.name; }

inline std::vector<NamedProfile> every_profile() {
  return {
#define DIASTOLE_PROFILE(number, name) {#name, wire::Waveform::name, &name##_profile},
#include "protocol/wire/waveform_list.inc"
      {"uploaded", wire::Waveform::uploaded, nullptr, &heart_waveform()},
  };
}

inline std::vector<NamedProfile> every_moving_profile() {
  std::vector<NamedProfile> moving = every_profile();
  std::erase_if(moving, [](const NamedProfile& named) { return !named.moves(); });
  return moving;
}

/// Where the levels (2k + 1) / 2n of the stroke are crossed, by k.
struct Crossings {
  std::vector<Q64> rising, falling;
};

inline Crossings crossings_of(const NamedProfile& named, std::uint32_t levels) {
  Crossings found;
  if (named.profile != nullptr) {
    for (std::uint32_t k = 0; k < levels; ++k) {
      found.rising.push_back(named.profile->phase_rising(ratio(2 * k + 1, 2 * levels)));
      found.falling.push_back(named.profile->phase_falling(ratio(2 * k + 1, 2 * levels)));
    }
    return found;
  }
  for (UploadedCrossings crossings(*named.uploaded, levels); !crossings.at_end();) {
    const auto [phase, rising] = crossings.take();
    (rising ? found.rising : found.falling).push_back(phase);
  }
  std::reverse(found.falling.begin(), found.falling.end());
  return found;
}

}  // namespace diastole::firmware
