// Faults of the board, with the image that is flashed in the emulator: with the full counts only, as each trial executes
// the controller's instructions. (The quick tests of the same things: test_step_path, test_sim_board_flashing.)

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/faults/fault_table.hpp"
#include "tests/sanitized.hpp"
#include "tests/tools/benchmarks/image.hpp"
#include "tests/tools/benchmarks/random_cuts.hpp"
#include "tests/tools/sim_board/flash_bench.hpp"
#include "tests/tools/sim_board/flash_history.hpp"

namespace diastole::faults {
namespace {

#define NEEDS_FULL_COUNTS() \
  if (trials(0, 1) == 0 || sanitized) GTEST_SKIP() << "with the full counts only (DIASTOLE_FAULTS=full)"

TEST(Faults, EmergencyStopAndLimits) {
  NEEDS_FULL_COUNTS();
  NEEDS_IMAGE();
  constexpr uint64_t shortest_step_period_ns = 5'000;
  const int tried = trials(0, 1000);
  const auto figures = step_path_test::cut_at_random(tried, 3);
  const bool held = figures.most_steps_over <= 1 && figures.worst_ns <= shortest_step_period_ns;
  add_to_table({"e-stop, limit switches", "random phases, the line flooded", tried, held ? figures.cuts : 0,
                fmt::format("one step at most, {} ns after the input; latched", figures.worst_ns)});
}

TEST(Faults, PowerCutsWhileFlashing) {
  NEEDS_FULL_COUNTS();
  using namespace sim_board_test;
  NEEDS_UPDATE_IMAGES();
  FlashBench bench;
  ASSERT_EQ(bench.runs(), "0.1.0 confirmed");
  FlashHistory history(bench.board());
  ASSERT_TRUE(bench.flash(newer_update).verified);
  bench.board().on_flash_change({});
  const int tried = trials(0, 300);
  const int survived = survivors(tried, [&](int k, std::mt19937& random) {
    bench.board().power_off();
    const size_t cut = 1 + random() % history.operations();
    put_flash(bench.board(), history.cut_at(cut, k % 2 == 0 ? nullptr : &random));
    bench.power_cycle();
    const auto running = bench.running();
    return running && running->slot != wire::ImageSlot::none &&
           verifies(bench.board().flash(), running->slot);
  });
  add_to_table(
      {"power cut while flashing",
       fmt::format("{} of {} flash operations, cells arbitrary in half of them", tried, history.operations()),
       tried, survived, "0 unbootable, 0 unverified images started"});
}

}  // namespace
}  // namespace diastole::faults
