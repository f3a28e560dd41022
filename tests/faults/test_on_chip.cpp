// Faults of the chip itself, with the image that is flashed in the emulator: with the full counts only. (The quick tests of the
// same things: test_chip_faults.)

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <vector>

#include "protocol/contract/input_error.hpp"
#include "tests/faults/chip_trials.hpp"
#include "tests/tools/sim_board/flash_bench.hpp"
#include "tests/tools/sim_board/flash_history.hpp"
#include "tests/tools/sim_board/late_trigger.hpp"

namespace diastole::faults {
namespace {

using namespace sim_board_test;

TEST(Faults, BrownOut) {
  NEEDS_FULL_COUNTS_ON_CHIP();
  int refused = 0;
  const int tried = trials(0, 100);
  const int survived = survivors(tried, [&](int k, std::mt19937& random) {
    ChipBench bench({.cell_seed = static_cast<uint32_t>(random())});
    bench.connect();
    bench.client.write_settings(ChipBench::numbered(1));
    const uint64_t dip_ns = bench.desk.now_ns() + random_ns(random, 0, 30);
    // Each fourth to what only the voltage detector reports; the others to the brown-out reset, down to where RAM forgets.
    const auto low_mV =
        static_cast<uint32_t>(k % 4 == 0 ? between(random, 2'831, 2'929) : between(random, 1'000, 2'829));
    bench.desk.at(dip_ns, [&bench, low_mV] { bench.board().set_supply_mV(low_mV); });
    bench.desk.at(dip_ns + random_ns(random, 1, 20), [&bench] { bench.board().set_supply_mV(3'300); });
    bool whole = true;
    try {
      bench.client.write_settings(ChipBench::numbered(2));
    } catch (const HardwareError&) {
      whole = false;
      ++refused;
    }
    bench.connect(1'000);
    const int32_t held = bench.client.settings().settings.backlash_nm;
    // A word in whose middle the reset came stays half written; none is begun below the detector's threshold.
    return (held == 2 || (!whole && held == 1)) &&
           bench.board().marginal_words() <= bench.board().statistics().flash_broken_off;
  });
  add_to_table({"supply dips", "to 1.0 … 2.93 V while settings are written", tried, survived,
                fmt::format("old settings or new, no word begun below 2.93 V; {} refused", refused)});
}

TEST(Faults, CutErase) {
  NEEDS_FULL_COUNTS_ON_CHIP();
  NEEDS_UPDATE_IMAGES();
  FlashBench updated;
  ASSERT_EQ(updated.runs(), "0.1.0 confirmed");
  ASSERT_TRUE(updated.flash(newer_update).verified);
  updated.power_cycle();
  ASSERT_TRUE(updated.flash(first_update, {.allow_older = true}).verified);
  // Slot B holds something now, so that it must be erased.
  const std::vector<uint8_t> before(updated.board().flash().begin(), updated.board().flash().end());
  const int tried = trials(0, 40);
  const int survived = survivors(tried, [&](int, std::mt19937& random) {
    FlashBench bench(factory_image, {.cell_seed = static_cast<uint32_t>(random())});
    if (bench.runs() != "0.1.0 confirmed") return false;  // and the option bytes are set
    bench.board().power_off();
    put_flash(bench.board(), before);
    bench.power_cycle();
    // The record of the erase and the erase itself are the first operations of the update.
    bench.board().cut_power_at_flash_operation(1 + random() % 6);
    try {
      (void)bench.flash(newer_update);
      return false;
    } catch (const HardwareError&) {
    }
    bench.board().cut_power_at_flash_operation({});
    bench.power_cycle();
    const auto running = bench.running();
    if (!running || running->slot == wire::ImageSlot::none) return false;
    if (!verifies(bench.board().flash(), running->slot)) return false;
    if (!bench.flash(newer_update).verified) return false;
    // Cells that are read anew at each reset may be left in the records, whose digests do not hold then; not in an image.
    for (int start = 0; start < 3; ++start) {
      bench.power_cycle();
      const auto again = bench.running();
      if (!again || again->slot == wire::ImageSlot::none || !verifies(bench.board().flash(), again->slot))
        return false;
    }
    return true;
  });
  add_to_table({"erase cut off", "power lost at its record or in it, cells arbitrary", tried, survived,
                "starts; the slot is erased again and takes the image"});
}

TEST(Faults, ProcessorFault) {
  NEEDS_FULL_COUNTS_ON_CHIP();
  constexpr std::array<const char*, 2> handlers{"USART3_IRQHandler", "SysTick_Handler"};
  const int tried = trials(0, 60);
  const int survived = survivors(tried, [&](int k, std::mt19937& random) {
    ChipBench bench;
    bench.connect();
    bench.client.home();
    bench.pass(random_ns(random, 50, 400));
    if (!bench.motor_is_on()) return false;
    const std::string function = handlers.at(static_cast<size_t>(k) % handlers.size());
    bench.patch(function, {0xde00});  // udf
    bench.board().send(std::vector<uint8_t>{0});
    bench.pass(5 * ms);
    const bool off = !bench.motor_is_on();
    bench.restore();
    bench.connect(1'500);
    auto registers = bench.crash();
    return off && registers[wire::CrashRegister::cfsr] == 1U << 16 &&
           bench.symbols.name_at(registers[wire::CrashRegister::pc]).value_or("") == function;
  });
  add_to_table({"processor fault", "an undefined instruction in a handler, homing", tried, survived,
                "motor off within 5 ms; the black box names the function"});
}

TEST(Faults, LateTrigger) {
  NEEDS_FULL_COUNTS_ON_CHIP();
  int late = 0;
  const int tried = trials(0, 60);
  const int survived = survivors(tried, [&](int, std::mt19937& random) {
    const HeldTriggers found = run_with_held_core(random_ns(random, 0, 0.2), random_ns(random, 0.001, 0.6));
    if (found.rises_ns.size() == HeldTriggers::cycles && found.late_ns() > 0) ++late;
    return found.reported() && found.rises_ns.size() == HeldTriggers::cycles;
  });
  EXPECT_GT(late, tried / 4);
  add_to_table({"late trigger", "the core held up to 0.6 ms about it", tried, survived,
                fmt::format("{} late, each reported with the time at its pin", late)});
}

TEST(Faults, CrystalFails) {
  NEEDS_FULL_COUNTS_ON_CHIP();
  uint64_t slowest_ns = 0;
  const int tried = trials(0, 60);
  const int survived = survivors(tried, [&](int, std::mt19937& random) {
    ChipBench bench;
    bench.connect();
    bench.client.home();
    bench.pass(random_ns(random, 50, 400));
    if (!bench.motor_is_on()) return false;
    const uint64_t failed_ns = bench.desk.now_ns();
    bench.board().fail_crystal();
    while (bench.motor_is_on() && bench.desk.now_ns() < failed_ns + 100'000)
      bench.pass(1'000);
    slowest_ns = std::max(slowest_ns, bench.desk.now_ns() - failed_ns);
    const bool off = !bench.motor_is_on();
    bench.connect(1'500);
    return off && bench.client.status().fault == wire::Fault::clock;
  });
  EXPECT_LE(slowest_ns, 10'000U);
  add_to_table({"crystal fails", "at random moments of homing", tried, survived,
                fmt::format("motor off within {} us; fault 10 after it", slowest_ns / 1000)});
}

/// Those that boards have, and none; the internal oscillator that they are measured by is told from them by 15 %.
TEST(Faults, AnotherCrystal) {
  NEEDS_FULL_COUNTS_ON_CHIP();
  constexpr std::array<uint32_t, 8> crystals_Hz{12'000'000, 25'000'000, 16'000'000, 10'000'000,
                                                4'000'000,  6'000'000,  26'000'000, 0};
  const auto refuses = [](auto&& order) {
    try {
      order();
      return false;
    } catch (const HardwareError&) {
      return true;
    }
  };
  const int tried = trials(0, 40);
  const int survived = survivors(tried, [&](int k, std::mt19937& random) {
    constexpr double most_ppm = 100;
    const double off = 1 + 1e-6 * between(random, -most_ppm, most_ppm);
    const uint32_t crystal_Hz = crystals_Hz.at(static_cast<size_t>(k) % crystals_Hz.size());
    ChipBench bench({.crystal_Hz = static_cast<uint32_t>(off * crystal_Hz)});
    for (int start = 0; start < 2; ++start) {
      bench.connect(1'000);
      bench.pass(random_ns(random, 0, 200));
      const wire::Status status = bench.client.status();
      if (status.state != wire::State::faulted || status.fault != wire::Fault::clock) return false;
      if (!refuses([&] { bench.client.home(); }) || !refuses([&] { bench.client.clear_fault(); }))
        return false;
      if (bench.board().statistics().core_Hz != 168'000'000) return false;
      random() % 2 == 0 ? bench.board().reset() : bench.board().power_cycle();
    }
    const bool moved = std::ranges::any_of(bench.desk.edges, [](const sim_controller::PinEdge& edge) {
      return edge.value == 1 &&
             (edge.pin == sim_controller::Pin::step || edge.pin == sim_controller::Pin::enable);
    });
    return !moved && bench.board().statistics().notes.empty();
  });
  add_to_table({"another crystal", "none, or 4 to 26 MHz in place of 8", tried, survived,
                "fault 10 and no motion, the core at 168 MHz, at each start"});
}

}  // namespace
}  // namespace diastole::faults
