// What silicon does and programs seldom meet, with the real image: supply too low, the wrong crystal or none, a processor
// fault, a stack that runs over, a jump into RAM, an old revision of the chip.

#include <gmock/gmock.h>

#include <gtest/gtest.h>
#include <utility>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <iostream>

#include "host/controller/controller_words.hpp"
#include "protocol/contract/input_error.hpp"
#include "tests/tools/sim_board/chip_bench.hpp"
#include "tests/tools/sim_board/late_trigger.hpp"
#include "tests/tools/sim_board/miniature_host.hpp"

namespace diastole::sim_board_test {
namespace {

using ::testing::HasSubstr;

class ChipFaults : public testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(firmware))
      GTEST_SKIP() << "no " << firmware << ": build the preset `firmware` first";
  }
  void power(SimBoardOptions options = {}) { bench = std::make_unique<ChipBench>(options); }
  [[nodiscard]] SimBoard& board() { return bench->board(); }
  [[nodiscard]] ControllerClient& client() { return bench->client; }
  /// Has the patched serial interrupt run, and waits until the start after the watchdog's reset.
  void crash_in_the_serial_interrupt() {
    board().send(std::vector<uint8_t>{0});
    bench->pass(5 * ms);
    EXPECT_FALSE(bench->motor_is_on());
    bench->restore();
    bench->connect(1'500);
  }

  std::unique_ptr<ChipBench> bench;
};

TEST_F(ChipFaults, TheBootloaderSetsBrownOutLevelThreeAndProtectsItselfOnce) {
  power();
  bench->connect();
  EXPECT_EQ(board().option_bytes() & 0xc, 0U) << "BOR level 3";
  EXPECT_EQ(board().option_bytes() >> 16 & 0xfff, 0xffeU) << "sector 0";
  const auto resets = board().statistics().resets.size();
  const auto operations = board().statistics().flash_operations;
  board().power_cycle();
  bench->connect();
  EXPECT_EQ(board().statistics().flash_operations, operations);
  EXPECT_EQ(board().statistics().resets.size(), resets + 2) << "once is enough";
  EXPECT_THAT(board().statistics().notes, ::testing::IsEmpty());
}

