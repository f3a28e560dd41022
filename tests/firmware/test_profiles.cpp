// Properties of every profile in profile_list.inc, and the analytic waveforms of the experiment file.

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>
#include <string>

#include "firmware/core/profiles/profile.hpp"

namespace diastole::firmware {
namespace {

constexpr long double kOne = 18446744073709551616.0L;

long double parabolic(long double phase) {
  if (phase > 0.5L) phase = 1 - phase;
  return phase < 0.25L ? 8 * phase * phase : 1 - 8 * (0.5L - phase) * (0.5L - phase);
}

long double sinusoidal(long double phase) {
  return (1 - std::cos(2 * std::numbers::pi_v<long double> * phase)) / 2;
}

struct Named {
  std::string name;
  const Profile* profile;
};
void PrintTo(const Named& named, std::ostream* out) { *out << named.name; }

class EveryProfile : public testing::TestWithParam<Named> {};

const Named kProfiles[] = {
#define DIASTOLE_PROFILE(name) {#name, &name##_profile},
#include "firmware/core/profiles/profile_list.inc"
#undef DIASTOLE_PROFILE
};
INSTANTIATE_TEST_SUITE_P(Profiles, EveryProfile, testing::ValuesIn(kProfiles),
                         [](const auto& tested) { return tested.param.name; });

constexpr std::uint32_t kLevels = 20'000;

Q64 level(std::uint32_t k) { return ratio(2 * k + 1, 2 * kLevels); }

TEST_P(EveryProfile, RisesThenFallsWithoutTurningBack) {
  const Profile& profile = *GetParam().profile;
  for (std::uint32_t k = 1; k < kLevels; ++k) {
    ASSERT_LT(profile.phase_rising(level(k - 1)), profile.phase_rising(level(k)));
    ASSERT_GT(profile.phase_falling(level(k - 1)), profile.phase_falling(level(k)));
  }
  EXPECT_LT(profile.phase_rising(level(kLevels - 1)), profile.phase_falling(level(kLevels - 1)));
}

TEST_P(EveryProfile, BeginsAndEndsAtTheLeastVolume) {
  const Profile& profile = *GetParam().profile;
  EXPECT_LT(profile.phase_rising(ratio(1, 2'000'000'000)), kHalf >> 12);
  EXPECT_GT(profile.phase_falling(ratio(1, 2'000'000'000)), 0 - (kHalf >> 12));
}

TEST_P(EveryProfile, DeclaredPeaksAreThePeaks) {
  const Profile& profile = *GetParam().profile;
  long double fastest = 0, hardest = 0, before = 0;
  for (std::uint32_t k = 1; k < kLevels; ++k) {
    const long double interval =
        static_cast<long double>(profile.phase_rising(level(k)) - profile.phase_rising(level(k - 1))) / kOne;
    const long double speed = 1 / (kLevels * interval);
    fastest = std::max(fastest, speed);
    // dv/dt = v dv/dy; not at the very ends, where one step is a large part of the speed.
    if (k > 20 && k < kLevels - 20)
      hardest = std::max(hardest, std::abs(speed * speed - before * before) / 2 * kLevels);
    before = speed;
  }
  EXPECT_NEAR(static_cast<double>(fastest), profile.peak_speed_millionths * 1e-6, 1e-3);
  EXPECT_NEAR(static_cast<double>(hardest), profile.peak_acceleration_millionths * 1e-6, 0.05);
}

TEST_P(EveryProfile, CrossesEachLevelWhereTheAnalyticWaveformDoes) {
  static const std::map<std::string, long double (*)(long double)> kAnalytic{{"parabolic", parabolic},
                                                                             {"sinusoidal", sinusoidal}};
  const auto analytic = kAnalytic.find(GetParam().name);
  if (analytic == kAnalytic.end())
    GTEST_SKIP() << "no analytic waveform is written down for " << GetParam().name;
  for (std::uint32_t k = 0; k < kLevels; ++k) {
    for (const Q64 phase :
         {GetParam().profile->phase_rising(level(k)), GetParam().profile->phase_falling(level(k))}) {
      const long double y = analytic->second(static_cast<long double>(phase) / kOne);
      ASSERT_NEAR(static_cast<double>(y - static_cast<long double>(level(k)) / kOne), 0, 2e-12) << k;
    }
  }
}

TEST_P(EveryProfile, IsFoundUnderItsWaveformName) {
  const std::string& wanted = GetParam().name;
  bool found = false;
#define DIASTOLE_WAVEFORM(number, name) \
  if (wanted == #name) found = find_profile(wire::Waveform::name) == GetParam().profile;
#include "protocol/wire/waveform_list.inc"
#undef DIASTOLE_WAVEFORM
  EXPECT_TRUE(found);
}

}  // namespace
}  // namespace diastole::firmware
