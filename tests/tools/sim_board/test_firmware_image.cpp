// The controller's real image on the emulated board: it answers, runs a session, and makes the very edges
// that the same sources make when built for this machine.

#include <gmock/gmock.h>

#include <algorithm>
#include <filesystem>
#include <memory>

#include "tests/firmware/uploaded_waveform.hpp"
#include "tests/firmware/uploads.hpp"
#include "tests/tools/sim_board/built_firmware.hpp"
#include "tests/tools/sim_board/miniature_host.hpp"
#include "tools/sim_board/emulated_controller.hpp"
#include "tools/sim_rig/host_built_controller.hpp"

namespace diastole::sim_board_test {
namespace {

using sim_controller::Pin;
using sim_controller::PinEdge;
using ::testing::IsEmpty;

constexpr uint64_t s = 1'000'000'000;  // ns

#define NEEDS_FIRMWARE()                  \
  if (!std::filesystem::exists(firmware)) \
  GTEST_SKIP() << "no " << firmware << ": build the preset `firmware` first"

std::unique_ptr<EmulatedController> emulated() {
  return std::make_unique<EmulatedController>(std::vector{read_image(firmware)});
}

/// Edges since the controller was told to start, in ticks of its timer from the first step or TTL on.
struct TimedEdge {
  int64_t tick;
  Pin pin;
  int32_t value;
  bool operator==(const TimedEdge&) const = default;
};
std::ostream& operator<<(std::ostream& out, const TimedEdge& edge) {
  return out << edge.tick << ' ' << sim_controller::pin_name(edge.pin) << ' ' << edge.value;
}

std::vector<TimedEdge> in_ticks(const std::vector<PinEdge>& edges, bool r_wave) {
  const auto first = std::ranges::find_if(edges, [](const PinEdge& e) { return e.pin == Pin::ttl; });
  std::vector<TimedEdge> found;
  for (auto edge = edges.begin(); edge != edges.end(); ++edge) {
    if ((edge->pin == Pin::rwave_uV) != r_wave || edge->pin == Pin::enable) continue;
    const double since_ns = static_cast<double>(edge->time_ns) - static_cast<double>(first->time_ns);
    found.push_back({std::llround(since_ns * 0.084), edge->pin, edge->value});
  }
  std::ranges::stable_sort(found, {}, [](const TimedEdge& e) { return std::pair(e.tick, e.pin); });
  return found;
}

bool upload_heart(MiniatureHost& host) {
  return host.ask(diastole::firmware::upload_of(0, diastole::firmware::kHeartRises)) &&
         host.ask(diastole::firmware::lot_of(diastole::firmware::kHeartRises, 0));
}

/// Homes, then runs a short program, whose waveform 0 is the heart's; the edges of the run alone.
std::vector<PinEdge> run_session(sim_controller::SimulatedController& controller,
                                 const std::vector<wire::AddSegment>& program) {
  MiniatureHost host(controller);
  EXPECT_TRUE(host.prepare());
  EXPECT_TRUE(upload_heart(host));
  for (const wire::AddSegment& segment : program)
    EXPECT_TRUE(host.ask(segment));
  host.edges.clear();
  EXPECT_TRUE(host.run_program(60 * s));
  EXPECT_EQ(host.fault, wire::Fault::none);
  return std::move(host.edges);
}

wire::AddSegment segment(wire::Waveform waveform, uint32_t cycles, uint32_t stroke_nL, uint32_t period_us,
                         uint32_t offset_nL = 0) {
  return {0, waveform, cycles, stroke_nL, offset_nL, period_us, 0};
}

TEST(FirmwareImage, SaysHelloOverItsSerialPort) {
  NEEDS_FIRMWARE();
  auto board = emulated();
  MiniatureHost host(*board);
  ASSERT_TRUE(host.connect());
  EXPECT_EQ(host.hello->tick_rate_Hz, 84'000'000U);
  EXPECT_EQ(host.hello->reset_cause, wire::ResetCause::power_on);
  const BoardStatistics found = board->board().statistics();
  EXPECT_THAT(found.notes, IsEmpty()) << "registers used as the manual says";
  EXPECT_EQ(found.core_Hz, 168'000'000U);
}

TEST(FirmwareImage, ShortSessionGivesTheEdgesOfTheHostBuild) {
  NEEDS_FIRMWARE();
  const std::vector program{segment(wire::Waveform::parabolic, 2, 40'000'000, 1'200'000),
                            segment(wire::Waveform::sinusoidal, 2, 16'000'000, 800'000, 4'000'000),
                            segment(wire::Waveform::trapezoidal, 1, 8'000'000, 800'000),
                            segment(wire::Waveform::sawtooth, 1, 8'000'000, 800'000),
                            segment(wire::Waveform::reversed_sawtooth, 1, 8'000'000, 800'000),
                            segment(wire::Waveform::hold, 2, 2'000'000, 300'000, 1'000'000),
                            segment(wire::Waveform::uploaded, 2, 20'000'000, 1'200'000, 1'000'000)};
  auto built = sim_rig::make_host_built_controller();
  auto board = emulated();
  const auto expected = run_session(*built, program), found = run_session(*board, program);

  const auto expected_edges = in_ticks(expected, false), edges = in_ticks(found, false);
  ASSERT_EQ(edges.size(), expected_edges.size());
  ASSERT_GT(edges.size(), 30'000U);
  for (std::size_t i = 0; i < edges.size(); ++i)
    ASSERT_EQ(edges[i], expected_edges[i]) << "edge " << i;

  // The wave's first code leaves one timer tick after the TTL: TIM4 counts one before it updates.
  const auto expected_wave = in_ticks(expected, true), wave = in_ticks(found, true);
  ASSERT_EQ(wave.size(), expected_wave.size());
  for (std::size_t i = 0; i < wave.size(); ++i) {
    ASSERT_EQ(wave[i].value, expected_wave[i].value) << "code " << i;
    ASSERT_LE(std::abs(wave[i].tick - expected_wave[i].tick), 1) << "code " << i;
  }
  const BoardStatistics statistics = board->board().statistics();
  EXPECT_THAT(statistics.notes, IsEmpty());
  EXPECT_EQ(statistics.serial_overruns, 0U);
  EXPECT_GT(statistics.stack_used_bytes, 500U);
  EXPECT_LE(statistics.stack_used_bytes, 4096U) << "the linker keeps 8 KB";
  EXPECT_EQ(statistics.missed_deadlines, 0U);
  // The end of a wave is served long before the DAC could ask for one code more (errata sheet ES0182 2.5.1).
  constexpr uint32_t end_of_wave = 16;
  const auto served = std::ranges::find(statistics.interrupts, end_of_wave, &InterruptStatistics::irq);
  ASSERT_NE(served, statistics.interrupts.end());
  EXPECT_LT(served->worst_latency_cycles, 10U * 168) << "10 us, a tenth of a code";
}

TEST(FirmwareImage, EstopCutsTheMotionWithinAStepPeriod) {
  NEEDS_FIRMWARE();
  auto board = emulated();
  MiniatureHost host(*board);
  ASSERT_TRUE(host.prepare());
  ASSERT_TRUE(host.ask(segment(wire::Waveform::parabolic, 5, 40'000'000, 1'200'000)));
  const uint64_t press_ns = host.now_ns() + 2 * s + 123'456'789;
  board->press_estop(press_ns);
  host.edges.clear();
  wire::Start start{};
  start.lease_id = MiniatureHost::lease;
  ASSERT_TRUE(host.ask(wire::Arm::example()));
  ASSERT_TRUE(host.ask(start));
  host.run_for(4 * s);
  EXPECT_EQ(host.state, wire::State::faulted);
  EXPECT_EQ(host.fault, wire::Fault::estop);
  uint64_t last_step_ns = 0;
  for (const PinEdge& edge : host.edges) {
    if (edge.pin == Pin::step && edge.value == 1) last_step_ns = edge.time_ns;
  }
  EXPECT_GT(last_step_ns, press_ns - 1'000'000);
  EXPECT_LT(last_step_ns, press_ns + 10'000) << "an interrupt's latency";
}

TEST(FirmwareImage, FaultsShowTheirNumberInThePinTrace) {
  NEEDS_FIRMWARE();
  auto board = emulated();
  MiniatureHost host(*board);
  ASSERT_TRUE(host.prepare());
  ASSERT_TRUE(host.ask(segment(wire::Waveform::parabolic, 2, 40'000'000, 1'200'000)));
  wire::Start start{};
  start.lease_id = MiniatureHost::lease;
  ASSERT_TRUE(host.ask(wire::Arm::example()));
  ASSERT_TRUE(host.ask(start));
  host.edges.clear();
  board->close_far_limit(host.now_ns() + 3 * s / 2);
  host.run_for(2 * s);
  ASSERT_EQ(host.fault, wire::Fault::limit_switch);
  const auto shown = std::ranges::find_if(host.edges, [](const PinEdge& e) { return e.pin == Pin::fault; });
  ASSERT_NE(shown, host.edges.end());
  EXPECT_EQ(shown->value, static_cast<int32_t>(wire::Fault::limit_switch));
}

TEST(FirmwareImage, RerunsAreEqual) {
  NEEDS_FIRMWARE();
  const std::vector program{segment(wire::Waveform::parabolic, 1, 20'000'000, 800'000)};
  auto one = emulated(), two = emulated();
  const auto a = run_session(*one, program), b = run_session(*two, program);
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    ASSERT_EQ(a[i].time_ns, b[i].time_ns);
    ASSERT_EQ(a[i].value, b[i].value);
  }
  EXPECT_EQ(one->board().statistics().instructions, two->board().statistics().instructions);
}

}  // namespace
}  // namespace diastole::sim_board_test
