#include <gtest/gtest.h>

#include <cmath>

#include "firmware/core/plan_check.hpp"
#include "tests/firmware/every_profile.hpp"

namespace diastole::firmware {
namespace {

using wire::Limit;
using wire::Refusal;
using wire::Waveform;

constexpr Segment kPaper{Waveform::parabolic, 10, 40'000'000, 0, 1'200'000};

Program program_of(Segment segment) {
  Program program;
  program.segments[program.size++] = segment;
  program.ttl_width_us = 10'000;
  program.rest_us = 1'000'000;
  return program;
}

PlanRefusal refusal_of(Segment segment, const wire::Configure& configure = wire::Configure::example()) {
  const auto checked = check_program(program_of(segment), Settings(configure));
  return checked.ok() ? PlanRefusal{} : checked.error();
}

TEST(PlanCheck, PeaksOfThePapersGelRun) {
  const SegmentPeaks peaks = segment_peaks(kPaper, Settings(wire::Configure::example()));
  EXPECT_EQ(peaks.flow_uL_per_s, 133'334U);           // 4 S/T
  EXPECT_EQ(peaks.acceleration_uL_per_s2, 444'445U);  // 16 S/T²
  EXPECT_EQ(peaks.step_rate_Hz, 17'113U);
  EXPECT_EQ(peaks.pressure_Pa, 19'556U);  // ± 20 kPa from inertia alone
  EXPECT_EQ(peaks.cycle_steps.count, 5134);
  EXPECT_EQ(refusal_of(kPaper).refusal, Refusal::none);
}

TEST(PlanCheck, TheSineAsksForMoreAccelerationThanTheParabola) {
  Segment sine = kPaper;
  sine.waveform = Waveform::sinusoidal;
  const SegmentPeaks peaks = segment_peaks(sine, Settings(wire::Configure::example()));
  EXPECT_NEAR(static_cast<double>(peaks.acceleration_uL_per_s2), 19.739 * 40'000 / 1.44, 10);
}

TEST(PlanCheck, AMotionThatCannotStopWithinTheLeaseIsRefused) {
  wire::Configure configure = wire::Configure::example();
  configure.acceleration_uL_per_s2 = 444'445;
  configure.lease_us = 400'000;
  const PlanRefusal refusal = refusal_of(kPaper, configure);
  EXPECT_EQ(refusal.limit, Limit::stopping_time);
  EXPECT_EQ(refusal.allowed, 250'000);
  EXPECT_NEAR(static_cast<double>(refusal.asked), 300'000, 100);
}

TEST(PlanCheck, AHoldMayHaveAnyStrokeWithinTheTravel) {
  Segment hold{Waveform::hold, 1, 0, 0, 300'000};
  EXPECT_EQ(refusal_of(hold).refusal, Refusal::none);
  hold.stroke_nL = 30'000'000;
  hold.offset_nL = 20'000'000;
  EXPECT_EQ(segment_peaks(hold, Settings(wire::Configure::example())).flow_uL_per_s, 0U);
  wire::Configure configure = wire::Configure::example();
  configure.travel_uL = 50'000;
  EXPECT_EQ(refusal_of(hold, configure).refusal, Refusal::none);
  configure.travel_uL = 49'999;
  EXPECT_EQ(refusal_of(hold, configure).limit, Limit::travel);
}

TEST(PlanCheck, EveryProfileIsHeldToItsOwnPeaks) {
  for (const NamedProfile& named : every_moving_profile()) {
    SCOPED_TRACE(named.name);
    const Segment segment = named.segment(10, 20'000'000, 0, 1'200'000);
    wire::Configure configure = wire::Configure::example();
    const SegmentPeaks peaks = segment_peaks(segment, Settings(configure));
    EXPECT_NEAR(static_cast<double>(peaks.acceleration_uL_per_s2), named.peak_acceleration() * 20'000 / 1.44,
                2);
    configure.acceleration_uL_per_s2 = static_cast<std::uint32_t>(peaks.acceleration_uL_per_s2 - 1);
    EXPECT_EQ(refusal_of(segment, configure).limit, Limit::acceleration);
    configure = wire::Configure::example();
    configure.flow_uL_per_s = static_cast<std::uint32_t>(peaks.flow_uL_per_s - 1);
    EXPECT_EQ(refusal_of(segment, configure).limit, Limit::flow);
  }
}

TEST(PlanCheck, LessThanAMicrostepIsRefused) {
  Segment tiny = kPaper;
  tiny.stroke_nL = 3'000;
  EXPECT_EQ(refusal_of(tiny).limit, Limit::stroke_at_least);
  EXPECT_EQ(refusal_of(tiny).allowed, 7'792);
}

TEST(PlanCheck, TtlAndRWaveMustFitTheCycle) {
  Segment quick{Waveform::parabolic, 1, 8'000, 0, 25'000};
  EXPECT_EQ(refusal_of(quick).limit, Limit::r_wave_spacing);
  Program program = program_of(quick);
  program.gate_every = 2;
  EXPECT_TRUE(check_program(program, Settings(wire::Configure::example())).ok());
  program.ttl_width_us = 13'000;
  EXPECT_EQ(check_program(program, Settings(wire::Configure::example())).error().limit, Limit::ttl_width);
}

TEST(PlanCheck, ADelayedTriggerIsOverWithinThePeriod) {
  const Settings settings(wire::Configure::example());
  for (const NamedProfile& named : every_profile()) {
    SCOPED_TRACE(named.name);
    const Segment segment = named.segment(1, 20'000'000, 0, 1'200'000);
    Program program = program_of(segment);
    const auto most_us = static_cast<std::uint32_t>(1'200'000 - 30'000 - first_step_us(segment, settings));
    program.trigger_delay_us = most_us;
    EXPECT_TRUE(check_program(program, settings).ok());
    program.trigger_delay_us = most_us + 1;
    const auto refused = check_program(program, settings);
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.error().limit, Limit::trigger_delay);
    EXPECT_EQ(refused.error().asked, most_us + 1);
    EXPECT_EQ(refused.error().allowed, most_us);
    program.trigger_delay_us = 99;
    EXPECT_EQ(check_program(program, settings).error().limit, Limit::trigger_delay);
  }
  EXPECT_EQ(first_step_us({Waveform::hold, 1, 20'000'000, 0, 1'200'000}, settings), 0U);
  // The first of 2567 parabolic microsteps: √(1/(8 · 5134)) of the period.
  EXPECT_EQ(first_step_us({Waveform::parabolic, 1, 20'000'000, 0, 1'200'000}, settings), 5'922U);
}

TEST(PlanCheck, TheOffendingSegmentIsNamed) {
  Program program = program_of(kPaper);
  program.segments[program.size++] = {Waveform::parabolic, 1, 40'000'000, 0, 300'000};
  const auto checked = check_program(program, Settings(wire::Configure::example()));
  ASSERT_FALSE(checked.ok());
  EXPECT_EQ(checked.error().segment, 1);
  EXPECT_EQ(checked.error().limit, Limit::acceleration);
}

TEST(PlanCheck, EmptyProgramAndMissingWaveform) {
  EXPECT_EQ(check_program(Program{}, Settings(wire::Configure::example())).error().refusal,
            Refusal::no_program);
  Segment uploaded = kPaper;
  uploaded.waveform = Waveform::uploaded;
  EXPECT_EQ(refusal_of(uploaded).refusal, Refusal::waveform_missing);
}

/// The rig's hose, 5 m of 12 mm, with water: 64/Re and Blasius for 1 L/s, K = 1.5 at its ends, and a cavity at 6 kPa.
wire::Configure with_losses() {
  wire::Configure configure = wire::Configure::example();
  configure.laminar_Pa = 9'824;
  configure.turbulent_Pa = 285'500;
  configure.minor_Pa = 58'640;
  configure.cavity_Pa = 6'000;
  return configure;
}

TEST(PlanCheck, FrictionEndLossesAndTheCavityCountTowardsThePressure) {
  const Segment hard{Waveform::parabolic, 10, 200'000'000, 0, 1'400'000};
  EXPECT_EQ(refusal_of(hard).refusal, Refusal::none) << "inertia alone: 72 of 79.3 kPa";
  const PlanRefusal refusal = refusal_of(hard, with_losses());
  EXPECT_EQ(refusal.refusal, Refusal::limit_exceeded);
  EXPECT_EQ(refusal.limit, Limit::pressure);
  // 571 mL/s: 72 kPa inertia, 107 kPa friction, 19 kPa end losses, 6 kPa cavity.
  EXPECT_NEAR(static_cast<double>(refusal.asked), 72e3 + 107.3e3 + 19.1e3 + 6e3, 500);
  EXPECT_EQ(refusal.allowed, 79'300);
  EXPECT_EQ(refusal_of(kPaper, with_losses()).refusal, Refusal::none);
}

TEST(PlanCheck, LossesAreThoseOfTheLargerFrictionRoundedUp) {
  const Settings settings(with_losses());
  EXPECT_EQ(settings.losses_Pa(0), 0U);
  for (const std::uint32_t flow_uL_per_s : {10U, 1'000U, 20'000U, 133'334U, 571'429U, 1'860'000U}) {
    const double q = 1e-6 * flow_uL_per_s;
    const double expected = std::max(9'824 * q, 285'500 * std::pow(q, 1.75)) + 58'640 * q * q;
    EXPECT_NEAR(settings.losses_Pa(flow_uL_per_s), expected, 1 + 1e-5 * expected) << flow_uL_per_s;
  }
}

TEST(PlanCheck, RampsAndHandsKeepWithinTheFlowThatTheLossesAllow) {
  const Settings settings(with_losses());
  const double allowed_uL_per_s = static_cast<double>(settings.allowed_steps_per_s()) * 7.791649;
  EXPECT_NEAR(settings.losses_Pa(static_cast<std::uint64_t>(allowed_uL_per_s)) + 6'000.0, 79'300, 10);
  EXPECT_LT(settings.ramp_steps_per_s(), Settings(wire::Configure::example()).ramp_steps_per_s());
}

}  // namespace
}  // namespace diastole::firmware
