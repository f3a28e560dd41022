#include "host/controller/self_test.hpp"

#include <gmock/gmock.h>

#include <algorithm>

namespace diastole {
namespace {

using ::testing::HasSubstr;

/// What a board without a fault answers.
SelfTestReadings healthy() {
  SelfTestReadings readings;
  readings.tick_rate_Hz = 84e6;
  readings.pulses.assign(self_test_pulses,
                         {.counted = 1, .ttl_late_ticks = 3, .step_late_ticks = 4, .r_wave_late_ticks = 300});
  for (const uint16_t code : self_test_codes)
    readings.levels.push_back({.argument = code, .code = code});
  readings.steps = {.argument = 2000, .counted = 2000};
  readings.supply.code = 1502;
  for (int i = 0; i <= 40; ++i)
    readings.clock.push_back({0.25 * i, 7 + 0.25 * i * (1 + 20e-6), 0.5e-3});
  return readings;
}

SelfTestCheck check(const SelfTestReadings& readings, const std::string& name) {
  const auto checks = judge(readings);
  const auto found = std::ranges::find(checks, name, &SelfTestCheck::name);
  EXPECT_NE(found, checks.end()) << name;
  return found == checks.end() ? SelfTestCheck() : *found;
}

TEST(SelfTestVerdict, AHealthyBoardPassesEveryCheck) {
  for (const SelfTestCheck& each : judge(healthy()))
    EXPECT_TRUE(each.passed()) << each.name;
  EXPECT_NEAR(*check(healthy(), "clock").measured, 20, 1e-3);
  EXPECT_NEAR(check(healthy(), "clock").most, 550 + 100, 1e-6) << "0.5 ms at either end of 10 s";
}

TEST(SelfTestVerdict, NothingSeenIsNotZeroSeen) {
  SelfTestReadings readings = healthy();
  for (auto& pulse : readings.pulses)
    pulse = {.ttl_late_ticks = wire::kNotSeen,
             .step_late_ticks = wire::kNotSeen,
             .r_wave_late_ticks = wire::kNotSeen};
  readings.clock.clear();
  readings.supply.code = 0;
  for (const char* name :
       {"ttl_late", "ttl_jitter", "step_skew", "step_jitter", "r_wave_late", "clock", "supply"}) {
    EXPECT_FALSE(check(readings, name).measured) << name;
    EXPECT_FALSE(check(readings, name).passed()) << name;
  }
  EXPECT_THAT(check(readings, "ttl_count").remedy, HasSubstr("PA1"));
}

TEST(SelfTestVerdict, OneBadPulseOfSixteenIsEnough) {
  SelfTestReadings readings = healthy();
  readings.pulses[5].counted = 2;
  EXPECT_FALSE(check(readings, "ttl_count").passed());
  EXPECT_THAT(check(readings, "ttl_count").remedy, HasSubstr("more than once"));
  readings = healthy();
  readings.pulses[5].ttl_late_ticks = 7;
  EXPECT_FALSE(check(readings, "ttl_late").passed());
  EXPECT_FALSE(check(readings, "ttl_jitter").passed());
  EXPECT_FALSE(check(readings, "step_skew").passed());
  readings = healthy();
  readings.pulses[5].ttl_late_ticks = -1;
  EXPECT_FALSE(check(readings, "ttl_late").passed()) << "before its tick";
}

TEST(SelfTestVerdict, LimitsAreInclusiveAndNamed) {
  SelfTestReadings readings = healthy();
  readings.levels[2].code = 2048 + 38;
  EXPECT_TRUE(check(readings, "level_50").passed());
  readings.levels[2].code = 2048 + 40;
  EXPECT_FALSE(check(readings, "level_50").passed());
  const auto supply_passes = [&](uint16_t code) {
    readings.supply.code = code;
    return check(readings, "supply").passed();
  };
  EXPECT_TRUE(supply_passes(1417)) << "3.4 V by a reference of 1.18 V, read 5 codes too low";
  EXPECT_FALSE(supply_passes(1416));
  EXPECT_TRUE(supply_passes(1591)) << "3.2 V by a reference of 1.24 V, read 5 codes too high";
  EXPECT_FALSE(supply_passes(1592));
  for (ClockPair& pair : readings.clock)
    pair.other_s *= 1.001;
  EXPECT_FALSE(check(readings, "clock").passed());
}

}  // namespace
}  // namespace diastole
