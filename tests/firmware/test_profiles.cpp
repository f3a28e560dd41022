// Properties of every profile in waveform_list.inc, and agreement with the analytic waveforms.

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "tests/firmware/analytic_profiles.hpp"
#include "tests/firmware/every_profile.hpp"

namespace diastole::firmware {
namespace {

class EveryProfile : public testing::TestWithParam<NamedProfile> {};
class EveryMovingProfile : public EveryProfile {};

const auto name_of = [](const auto& tested) { return tested.param.name; };
INSTANTIATE_TEST_SUITE_P(Profiles, EveryProfile, testing::ValuesIn(every_profile()), name_of);
INSTANTIATE_TEST_SUITE_P(Profiles, EveryMovingProfile, testing::ValuesIn(every_moving_profile()), name_of);

constexpr std::uint32_t kLevels = 20'000;

Q64 level(std::uint32_t k) { return ratio(2 * k + 1, 2 * kLevels); }

TEST_P(EveryMovingProfile, RisesThenFallsWithoutTurningBack) {
  const auto [rising, falling] = crossings_of(GetParam(), kLevels);
  ASSERT_EQ(rising.size(), kLevels);
  ASSERT_EQ(falling.size(), kLevels);
  for (std::uint32_t k = 1; k < kLevels; ++k) {
    ASSERT_LT(rising[k - 1], rising[k]);
    ASSERT_GT(falling[k - 1], falling[k]);
  }
  EXPECT_LT(rising.back(), falling.back());
}

TEST_P(EveryMovingProfile, BeginsAndEndsAtTheLeastVolume) {
  const auto [rising, falling] = crossings_of(GetParam(), 1'000'000);
  EXPECT_LT(rising.front(), kHalf >> 10);
  const auto analytic = analytic_profiles().find(GetParam().name);
  if (analytic == analytic_profiles().end()) return;
  EXPECT_EQ(analytic->second.volume(0), 0);
  EXPECT_LT(std::abs(analytic->second.volume(1)), 1e-18L);
  const Real at_rest = static_cast<Real>(falling.front() + (kHalf >> 4)) / kOne;
  EXPECT_LT(std::abs(analytic->second.volume(at_rest < 0.5L ? 1 : at_rest)), 1e-18L);
}

TEST_P(EveryMovingProfile, DeclaredPeaksAreThePeaks) {
  const auto [rising, falling] = crossings_of(GetParam(), kLevels);
  Real fastest = 0, hardest = 0;
  for (const auto& phase : {rising, falling}) {
    Real before = 0;
    for (std::uint32_t k = 1; k < kLevels; ++k) {
      const Q64 lower = phase[k - 1], upper = phase[k];
      const Real interval = static_cast<Real>(lower < upper ? upper - lower : lower - upper) / kOne;
      const Real speed = 1 / (kLevels * interval);
      fastest = std::max(fastest, speed);
      // dv/dt = v dv/dy; not at the very ends, where one step is a large part of the speed.
      if (k > 20 && k < kLevels - 20)
        hardest = std::max(hardest, std::abs(speed * speed - before * before) / 2 * kLevels);
      before = speed;
    }
  }
  const double acceleration = GetParam().peak_acceleration();
  EXPECT_NEAR(static_cast<double>(fastest), GetParam().peak_speed(), 1e-3);
  EXPECT_LE(static_cast<double>(hardest), 1.003 * acceleration);
  // The curve of an uploaded waveform may be hardest at the very ends: test_uploaded.cpp looks there.
  if (GetParam().uploaded == nullptr) {
    EXPECT_GE(static_cast<double>(hardest), 0.997 * acceleration);
  }
}

TEST_P(EveryMovingProfile, CrossesEachLevelWhereTheAnalyticWaveformDoes) {
  const auto analytic = analytic_profiles().find(GetParam().name);
  if (analytic == analytic_profiles().end())
    GTEST_SKIP() << "analytic_profiles.hpp does not define " << GetParam().name;
  const auto [rising, falling] = crossings_of(GetParam(), kLevels);
  for (std::uint32_t k = 0; k < kLevels; ++k) {
    for (const Q64 phase : {rising[k], falling[k]}) {
      const Real y = analytic->second.volume(static_cast<Real>(phase) / kOne);
      ASSERT_NEAR(static_cast<double>(y - static_cast<Real>(level(k)) / kOne), 0, 2e-12) << k;
    }
  }
}

TEST_P(EveryProfile, MovesOrHasNeitherCrossingsNorPeaks) {
  const NamedProfile& named = GetParam();
  EXPECT_EQ(named.moves(), named.waveform != wire::Waveform::hold);
  EXPECT_EQ(named.moves(), named.peak_speed() > 0);
  EXPECT_EQ(named.moves(), named.peak_acceleration() > 0);
  if (named.profile == nullptr) return;
  EXPECT_EQ(named.moves(), named.profile->phase_rising != nullptr);
  EXPECT_EQ(named.moves(), named.profile->phase_falling != nullptr);
}

TEST_P(EveryProfile, IsFoundUnderItsWaveformName) {
  // An uploaded waveform has no profile of its own and is found by its number in the store.
  const std::string& wanted = GetParam().name;
  bool found = false;
#define DIASTOLE_WAVEFORM(number, name) \
  if (wanted == #name) found = find_profile(wire::Waveform::name) == GetParam().profile;
#include "protocol/wire/waveform_list.inc"
  EXPECT_TRUE(found);
}

}  // namespace
}  // namespace diastole::firmware
