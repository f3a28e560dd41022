#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <vector>

#include "firmware/core/r_wave.hpp"
#include "tests/firmware/bench.hpp"
#include "tests/firmware/every_profile.hpp"

namespace diastole::firmware {
namespace {

using wire::Waveform;

std::vector<Edge> edges_of(const std::vector<Edge>& all, Signal signal) {
  std::vector<Edge> some;
  for (const Edge& edge : all)
    if (edge.signal == signal) some.push_back(edge);
  return some;
}

class RWave : public testing::TestWithParam<std::uint32_t> {};

TEST_P(RWave, IsATriangleOfTheHeightAsked) {
  const std::uint32_t peak_uV = GetParam();
  const RWaveCodes codes = r_wave_codes(peak_uV);
  const std::size_t peak = kRWaveSamples / 2 - 1;
  EXPECT_NEAR(r_wave_uV(codes[peak]), peak_uV, 0.02 * peak_uV);
  EXPECT_EQ(codes.back(), 0);
  EXPECT_LE(codes[peak], kDacFullScale);
  constexpr double code_uV = double{kDacFullScale_uV} / kDacFullScale / kRWaveDivider;
  for (std::size_t i = 0; i < kRWaveSamples; ++i) {
    const double height = static_cast<double>(i <= peak ? i + 1 : kRWaveSamples - 1 - i) / 150;
    EXPECT_NEAR(r_wave_uV(codes[i]), height * peak_uV, code_uV) << i;
  }
  for (std::size_t i = 1; i <= peak; ++i)
    EXPECT_EQ(codes[peak - i], codes[peak + i]);
}

INSTANTIATE_TEST_SUITE_P(Heights, RWave, testing::Values(1'000U, 20'000U, 26'000U));

TEST(RWaveLength, IsThatOfTheSettingsToATickASample) {
  EXPECT_EQ(r_wave_sample_period(30'000), microseconds(100));
  for (const std::uint32_t length_us : {10'000U, 30'000U, 60'000U, 12'345U})
    EXPECT_NEAR(static_cast<double>((r_wave_sample_period(length_us) * std::int64_t{kRWaveSamples}).count),
                84.0 * length_us, kRWaveSamples / 2.0);
}

TEST(Trigger, TtlAndRWaveStartWithTheFirstStepOfEachCycle) {
  Bench bench;
  bench.prepare();
  bench.add_segment(Waveform::parabolic, 6, 40'000'000, 1'200'000);
  bench.add_segment(Waveform::sinusoidal, 5, 16'000'000, 800'000, 4'000'000);
  (void)bench.rig.take_edges();
  wire::Arm arm = wire::Arm::example();
  arm.gate_every = 2;
  arm.ttl_width_us = 5'000;
  bench.run_program(arm);
  const auto edges = bench.rig.take_edges();

  std::vector<Ticks> rises;
  Ticks rise{0};
  for (const Edge& edge : edges_of(edges, Signal::TTL)) {
    if (edge.value == 1)
      rises.push_back(rise = edge.tick);
    else
      EXPECT_EQ((edge.tick - rise).count, microseconds(5'000).count);
  }
  ASSERT_EQ(rises.size(), 11U);
  ASSERT_EQ(bench.heard.triggers.size(), 11U);
  EXPECT_EQ(bench.heard.ended.at(0).triggers, 11U);
  EXPECT_EQ(bench.heard.ended.at(0).r_waves, 6U);

  std::map<std::int64_t, bool> step_rises;
  bool inflating = true;  // homing ends that way
  for (const Edge& edge : edges) {
    if (edge.signal == Signal::DIR) inflating = edge.value != 0;
    if (edge.signal == Signal::STEP && edge.value == 1) step_rises[edge.tick.count] = inflating;
  }
  std::vector<Ticks> r_wave_starts;
  const auto r_wave = edges_of(edges, Signal::RWAVE_uV);
  for (std::size_t i = 0; i < r_wave.size(); ++i)
    if (i == 0 || r_wave[i - 1].value == 0) r_wave_starts.push_back(r_wave[i].tick);
  ASSERT_EQ(r_wave_starts.size(), 6U);

  for (std::size_t cycle = 0; cycle < rises.size(); ++cycle) {
    const auto step = step_rises.find(rises[cycle].count);
    ASSERT_NE(step, step_rises.end()) << "TTL of cycle " << cycle << " has no step at its tick";
    EXPECT_TRUE(step->second);
    const auto before = step == step_rises.begin() ? step : std::prev(step);
    if (cycle % 6 != 0) {
      EXPECT_FALSE(before->second) << "not the first step of the cycle";
    }
    EXPECT_EQ(bench.heard.triggers[cycle].tick, on_wire(rises[cycle]));
    EXPECT_EQ(bench.heard.triggers[cycle].cycle, cycle);
    EXPECT_EQ(bench.heard.triggers[cycle].r_wave, cycle % 2 == 0 ? 1 : 0);
    if (cycle % 2 == 0) {
      EXPECT_EQ(r_wave_starts[cycle / 2], rises[cycle]);
    }
  }
}

/// In pieces, so that the edges of six minutes need not be kept.
TEST(Trigger, TtlAndRWaveStartWithTheFirstStepOverTenThousandCycles) {
  constexpr std::uint32_t kCycles = 10'000;
  constexpr std::int64_t kCycleSteps = 2 * 13;
  Bench bench;
  bench.prepare();
  bench.add_segment(Waveform::parabolic, kCycles, 101'292, 35'000);
  (void)bench.rig.take_edges();
  ASSERT_TRUE(bench.ask(wire::Arm::example()));
  ASSERT_TRUE(bench.ask(wire::Start{0, Bench::kLease}));
  std::vector<Ticks> triggers, first_steps, waves;
  std::int64_t steps = 0;
  std::int32_t wave_uV = 0;
  while (bench.heard.ended.empty()) {
    bench.run_for(microseconds(1'000'000));
    for (const Edge& edge : bench.rig.take_edges()) {
      if (edge.signal == Signal::TTL && edge.value == 1) triggers.push_back(edge.tick);
      if (edge.signal == Signal::STEP && edge.value == 1 && steps++ % kCycleSteps == 0)
        first_steps.push_back(edge.tick);
      if (edge.signal != Signal::RWAVE_uV) continue;
      if (wave_uV == 0) waves.push_back(edge.tick);
      wave_uV = edge.value;
    }
  }
  EXPECT_EQ(bench.heard.ended[0].triggers, kCycles);
  EXPECT_EQ(bench.heard.ended[0].r_waves, kCycles);
  EXPECT_EQ(steps, kCycles * kCycleSteps);
  EXPECT_EQ(triggers, first_steps);
  EXPECT_EQ(waves, first_steps);
}

TEST(Trigger, AHoldTriggersAtTheBeginningOfEachCycle) {
  Bench bench;
  bench.prepare();
  bench.add_segment(Waveform::hold, 3, 5'000'000, 400'000, 1'000'000);
  (void)bench.rig.take_edges();
  bench.run_program();
  const auto edges = bench.rig.take_edges();
  const Settings settings(wire::Configure::example());
  Program program;
  program.size = 1;
  program.segments[0] = {Waveform::hold, 3, 5'000'000, 1'000'000, 400'000};
  program.rest_us = wire::Arm::example().rest_us;
  const Ticks first = Ticks{static_cast<std::int64_t>(bench.heard.started.at(0).tick)} +
                      Planner::segment_offset(program, settings, 0);
  std::vector<Ticks> rises;
  for (const Edge& edge : edges_of(edges, Signal::TTL))
    if (edge.value == 1) rises.push_back(edge.tick);
  EXPECT_EQ(rises, (std::vector<Ticks>{first, first + microseconds(400'000), first + microseconds(800'000)}));
  for (const Edge& edge : edges_of(edges, Signal::STEP)) {
    EXPECT_TRUE(edge.tick < first || edge.tick > first + microseconds(1'200'000));
  }
  EXPECT_EQ(bench.heard.triggers.size(), 3U);
  EXPECT_EQ(bench.heard.ended.at(0).cycles, 3U);
  EXPECT_EQ(bench.heard.ended.at(0).position_microsteps, 0);
}

TEST(Trigger, EveryProfileTriggersOncePerPeriodWithItsFirstStep) {
  for (const NamedProfile& named : every_moving_profile()) {
    SCOPED_TRACE(named.name);
    Bench bench;
    bench.prepare();
    if (named.uploaded != nullptr) bench.upload(0, named.uploaded->rises);
    bench.add_segment(named.waveform, 4, 8'000'000, 800'000);
    (void)bench.rig.take_edges();
    bench.run_program();
    std::vector<std::int64_t> steps, rises;
    for (const Edge& edge : bench.rig.take_edges()) {
      if (edge.signal == Signal::STEP && edge.value == 1) steps.push_back(edge.tick.count);
      if (edge.signal == Signal::TTL && edge.value == 1) rises.push_back(edge.tick.count);
    }
    ASSERT_EQ(rises.size(), 4U);
    ASSERT_EQ(steps.size() % 4, 0U);
    for (std::size_t i = 0; i < 4; ++i) {
      EXPECT_EQ(rises[i], steps[i * steps.size() / 4]);
      EXPECT_EQ(rises[i], rises[0] + static_cast<std::int64_t>(i) * microseconds(800'000).count);
    }
  }
}

std::vector<Ticks> rises_of(const std::vector<Edge>& edges, Signal signal) {
  std::vector<Ticks> rises;
  std::int32_t before = 0;
  for (const Edge& edge : edges_of(edges, signal)) {
    if (before == 0) rises.push_back(edge.tick);
    before = edge.value;
  }
  return rises;
}

/// Every waveform twice over, and a hold between.
void add_every_profile(Bench& bench) {
  for (const NamedProfile& named : every_profile()) {
    if (named.uploaded != nullptr) bench.upload(0, named.uploaded->rises);
    bench.add_segment(named.waveform, 2, 8'000'000, 800'000, 1'000'000);
  }
}

TEST(Trigger, MayComeADelayAfterTheFirstStepOfEachCycle) {
  std::vector<Ticks> at_once;
  for (const std::uint32_t delay_us : {0U, 100U, 350'000U, 700'001U}) {
    SCOPED_TRACE(delay_us);
    Bench bench;
    bench.prepare();
    add_every_profile(bench);
    (void)bench.rig.take_edges();
    wire::Arm arm = wire::Arm::example();
    arm.gate_every = 3;
    arm.ttl_width_us = 3'000;
    arm.trigger_delay_us = delay_us;
    bench.run_program(arm);
    const auto edges = bench.rig.take_edges();
    const Ticks start{static_cast<std::int64_t>(bench.heard.started.at(0).tick)};
    std::vector<Ticks> rises = rises_of(edges, Signal::TTL), waves = rises_of(edges, Signal::RWAVE_uV);
    const std::size_t cycles = 2 * every_profile().size();
    ASSERT_EQ(rises.size(), cycles);
    ASSERT_EQ(waves.size(), (cycles + 2) / 3);
    for (std::size_t i = 0; i < waves.size(); ++i)
      EXPECT_EQ(waves[i], rises[3 * i]);
    ASSERT_EQ(bench.heard.triggers.size(), cycles);
    for (std::size_t i = 0; i < cycles; ++i) {
      EXPECT_EQ(bench.heard.triggers[i].tick, on_wire(rises[i]));
      EXPECT_EQ(bench.heard.triggers[i].cycle, i);
      EXPECT_EQ(bench.heard.triggers[i].r_wave, i % 3 == 0 ? 1 : 0);
      rises[i] = rises[i] - start;
    }
    EXPECT_EQ(bench.heard.ended.at(0).triggers, cycles);
    EXPECT_EQ(bench.heard.ended.at(0).r_waves, waves.size());
    EXPECT_EQ(bench.heard.ended.at(0).cycles, cycles);
    if (delay_us == 0) at_once = rises;
    for (std::size_t i = 0; i < cycles; ++i)
      EXPECT_EQ(rises[i] - at_once[i], microseconds(delay_us)) << i;
  }
}

TEST(Trigger, ADelayedOneIsCountedOnlyIfItRose) {
  Bench bench;
  bench.prepare();
  bench.add_segment(Waveform::sinusoidal, 3, 8'000'000, 800'000);
  wire::Arm arm = wire::Arm::example();
  arm.rest_us = 100'000;
  arm.trigger_delay_us = 400'000;
  std::size_t fewest = 100, most = 0;
  for (int i = 0; i < 60; ++i) {
    SCOPED_TRACE(i);
    (void)bench.rig.take_edges();
    bench.heard = {};
    ASSERT_TRUE(bench.ask(arm));
    ASSERT_TRUE(bench.ask(wire::Start{0, Bench::kLease}));
    bench.run_for(microseconds(150'000 + 37'000 * i));
    ASSERT_TRUE(bench.ask(wire::StopNow{}));
    ASSERT_TRUE(bench.run_until([&] { return !bench.heard.ended.empty(); }, microseconds(3'000'000)));
    bench.run_for(microseconds(900'000));
    const auto rises = rises_of(bench.rig.take_edges(), Signal::TTL);
    EXPECT_EQ(bench.heard.ended[0].triggers, rises.size());
    EXPECT_EQ(bench.heard.ended[0].r_waves, rises.size());
    ASSERT_EQ(bench.heard.triggers.size(), rises.size());
    for (const Ticks rise : rises)
      EXPECT_LE(on_wire(rise), bench.heard.ended[0].tick);
    fewest = std::min(fewest, rises.size());
    most = std::max(most, rises.size());
  }
  EXPECT_EQ(fewest, 0U);
  EXPECT_GE(most, 2U);
}

TEST(Pins, DirectionIsSetUpBeforeTheStepAndPulsesHaveTheirWidth) {
  Bench bench;
  bench.prepare();
  bench.add_segment(Waveform::sinusoidal, 3, 20'000'000, 600'000);
  bench.run_program();
  Ticks direction{-1'000'000}, rise{0}, fall{0};
  std::size_t steps = 0;
  for (const Edge& edge : bench.rig.take_edges()) {
    if (edge.signal == Signal::DIR) {
      EXPECT_GE(edge.tick, fall);
      direction = edge.tick;
    }
    if (edge.signal != Signal::STEP) continue;
    if (edge.value == 1) {
      ASSERT_GE(edge.tick - direction, kDirectionSetup);
      rise = edge.tick;
      ++steps;
    } else {
      ASSERT_EQ((edge.tick - rise).count, kStepPulse.count);
      fall = edge.tick;
    }
  }
  EXPECT_GT(steps, 3U * 2 * 2567);
}

/// A TTL that does not rise is not counted, and its loss is told; with a delay too.
TEST(Trigger, ThatIsNotSeenToRiseIsLostAndNotCounted) {
  for (const std::uint32_t delay_us : {0U, 150'000U}) {
    RecordedController::Options options;
    options.board.triggers_until_broken = 4;
    Bench bench(options);
    bench.prepare();
    bench.add_segment(Waveform::parabolic, 10, 20'000'000, 1'000'000);
    wire::Arm arm = wire::Arm::example();
    arm.trigger_delay_us = delay_us;
    bench.run_program(arm);
    ASSERT_EQ(bench.heard.ended.size(), 1U) << delay_us;
    EXPECT_EQ(bench.heard.ended[0].triggers, 3U) << delay_us;
    EXPECT_EQ(bench.heard.ended[0].triggers_lost, 7U) << delay_us;
    EXPECT_EQ(bench.heard.ended[0].r_waves, 3U) << delay_us;
    ASSERT_EQ(bench.heard.triggers.size(), 10U) << delay_us;
    for (std::uint32_t cycle = 0; cycle < 10; ++cycle) {
      EXPECT_EQ(bench.heard.triggers[cycle].cycle, cycle);
      EXPECT_EQ(bench.heard.triggers[cycle].seen, cycle < 3 ? 1 : 0) << cycle;
    }
  }
}

/// Polarity, height and length come from the settings in flash.
TEST(Trigger, LooksAsTheSettingsSay) {
  Bench bench;
  bench.connect();
  wire::WriteSettings write;
  write.settings.ttl_active_low = 1;
  write.settings.r_wave_uV = 10'000;
  write.settings.r_wave_us = 60'000;
  ASSERT_TRUE(bench.ask(write));
  bench.prepare();
  bench.add_segment(Waveform::parabolic, 3, 20'000'000, 1'000'000);
  bench.rig.take_edges();
  bench.run_program();
  const auto edges = bench.rig.take_edges();
  const auto ttl = edges_of(edges, Signal::TTL);
  ASSERT_EQ(ttl.size(), 6U);
  for (std::size_t i = 0; i < ttl.size(); ++i)
    EXPECT_EQ(ttl[i].value, i % 2 == 0 ? 0 : 1) << "rests high, falls at the trigger";
  const auto wave = edges_of(edges, Signal::RWAVE_uV);
  ASSERT_FALSE(wave.empty());
  EXPECT_NEAR(std::ranges::max(wave, {}, &Edge::value).value, 10'000, 200);
  EXPECT_EQ((wave[299].tick - wave[0].tick).count, (r_wave_sample_period(60'000) * 299).count);
  EXPECT_EQ(wave[0].tick, ttl[0].tick);

  write.settings.r_wave_uV = 27'000;
  EXPECT_FALSE(bench.ask(write));
  EXPECT_EQ(bench.heard.naks.back().refusal, wire::Refusal::setting_out_of_range);
  EXPECT_EQ(bench.heard.naks.back().allowed, 26'000);
}

TEST(Trigger, RWavesOfSixtyMillisecondsNeedMoreRoom) {
  Bench bench;
  bench.connect();
  wire::WriteSettings write;
  write.settings.r_wave_us = 60'000;
  ASSERT_TRUE(bench.ask(write));
  bench.prepare();
  bench.add_segment(Waveform::parabolic, 3, 100'000, 50'000);
  EXPECT_FALSE(bench.ask(wire::Arm::example()));
  EXPECT_EQ(bench.heard.naks.back().limit, wire::Limit::r_wave_spacing);
  EXPECT_EQ(bench.heard.naks.back().allowed, 60'001);
}

}  // namespace
}  // namespace diastole::firmware
