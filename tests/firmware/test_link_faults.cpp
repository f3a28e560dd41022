// What a bad line may not do: make the controller carry out anything that was not asked, or lose telemetry
// while the session lasts.

#include <gtest/gtest.h>

#include "tests/firmware/bench.hpp"

namespace diastole::firmware {
namespace {

using wire::RunEnd;
using wire::State;
using wire::Waveform;

class BadCable : public testing::TestWithParam<double> {};

TEST_P(BadCable, EverythingIsCarriedOutOnceAndNothingIsLost) {
  std::uint32_t errors = 0;
  for (unsigned seed = 1; seed <= 3; ++seed) {
    Bench bench;
    bench.random.seed(seed);
    bench.bit_error = GetParam();
    wire::Configure configure = wire::Configure::example();
    configure.lease_us = 3'000'000;
    bench.prepare(configure);
    ASSERT_EQ(bench.state(), State::homed);
    for (int i = 0; i < 4; ++i)
      bench.add_segment(Waveform::parabolic, 2, 10'000'000, 1'000'000);
    bench.run_program();
    ASSERT_EQ(bench.heard.ended.size(), 1U);
    EXPECT_EQ(bench.heard.ended[0].reason, RunEnd::completed);
    EXPECT_EQ(bench.heard.ended[0].cycles, 8U);
    EXPECT_EQ(bench.heard.started[0].segments, 4U) << "a segment was added twice or not at all";
    EXPECT_EQ(bench.heard.triggers.size(), 8U);
    EXPECT_TRUE(bench.heard.positions_contiguous);
    EXPECT_EQ(bench.heard.positions.size(), 2701U);
    EXPECT_TRUE(bench.heard.naks.empty());
    EXPECT_EQ(bench.heard.undecodable, 0U);
    errors += bench.rig.controller().link().counters().crc_errors + bench.link.counters().crc_errors;
  }
  EXPECT_GT(errors, 0U);
}

INSTANTIATE_TEST_SUITE_P(BitErrors, BadCable, testing::Values(1e-5, 1e-4, 3e-4));

TEST(HostileLine, RandomBytesMoveNothing) {
  Bench bench;
  bench.prepare();
  bench.add_segment(Waveform::parabolic, 1, 10'000'000, 1'000'000);
  ASSERT_TRUE(bench.ask(wire::Arm::example()));
  (void)bench.rig.take_edges();
  std::mt19937 random(9);
  std::vector<std::uint8_t> noise(2000);
  for (int i = 0; i < 200; ++i) {
    for (auto& byte : noise)
      byte = static_cast<std::uint8_t>((random() & 15U) == 0 ? 0U : random());
    bench.rig.feed(noise);
    bench.rig.advance_to(bench.rig.now() + microseconds(5'000));
  }
  EXPECT_TRUE(bench.rig.take_edges().empty());
  EXPECT_EQ(bench.state(), State::armed);
}

TEST(HostileLine, AFloodDoesNotDisturbTheMotion) {
  const auto run = [](bool flooded) {
    Bench bench;
    bench.prepare();
    bench.add_segment(Waveform::parabolic, 3, 40'000'000, 1'200'000);
    (void)bench.ask(wire::Arm::example());
    (void)bench.ask(wire::Start{0, Bench::kLease});
    (void)bench.rig.take_edges();
    const std::vector<std::uint8_t> flood(40, 0xA5);
    for (int i = 0; i < 4000; ++i) {
      if (flooded) {
        bench.rig.feed(flood);
        bench.rig.feed(std::vector<std::uint8_t>{0});
      }
      bench.run_for(microseconds(1'000));
    }
    std::vector<std::int64_t> ticks;
    for (const Edge& edge : bench.rig.take_edges())
      if (edge.signal == Signal::STEP) ticks.push_back(edge.tick.count);
    for (auto& tick : ticks)
      tick -= static_cast<std::int64_t>(bench.heard.started.at(0).tick);
    return ticks;
  };
  EXPECT_EQ(run(false), run(true));
}

TEST(Hello, OldHostsAreToldAndNothingElseIsAccepted) {
  Bench bench;
  bench.connect();
  ASSERT_EQ(bench.heard.hellos.size(), 1U);
  EXPECT_EQ(bench.heard.hellos[0].tick_rate_Hz, 84'000'000U);
  EXPECT_EQ(bench.heard.hellos[0].schema_hash, wire::kSchemaHash);
  bench.request(wire::HelloRequest{0, wire::kSchemaHash + 1, 0, 0, 1});
  bench.run_for(microseconds(50'000));
  EXPECT_EQ(bench.heard.hellos.size(), 2U);
  EXPECT_FALSE(bench.ask(wire::Configure::example()));
  EXPECT_EQ(bench.heard.naks.back().refusal, wire::Refusal::schema_mismatch);
}

TEST(Hello, ANewSessionMustSayHelloAgain) {
  Bench bench;
  bench.prepare();
  bench.link.open(4711, on_wire(bench.rig.now()) / 84);
  bench.run_until([&] { return bench.link.state() == wire::ReliableLink::State::open; },
                  microseconds(500'000));
  EXPECT_FALSE(bench.ask(wire::ClearProgram{}));
  EXPECT_EQ(bench.heard.naks.back().refusal, wire::Refusal::schema_mismatch);
}

TEST(Determinism, EqualInputGivesEqualPins) {
  const auto run = [] {
    Bench bench;
    bench.prepare();
    bench.add_segment(Waveform::sinusoidal, 2, 16'000'000, 900'000);
    bench.run_program();
    return bench.rig.take_edges();
  };
  EXPECT_EQ(run(), run());
}

}  // namespace
}  // namespace diastole::firmware
