// Faults of the chip that meet a run of the pump, with the image that is flashed in the emulator: with the full counts only. (The
// quick tests of the same things: test_chip_trouble.)

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <vector>

#include "protocol/contract/input_error.hpp"
#include "tests/faults/chip_trials.hpp"

namespace diastole::faults {
namespace {

using namespace sim_board_test;

std::vector<uint8_t> random_bytes(std::mt19937& random, size_t count) {
  std::vector<uint8_t> bytes(count);
  for (uint8_t& byte : bytes)
    byte = static_cast<uint8_t>(random() % 3 == 0 ? 0 : random());
  return bytes;
}

/// A nanosecond each for the two times of a difference.
bool same_times(const std::vector<int64_t>& a_ns, const std::vector<int64_t>& b_ns) {
  return std::ranges::equal(a_ns, b_ns, [](int64_t a, int64_t b) { return std::abs(a - b) <= 2; });
}

TEST(Faults, SerialNoise) {
  NEEDS_FULL_COUNTS_ON_CHIP();
  ChipRun quiet;
  quiet.go_on(10'000 * ms);
  const std::vector<int64_t> steps_ns = quiet.step_times_ns();
  ASSERT_TRUE(quiet.ended);
  ASSERT_GT(steps_ns.size(), 1'000U);
  uint64_t bursts = 0, rejected = 0;
  const int tried = trials(0, 40);
  const int survived = survivors(tried, [&](int, std::mt19937& random) {
    ChipRun run;
    const size_t longest = 1 + random() % 60;
    const double longest_gap_ms = between(random, 2, 60);
    try {
      while (!run.over) {
        run.bench.board().send_unframed(random_bytes(random, 1 + random() % longest));
        ++bursts;
        if (random() % 2 == 0) (void)run.bench.client.status();  // throws without an answer
        run.go_on(random_ns(random, 0, longest_gap_ms));
      }
      const wire::Status status = run.bench.client.status();
      rejected += status.crc_errors + status.framing_errors;
      return run.ended && run.ended->reason == wire::RunEnd::completed && status.fault == wire::Fault::none &&
             run.triggers == ChipRun::cycles && same_times(run.step_times_ns(), steps_ns) &&
             run.bench.board().statistics().missed_deadlines == 0;
    } catch (const HardwareError&) {
      return false;
    }
  });
  EXPECT_GT(rejected, bursts / 4);
  add_to_table({"serial noise", "bursts of bytes without stop bits in a run", tried, survived,
                fmt::format("every step at its time, every question answered; {} frames refused in {} bursts",
                            rejected, bursts)});
}

TEST(Faults, StuckDma) {
  NEEDS_FULL_COUNTS_ON_CHIP();
  constexpr uint32_t r_wave_stream = 5;
  constexpr uint64_t watchdog_ns = 250 * ms;
  uint64_t slowest_ns = 0;
  const int tried = trials(0, 40);
  const int survived = survivors(tried, [&](int, std::mt19937& random) {
    ChipRun run;
    run.go_on_into_second_cycle(random);
    if (run.over) return false;
    ChipBench& bench = run.bench;
    const size_t resets = bench.board().statistics().resets.size();
    const uint64_t stuck_ns = bench.desk.now_ns();
    bench.board().stick_dma(r_wave_stream);
    run.go_on(2 * ChipRun::period_ns + watchdog_ns);
    bench.pass(500 * ms);
    const BoardStatistics after = bench.board().statistics();
    if (after.resets.size() <= resets || after.resets[resets].cause != "watchdog") return false;
    const uint64_t reset_ns = after.resets[resets].time_ns;
    slowest_ns = std::max(slowest_ns, reset_ns - stuck_ns);
    const bool still = std::ranges::none_of(bench.desk.edges, [&](const sim_controller::PinEdge& edge) {
      return edge.pin == sim_controller::Pin::step && edge.time_ns > reset_ns;
    });
    const bool off = !bench.motor_is_on() && bench.board().dac_V(1, bench.desk.now_ns()) == 0;
    bench.connect();
    const bool fresh = bench.client.hello().reset_cause == wire::ResetCause::watchdog &&
                       bench.client.status().state == wire::State::unhomed;
    bench.client.home();
    return still && off && fresh;
  });
  // Nothing notices before the next R-wave is made ready, and that of the second trigger may have been already.
  EXPECT_LE(slowest_ns, 2 * ChipRun::period_ns + watchdog_ns + 10 * ms);
  add_to_table({"DMA stream hangs", "at a random moment of a run", tried, survived,
                fmt::format("outputs off {} ms later at most; unhomed after it", slowest_ns / ms)});
}

}  // namespace
}  // namespace diastole::faults
