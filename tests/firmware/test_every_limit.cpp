// Every limit of limit_list.inc: a profile beyond it is refused with the limit, the value asked and the value
// allowed, and one just within it is not. A limit without a case here does not compile.

#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <vector>

#include "firmware/core/jog.hpp"
#include "firmware/core/plan_check.hpp"
#include "protocol/wire/wire_text.hpp"

namespace diastole::firmware {
namespace {

using wire::Limit;
using wire::Refusal;
using wire::Waveform;

struct Plan {
  Segment segment{Waveform::parabolic, 10, 40'000'000, 0, 1'200'000};
  std::uint32_t ttl_width_us = 10'000;
  std::uint32_t trigger_delay_us = 0;
  wire::Configure configure = wire::Configure::example();
  std::uint32_t backlash_steps = 0;
  std::optional<wire::Jog> jog;  ///< from 100 microsteps above home, instead of the segment

  /// As the controller judges it: first Configure, then Arm or Jog.
  [[nodiscard]] PlanRefusal refusal() const {
    const PlanRefusal configured = check_configuration(configure, wire::MachineSettings{});
    if (configured.refusal != Refusal::none) return configured;
    if (jog) return check_jog(*jog, Settings(configure), true, Steps{100});
    Program program;
    program.segments[program.size++] = segment;
    program.ttl_width_us = ttl_width_us;
    program.trigger_delay_us = trigger_delay_us;
    program.rest_us = 1'000'000;
    const auto checked = check_program(program, Settings(configure));
    if (!checked.ok()) return checked.error();
    const auto window_us = check_compensation(program, Settings(configure), backlash_steps);
    return window_us.ok() ? PlanRefusal{} : window_us.error();
  }
};

struct Excess {
  Plan beyond;
  std::int64_t asked = 0;
  std::int64_t allowed = 0;
  Plan within;  ///< by the least that the limit tells apart
};

/// The paper's gel run, and a limit of the configuration one below what it asks.
Excess configured(std::uint32_t wire::Configure::*limit, std::uint32_t asked) {
  Excess excess{{}, asked, asked - 1, {}};
  excess.beyond.configure.*limit = asked - 1;
  excess.within.configure.*limit = asked;
  return excess;
}

Excess stopping_time() {
  Excess excess{{}, 300'002, 300'001, {}};
  for (Plan* plan : {&excess.beyond, &excess.within})
    plan->configure.acceleration_uL_per_s2 = 444'445;
  excess.beyond.configure.lease_us = 300'001 + kHeartbeatGrace_us;
  excess.within.configure.lease_us = 300'002 + kHeartbeatGrace_us;
  return excess;
}

Excess stroke_at_least() {
  Excess excess{{}, 3'000, 7'792, {}};
  excess.beyond.segment.stroke_nL = 3'000;
  excess.within.segment.stroke_nL = 7'792;
  return excess;
}

Excess ttl_width() {
  Excess excess{{}, 600'001, 600'000, {}};
  excess.beyond.ttl_width_us = 600'001;
  excess.within.ttl_width_us = 600'000;
  return excess;
}

Excess r_wave_spacing() {
  Excess excess{{}, 30'000, 30'001, {}};
  excess.beyond.segment = {Waveform::parabolic, 1, 8'000, 0, 30'000};
  excess.within.segment = {Waveform::parabolic, 1, 8'000, 0, 30'001};
  return excess;
}

/// Of the pump that the settings describe: 20 ppm away at most.
Excess microstep() {
  const auto own_pL = static_cast<std::uint32_t>(wire::microstep_pL(wire::MachineSettings{}));
  Excess excess{{}, own_pL + own_pL / 40'000, own_pL, {}};
  excess.beyond.configure.microstep_pL = own_pL + own_pL / 40'000;
  excess.within.configure.microstep_pL = own_pL + own_pL / 60'000;
  return excess;
}

/// An eighth of 1.2 s; see backlash_compensation.hpp for the window.
Excess take_up() {
  Excess excess{{}, 150'049, 150'000, {}};
  excess.beyond.backlash_steps = 907;
  excess.within.backlash_steps = 906;
  return excess;
}

/// 100 microsteps are 779 uL and a bit.
Excess home() {
  Excess excess{{}, 786, 779, {}};
  wire::Jog jog{};
  jog.flow_uL_per_s = 100;
  jog.distance_nL = -101 * 7'792;
  excess.beyond.jog = jog;
  jog.distance_nL = -100 * 7'792;
  excess.within.jog = jog;
  return excess;
}

/// The R-wave of 30 ms behind the delay ends with the period of 1.2 s, which begins 4.187 ms before the first step.
Excess trigger_delay() {
  Excess excess{{}, 1'165'814, 1'165'813, {}};
  excess.beyond.trigger_delay_us = 1'165'814;
  excess.within.trigger_delay_us = 1'165'813;
  return excess;
}

Excess excess_of(Limit limit) {
  switch (limit) {
    case Limit::none:
      return {};
    case Limit::travel:
      return configured(&wire::Configure::travel_uL, 40'000);
    case Limit::flow:
      return configured(&wire::Configure::flow_uL_per_s, 133'334);
    case Limit::acceleration:
      return configured(&wire::Configure::acceleration_uL_per_s2, 444'445);
    case Limit::step_rate:
      return configured(&wire::Configure::step_rate_Hz, 17'113);
    case Limit::pressure:
      return configured(&wire::Configure::pressure_Pa, 19'556);
    case Limit::stopping_time:
      return stopping_time();
    case Limit::stroke_at_least:
      return stroke_at_least();
    case Limit::ttl_width:
      return ttl_width();
    case Limit::r_wave_spacing:
      return r_wave_spacing();
    case Limit::microstep:
      return microstep();
    case Limit::home:
      return home();
    case Limit::take_up:
      return take_up();
    case Limit::trigger_delay:
      return trigger_delay();
  }
  return {};
}

class EveryLimit : public testing::TestWithParam<Limit> {};

TEST_P(EveryLimit, IsRefusedWithNameAskedAndAllowed) {
  const Excess excess = excess_of(GetParam());
  const PlanRefusal refusal = excess.beyond.refusal();
  EXPECT_EQ(refusal.refusal,
            GetParam() == Limit::microstep ? Refusal::settings_mismatch : Refusal::limit_exceeded);
  EXPECT_EQ(refusal.limit, GetParam()) << wire::limit_name(refusal.limit);
  EXPECT_EQ(refusal.asked, excess.asked);
  EXPECT_EQ(refusal.allowed, excess.allowed);
  EXPECT_EQ(refusal.segment, 0);
  EXPECT_EQ(excess.within.refusal().refusal, Refusal::none)
      << wire::limit_name(excess.within.refusal().limit) << ": just within the limit must pass";
}

std::vector<Limit> every_limit() {
  std::vector<Limit> limits;
#define DIASTOLE_LIMIT(number, name, unit) \
  if (Limit::name != Limit::none) limits.push_back(Limit::name);
#include "protocol/wire/limit_list.inc"
  return limits;
}
INSTANTIATE_TEST_SUITE_P(Limits, EveryLimit, testing::ValuesIn(every_limit()),
                         [](const auto& tested) { return std::string(wire::limit_name(tested.param)); });

/// A driver that takes pulses of 2 µs with pauses of 3 µs may be given 200,000 a second.
TEST(StepRateLimit, OfThePaperDrivesLeavesRoomFor200kHz) {
  wire::Configure configure = wire::Configure::example();
  EXPECT_GE(configure.step_rate_Hz, 200'000U);
  configure.step_rate_Hz = 200'000;
  EXPECT_EQ(check_configuration(configure, wire::MachineSettings{}).refusal, Refusal::none);
}

}  // namespace
}  // namespace diastole::firmware