TEST_F(ChipFaults, NoFlashIsWrittenWhileTheSupplyIsLow) {
  power();
  bench->connect();
  client().write_settings(ChipBench::numbered(1));
  const auto before = board().statistics().flash_operations;
  // Above the brown-out reset, below the detector's threshold as the supply falls, and as it rises.
  for (const uint32_t low_mV : {2'880U, 2'990U}) {
    board().set_supply_mV(low_mV);
    EXPECT_THROW(client().write_settings(ChipBench::numbered(2)), HardwareError) << low_mV;
  }
  EXPECT_EQ(board().statistics().flash_operations, before);
  EXPECT_EQ(board().marginal_words(), 0U);
  board().set_supply_mV(3'300);
  client().write_settings(ChipBench::numbered(3));
  EXPECT_EQ(client().settings().settings.backlash_nm, 3);
}

/// Between the thresholds of datasheet table 19: 2.83 V falling, 2.92 V rising.
TEST_F(ChipFaults, ABrownOutHoldsTheChipUntilTheSupplyIsWellAboveIt) {
  power();
  bench->connect();
  constexpr std::pair<uint32_t, bool> runs_at_mV[] = {{2'840, true},  {2'820, false}, {2'840, false},
                                                      {2'910, false}, {2'930, true},  {2'840, true}};
  for (const auto& [supply_mV, runs] : runs_at_mV) {
    board().set_supply_mV(supply_mV);
    EXPECT_EQ(board().powered(), runs) << supply_mV;
  }
  board().set_supply_mV(3'300);
  bench->connect();
  EXPECT_EQ(client().status().state, wire::State::unhomed);
}

/// At moments one after the other, and where a word was seen to begin being programmed, which takes 16 us.
TEST_F(ChipFaults, ABrownOutAtAnyMomentHoldsTheChipAndLosesNoSettings) {
  constexpr int at_moments = 12, in_operations = 8;
  power({.cell_seed = 17});
  bench->connect();
  int current = 1;
  client().write_settings(ChipBench::numbered(current));
  for (int k = 0; k < at_moments + in_operations; ++k) {
    const uint64_t now_ns = bench->desk.now_ns();
    const auto dip = [this] {
      board().set_supply_mV(2'500);
      bench->desk.at(bench->desk.now_ns() + 3 * ms, [this] { board().set_supply_mV(3'300); });
    };
    uint64_t seen = board().statistics().flash_operations;
    if (k < at_moments) {
      bench->desk.at(now_ns + static_cast<uint64_t>(k) * 137'111, dip);
    } else {
      for (uint64_t after_ns = 0; after_ns < 4 * ms; after_ns += 5'000)
        bench->desk.at(now_ns + after_ns, [&, dip] {
          const uint64_t before = std::exchange(seen, board().statistics().flash_operations);
          if (before < seen && board().powered()) dip();
        });
    }
    bool whole = true;
    try {
      client().write_settings(ChipBench::numbered(current + 1));
    } catch (const HardwareError&) {
      whole = false;
    }
    bench->connect();
    const int32_t found = client().settings().settings.backlash_nm;
    ASSERT_TRUE(found == current + 1 || (!whole && found == current)) << k << ": " << found;
    current = found;
  }
  EXPECT_GE(board().statistics().flash_broken_off, in_operations / 2U);
}

TEST_F(ChipFaults, ABoardWithAnotherCrystalIsToldAndDoesNotMove) {
  for (const uint32_t crystal_Hz : {12'000'000U, 25'000'000U, 0U}) {
    power({.crystal_Hz = crystal_Hz});
    bench->connect(1'000);
    EXPECT_EQ(client().status().state, wire::State::faulted) << crystal_Hz;
    EXPECT_EQ(client().status().fault, wire::Fault::clock) << crystal_Hz;
    EXPECT_THROW(client().home(), HardwareError);
    EXPECT_THROW(client().clear_fault(), HardwareError);
    EXPECT_EQ(board().statistics().core_Hz, 168'000'000U) << "never beyond what the chip takes";
    EXPECT_THAT(board().statistics().notes, ::testing::IsEmpty());
  }
}

TEST_F(ChipFaults, ACrystalThatFailsStopsTheMotorAtOnceAndIsTold) {
  power();
  bench->connect();
  client().home();
  bench->pass(100 * ms);
  ASSERT_TRUE(bench->motor_is_on());
  board().fail_crystal();
  bench->pass(10'000);
  EXPECT_FALSE(bench->motor_is_on());
  bench->connect(1'500);
  EXPECT_EQ(client().status().fault, wire::Fault::clock);
  EXPECT_EQ(bench->crash()[wire::CrashRegister::exception], 2U) << "NMI: clock security";
}

TEST_F(ChipFaults, AProcessorFaultIsKeptThroughTheResetWithItsPlace) {
  power();
  bench->connect();
  bench->patch("USART3_IRQHandler", {0xde00});  // udf
  crash_in_the_serial_interrupt();
  auto registers = bench->crash();
  ASSERT_EQ(registers.size(), wire::kCrashRegisters);
  EXPECT_EQ(registers[wire::CrashRegister::exception], 6U) << "usage fault";
  EXPECT_EQ(registers[wire::CrashRegister::cfsr], 1U << 16) << "undefined instruction";
  EXPECT_EQ(bench->symbols.name_at(registers[wire::CrashRegister::pc]).value_or(""), "USART3_IRQHandler");
  EXPECT_GT(registers[wire::CrashRegister::cycles], 1'000'000U);
}

TEST_F(ChipFaults, AStackThatRunsOverMeetsItsGuard) {
  power();
  bench->connect();
  bench->patch("USART3_IRQHandler", {0xb4ff, 0xe7fd});  // push {r0-r7}; and again
  crash_in_the_serial_interrupt();
  auto registers = bench->crash();
  EXPECT_EQ(registers[wire::CrashRegister::exception], 4U) << "MemManage";
  EXPECT_EQ(registers[wire::CrashRegister::cfsr] & 0x92U, 0x92U)
      << "denied, at an address, not stacked either";
  EXPECT_EQ(registers[wire::CrashRegister::mmfar] & ~0xfffU, 0x2001'c000U);
  EXPECT_EQ(registers[wire::CrashRegister::pc], 0U) << "nothing was stacked, nothing is made up";
}

TEST_F(ChipFaults, AJumpIntoRamExecutesNothing) {
  power();
  bench->connect();
  bench->patch("USART3_IRQHandler",
               {0xf240, 0x1001, 0xf2c2, 0x0000, 0x4780});  // movw r0, #0x101; movt r0, #0x2000; blx r0
  crash_in_the_serial_interrupt();
  auto registers = bench->crash();
  EXPECT_EQ(registers[wire::CrashRegister::exception], 4U) << "MemManage";
  EXPECT_EQ(registers[wire::CrashRegister::cfsr] & 1U, 1U) << "execution denied";
}

TEST_F(ChipFaults, RevisionADoesNotPrefetch) {
  constexpr uint32_t prefetch = 1U << 8;
  power();
  bench->connect();
  EXPECT_EQ(board().flash_access_control() & prefetch, prefetch);
  power({.device_id = 0x2000'6411});
  bench->connect();
  EXPECT_EQ(board().flash_access_control() & prefetch, 0U);
  EXPECT_EQ(client().status().state, wire::State::unhomed);
}

TEST_F(ChipFaults, TheWatchdogWaitsForADebugger) {
  power();
  bench->connect();
  const auto resets = board().statistics().resets.size();
  board().hold_core(true);
  bench->pass(3'000 * ms);
  board().hold_core(false);
  bench->pass(200 * ms);
  EXPECT_EQ(board().statistics().resets.size(), resets) << "held for twelve of its periods";
  bench->patch("SysTick_Handler", {0xe7fe});  // for ever
  bench->pass(1'000 * ms);
  EXPECT_GT(board().statistics().resets.size(), resets) << "it is fed by nothing but the main loop";
  EXPECT_EQ(board().statistics().resets.at(resets).cause, "watchdog");
}

/// The compare value of a delayed trigger reaches TIM2 after its tick: it is raised late, and told with its own time.
TEST_F(ChipFaults, ATriggerThatComesTooLateIsRaisedAndToldWithItsOwnTime) {
  for (const uint64_t held_us : {50U, 150U, 400U}) {
    constexpr uint64_t before_us = 20;
    const HeldTriggers found = run_with_held_core(before_us * 1000, held_us * 1000);
    ASSERT_EQ(found.rises_ns.size(), HeldTriggers::cycles) << held_us;
    EXPECT_TRUE(found.reported()) << held_us;
    const int64_t due_us =
        static_cast<int64_t>(held_us) - static_cast<int64_t>(before_us + HeldTriggers::delay_us);
    if (due_us < 0) {
      EXPECT_EQ(found.late_ns(), 0) << held_us;
    } else {
      EXPECT_GT(found.late_ns(), due_us * 1000) << held_us;
      EXPECT_LT(found.late_ns(), (due_us + 10) * 1000) << held_us;
    }
  }
}

/// The match comes between two stores of those that order a trigger: to its compare value, its mode, its flag.
TEST_F(ChipFaults, ATriggerWhoseMatchComesWhileItIsOrderedRises) {
  constexpr uint32_t mode = 0x4000'0018, flag = 0x4000'0010, compare_value = 0x4000'0038;  // TIM2
  constexpr uint64_t stalled_us = 150;
  constexpr int64_t late_us = stalled_us - HeldTriggers::delay_us;
  for (const uint32_t store : {compare_value, mode, flag}) {
    const HeldTriggers found = run_with_stalled_store(store, stalled_us * 1000);
    ASSERT_EQ(found.rises_ns.size(), HeldTriggers::cycles) << std::hex << store;
    EXPECT_TRUE(found.reported()) << std::hex << store;
    if (store != compare_value) {
      EXPECT_EQ(found.late_ns(), 0) << std::hex << store;
    } else {
      EXPECT_GT(found.late_ns(), late_us * 1000) << "before the mode: it is raised behind the stall";
      EXPECT_LT(found.late_ns(), (late_us + 10) * 1000);
    }
  }
}

TEST_F(ChipFaults, ATtlPinThatIsHeldLowLosesEveryTriggerAndIsReported) {
  EmulatedController controller({read_image(firmware)});
  MiniatureHost host(controller);
  wire::AddSegment hold = wire::AddSegment::example();
  hold.waveform = wire::Waveform::hold;
  hold.cycles = 3;
  ASSERT_TRUE(host.prepare());
  ASSERT_TRUE(host.ask(hold));
  controller.board().short_pin(diastole_wiring().ttl.pin, false);
  ASSERT_TRUE(host.run_program(30'000 * ms));
  EXPECT_EQ(host.ended->reason, wire::RunEnd::completed);
  EXPECT_EQ(host.ended->triggers, 0U);
  EXPECT_EQ(host.ended->triggers_lost, hold.cycles);
  ASSERT_EQ(host.triggers.size(), hold.cycles);
  for (const wire::Trigger& trigger : host.triggers)
    EXPECT_EQ(trigger.seen, 0U) << trigger.cycle;
}

/// The emulated chip's first number after RNGEN is the same on every board.
TEST_F(ChipFaults, TheFirstRandomNumberIsDropped) {
  std::vector<uint32_t> boot_ids;
  for (const uint32_t seed : {1U, 2U, 3U}) {
    power({.random_seed = seed});
    bench->connect();
    boot_ids.push_back(client().hello().boot_id);
  }
  EXPECT_NE(boot_ids[0], boot_ids[1]);
  EXPECT_NE(boot_ids[1], boot_ids[2]);
}

/// Errata sheet ES0182 2.1.3 (Arm 838869).
TEST_F(ChipFaults, EveryHandlerHasItsStoresDoneBeforeItReturns) {
  power();
  constexpr uint16_t dsb[] = {0xf3bf, 0x8f4f};
  for (const std::string handler : {"TIM2_IRQHandler", "TIM5_IRQHandler", "EXTI_IRQHandler",
                                    "USART3_IRQHandler", "DMA1_Stream5_IRQHandler", "SysTick_Handler"}) {
    const std::optional<uint32_t> address = bench->symbols.address_of(handler);
    ASSERT_TRUE(address) << handler;
    std::vector<uint16_t> code;
    for (uint32_t at = *address; bench->symbols.name_at(at) == handler; at += 2) {
      uint16_t half = 0;
      std::memcpy(&half, board().flash().data() + (at - 0x0800'0000), sizeof half);
      code.push_back(half);
    }
    EXPECT_NE(std::search(code.begin(), code.end(), std::begin(dsb), std::end(dsb)), code.end()) << handler;
  }
}

TEST(ElfSymbolsOf, TheFirmwareFindFunctionsByAddressAndName) {
  if (!std::filesystem::exists(firmware)) GTEST_SKIP() << "no " << firmware;
  const ElfSymbols symbols(firmware);
  const auto address = symbols.address_of("USART3_IRQHandler");
  ASSERT_TRUE(address);
  EXPECT_EQ(symbols.name_at(*address + 1), "USART3_IRQHandler");
  EXPECT_FALSE(symbols.name_at(0x2000'0000));
  EXPECT_THROW(ElfSymbols("/dev/null"), InputError);
  EXPECT_THROW(ElfSymbols(DIASTOLE_SOURCE_DIR "/README.md"), InputError);
}

}  // namespace
}  // namespace diastole::sim_board_test
