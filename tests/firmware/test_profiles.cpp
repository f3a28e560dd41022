// Properties of every profile in profile_list.inc, and agreement with the analytic waveforms.

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "tests/firmware/analytic_profiles.hpp"
#include "tests/firmware/every_profile.hpp"

namespace diastole::firmware {
namespace {

constexpr Real kOne = 18446744073709551616.0L;

class EveryProfile : public testing::TestWithParam<NamedProfile> {};
class EveryMovingProfile : public EveryProfile {};

const auto name_of = [](const auto& tested) { return tested.param.name; };
INSTANTIATE_TEST_SUITE_P(Profiles, EveryProfile, testing::ValuesIn(every_profile()), name_of);
INSTANTIATE_TEST_SUITE_P(Profiles, EveryMovingProfile, testing::ValuesIn(every_moving_profile()), name_of);

constexpr std::uint32_t kLevels = 20'000;

Q64 level(std::uint32_t k) { return ratio(2 * k + 1, 2 * kLevels); }

TEST_P(EveryMovingProfile, RisesThenFallsWithoutTurningBack) {
  const Profile& profile = *GetParam().profile;
  for (std::uint32_t k = 1; k < kLevels; ++k) {
    ASSERT_LT(profile.phase_rising(level(k - 1)), profile.phase_rising(level(k)));
    ASSERT_GT(profile.phase_falling(level(k - 1)), profile.phase_falling(level(k)));
  }
  EXPECT_LT(profile.phase_rising(level(kLevels - 1)), profile.phase_falling(level(kLevels - 1)));
}

TEST_P(EveryMovingProfile, BeginsAndEndsAtTheLeastVolume) {
  const Profile& profile = *GetParam().profile;
  const Q64 tiny = ratio(1, 2'000'000'000);
  EXPECT_LT(profile.phase_rising(tiny), kHalf >> 12);
  const auto analytic = analytic_profiles().find(GetParam().name);
  if (analytic == analytic_profiles().end()) return;
  EXPECT_EQ(analytic->second.volume(0), 0);
  EXPECT_LT(std::abs(analytic->second.volume(1)), 1e-18L);
  const Real at_rest = static_cast<Real>(profile.phase_falling(tiny) + (kHalf >> 12)) / kOne;
  EXPECT_LT(std::abs(analytic->second.volume(at_rest < 0.5L ? 1 : at_rest)), 1e-18L);
}

TEST_P(EveryMovingProfile, DeclaredPeaksAreThePeaks) {
  const Profile& profile = *GetParam().profile;
  Real fastest = 0, hardest = 0;
  for (const auto phase : {profile.phase_rising, profile.phase_falling}) {
    Real before = 0;
    for (std::uint32_t k = 1; k < kLevels; ++k) {
      const Q64 lower = phase(level(k - 1)), upper = phase(level(k));
      const Real interval = static_cast<Real>(lower < upper ? upper - lower : lower - upper) / kOne;
      const Real speed = 1 / (kLevels * interval);
      fastest = std::max(fastest, speed);
      // dv/dt = v dv/dy; not at the very ends, where one step is a large part of the speed.
      if (k > 20 && k < kLevels - 20)
        hardest = std::max(hardest, std::abs(speed * speed - before * before) / 2 * kLevels);
      before = speed;
    }
  }
  const double acceleration = profile.peak_acceleration_millionths * 1e-6;
  EXPECT_NEAR(static_cast<double>(fastest), profile.peak_speed_millionths * 1e-6, 1e-3);
  EXPECT_NEAR(static_cast<double>(hardest), acceleration, 0.003 * acceleration);
}

TEST_P(EveryMovingProfile, CrossesEachLevelWhereTheAnalyticWaveformDoes) {
  const auto analytic = analytic_profiles().find(GetParam().name);
  if (analytic == analytic_profiles().end())
    GTEST_SKIP() << "analytic_profiles.hpp does not define " << GetParam().name;
  for (std::uint32_t k = 0; k < kLevels; ++k) {
    for (const Q64 phase :
         {GetParam().profile->phase_rising(level(k)), GetParam().profile->phase_falling(level(k))}) {
      const Real y = analytic->second.volume(static_cast<Real>(phase) / kOne);
      ASSERT_NEAR(static_cast<double>(y - static_cast<Real>(level(k)) / kOne), 0, 2e-12) << k;
    }
  }
}

TEST_P(EveryProfile, MovesOrHasNeitherCrossingsNorPeaks) {
  const Profile& profile = *GetParam().profile;
  EXPECT_EQ(profile.moves(), profile.phase_falling != nullptr);
  EXPECT_EQ(profile.moves(), profile.peak_speed_millionths > 0);
  EXPECT_EQ(profile.moves(), profile.peak_acceleration_millionths > 0);
  EXPECT_EQ(profile.moves(), GetParam().waveform != wire::Waveform::hold);
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
