#pragma once
// What trials with the image in the emulator share: when they run, and a run of the pump that something happens to.

#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <random>
#include <vector>

#include "host/config/experiment.hpp"
#include "tests/faults/fault_table.hpp"
#include "tests/sanitized.hpp"
#include "tests/tools/sim_board/chip_bench.hpp"

namespace diastole::faults {

#define NEEDS_FULL_COUNTS_ON_CHIP()                                                                       \
  if (trials(0, 1) == 0 || sanitized) GTEST_SKIP() << "with the full counts only (DIASTOLE_FAULTS=full)"; \
  if (!std::filesystem::exists(sim_board_test::firmware))                                                 \
  GTEST_SKIP() << "no " << sim_board_test::firmware << ": build the preset `firmware` first"

inline uint64_t random_ns(std::mt19937& random, double from_ms, double to_ms) {
  return static_cast<uint64_t>(1e6 * between(random, from_ms, to_ms));
}

/// Four cycles, by the daemon's own client, turn by turn.
class ChipRun {
 public:
  static constexpr uint32_t cycles = 4;
  static constexpr uint64_t period_ns = 400 * sim_board_test::ms;

  /// Homed and started. Throws HardwareError if the controller does not answer.
  ChipRun() {
    bench.connect();
    bench.client.home();
    for (int turns = 0; turns < 60'000 && bench.client.status().state == wire::State::homing; ++turns)
      bench.pass(sim_board_test::ms);
    (void)bench.client.load(parse_experiment(experiment, "chip.experiment.toml"));
    bench.desk.edges.clear();
    bench.client.start();
  }

  /// For at least `time_ns`, or until the run is over.
  void go_on(uint64_t time_ns) {
    const uint64_t until_ns = bench.desk.now_ns() + time_ns;
    while (!over && bench.desk.now_ns() < until_ns) {
      bench.pass(sim_board_test::ms);
      bench.client.service();
      take_events();
    }
  }
  /// At a moment of the cycle after the first trigger.
  void go_on_into_second_cycle(std::mt19937& random) {
    while (!over && triggers == 0)
      go_on(sim_board_test::ms);
    bench.pass(random_ns(random, 0, 1));
    go_on(random_ns(random, 0, 1e-6 * static_cast<double>(period_ns)));
  }
  void take_events() {
    for (const ControllerEvent& event : bench.client.take_events()) {
      if (std::holds_alternative<wire::Trigger>(event)) ++triggers;
      if (const auto* end = std::get_if<wire::RunEnded>(&event)) ended = *end;
      over = over || ended || std::holds_alternative<LinkBroken>(event);
    }
  }
  /// Rises of STEP, counted in time from the first rise of the TTL.
  [[nodiscard]] std::vector<int64_t> step_times_ns() const {
    std::optional<uint64_t> zero_ns;
    std::vector<int64_t> times_ns;
    for (const sim_controller::PinEdge& edge : bench.desk.edges)
      if (edge.pin == sim_controller::Pin::ttl && edge.value == 1 && !zero_ns) zero_ns = edge.time_ns;
    for (const sim_controller::PinEdge& edge : bench.desk.edges)
      if (edge.pin == sim_controller::Pin::step && edge.value == 1)
        times_ns.push_back(static_cast<int64_t>(edge.time_ns) - static_cast<int64_t>(zero_ns.value_or(0)));
    return times_ns;
  }

  sim_board_test::ChipBench bench;
  std::optional<wire::RunEnded> ended;
  uint32_t triggers = 0;
  bool over = false;

 private:
  static constexpr const char* experiment = R"(
format = "diastole-experiment"
version = 1
sample_rate_Hz = 300
rest_s = 0.1
[[segment]]
waveform = "parabolic"
stroke_mL = 5.0
period_s = 0.4
cycles = 4
)";
};

}  // namespace diastole::faults
