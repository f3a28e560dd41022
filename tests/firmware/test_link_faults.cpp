// What a bad line may not do: make the controller carry out anything that was not asked, or lose telemetry
// while the session lasts.

#include <gtest/gtest.h>

#include <tuple>

#include "tests/firmware/bench.hpp"

namespace diastole::firmware {
namespace {

using wire::RunEnd;
using wire::State;
using wire::Waveform;

link_faults::FaultRates trouble(double bit_error) {
  return {.bit_error = bit_error,
          .byte_loss = bit_error,
          .frame_loss = 1e-3,
          .repetition = 1e-2,
          .reordering = 1e-2,
          .truncation = 1e-3};
}

void set_line(Bench& bench, const link_faults::FaultRates& rates) {
  bench.to_controller.set_rates(rates);
  bench.to_host.set_rates(rates);
}

class BadCable : public testing::TestWithParam<double> {};

TEST_P(BadCable, EverythingIsCarriedOutOnceAndNothingIsLost) {
  std::uint32_t errors = 0;
  for (unsigned seed = 1; seed <= 3; ++seed) {
    Bench bench;
    bench.to_controller = {trouble(GetParam()), 2 * seed};
    bench.to_host = {trouble(GetParam()), 2 * seed + 1};
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

auto numbers_of(const Segment& segment) {
  return std::tuple(segment.waveform, segment.cycles, segment.stroke_nL, segment.offset_nL,
                    segment.period_us);
}

/// Requests that a homed or armed controller answers without moving; what it must hold afterwards is kept beside
/// them.
class Requests {
 public:
  Requests(Bench& bench, unsigned seed) : bench_(bench), random_(seed) {}

  void next() {
    switch (random_() % 8) {
      case 0:
        bench_.request(wire::ClearProgram{});
        segments.clear();
        armed_ = false;
        break;
      case 1:
        bench_.request(wire::StatusRequest{});
        break;
      case 2:
        if (armed_ || segments.empty()) return;
        bench_.request(wire::Arm::example());
        armed_ = true;
        break;
      default:
        if (armed_ || segments.size() == Program::kMaxSegments) return;
        add();
    }
    expected.push_back({bench_.last_request(), wire::Refusal::none});
  }

  std::vector<Answer> expected;
  std::vector<Segment> segments;

 private:
  void add() {
    const wire::AddSegment add{0,
                               static_cast<Waveform>(random_() % 5),
                               1 + static_cast<std::uint32_t>(random_() % 500),
                               1'000'000 + static_cast<std::uint32_t>(random_() % 5'000'000),
                               static_cast<std::uint32_t>(random_() % 5'000'000),
                               900'000 + static_cast<std::uint32_t>(random_() % 1'000'000)};
    bench_.request(add);
    segments.push_back({add.waveform, add.cycles, add.stroke_nL, add.offset_nL, add.period_us});
  }

  Bench& bench_;
  std::mt19937 random_;
  bool armed_ = false;
};

class Campaign : public testing::TestWithParam<double> {};

TEST_P(Campaign, TheControllerCarriesOutWhatWasSentInOrderOnceAndUnaltered) {
  for (unsigned seed = 1; seed <= 2; ++seed) {
    Bench bench;
    bench.prepare();
    bench.to_controller = {trouble(GetParam()), 2 * seed};
    bench.to_host = {trouble(GetParam()), 2 * seed + 1};
    bench.heard.answers.clear();
    Requests requests(bench, seed);
    for (int spell = 0; spell < 20; ++spell) {
      set_line(bench, trouble(GetParam()));
      for (int i = 0; i < 30 && bench.link.room() > 0; ++i)
        requests.next();
      bench.run_for(microseconds(150'000));
      set_line(bench, {});
      ASSERT_TRUE(bench.run_until([&] { return bench.heard.answers.size() >= requests.expected.size(); },
                                  microseconds(1'000'000)))
          << "a good line brings what a bad one has kept";
      ASSERT_EQ(bench.heard.answers, requests.expected);
      const Program& program = bench.rig.controller().motion().program();
      ASSERT_EQ(program.size, requests.segments.size());
      for (std::size_t i = 0; i < program.size; ++i)
        ASSERT_EQ(numbers_of(program.segments[i]), numbers_of(requests.segments[i])) << i;
    }
    EXPECT_GT(requests.expected.size(), 100U);
    EXPECT_EQ(bench.heard.undecodable, 0U);
  }
}

INSTANTIATE_TEST_SUITE_P(BitErrors, Campaign, testing::Values(1e-5, 1e-4, 1e-3, 3e-3, 1e-2));

/// A request whose payload is cut is refused as malformed, once, and changes nothing.
TEST(HostileLine, EveryCutRequestIsRefused) {
  Bench bench;
  bench.prepare();
  const auto refused = [&](wire::MessageType type, std::span<const std::uint8_t> payload) {
    bench.heard.answers.clear();
    while (!bench.link.send(type, payload))
      bench.run_for(microseconds(1'000));
    bench.run_until([&] { return bench.link.idle() && !bench.heard.answers.empty(); }, microseconds(20'000));
    return bench.heard.answers == std::vector{Answer{0, wire::Refusal::malformed}};
  };
#define DIASTOLE_MESSAGE(number, name, sender, delivery)                                           \
  if (wire::sender_of(wire::MessageType::name) == wire::Sender::host &&                            \
      wire::delivery_of(wire::MessageType::name) == wire::Delivery::sequenced &&                   \
      !wire::for_bootloader(wire::MessageType::name)) {                                            \
    std::array<std::uint8_t, wire::kMaxPayloadBytes> memory{};                                     \
    const auto whole = wire::encode(wire::name::example(), memory);                                \
    for (std::size_t size = 0; size < whole.size(); ++size)                                        \
      EXPECT_TRUE(refused(wire::MessageType::name, whole.first(size))) << #name << " of " << size; \
  }
#include "protocol/wire/message_list.inc"
  EXPECT_EQ(bench.state(), State::homed);
}

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
