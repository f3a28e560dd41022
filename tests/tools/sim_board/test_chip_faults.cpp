// What silicon does and programs seldom meet, with the real image: supply too low, the wrong crystal or none, a processor
// fault, a stack that runs over, a jump into RAM, an old revision of the chip.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <filesystem>

#include "host/controller/controller_words.hpp"
#include "host/flash/elf_symbols.hpp"
#include "protocol/contract/input_error.hpp"
#include "tests/tools/sim_board/built_firmware.hpp"
#include "tests/tools/sim_board/emulated_desk.hpp"

namespace diastole::sim_board_test {
namespace {

using ::testing::HasSubstr;

const std::string elf = std::filesystem::path(firmware).replace_extension(".elf");

class ChipFaults : public testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(firmware))
      GTEST_SKIP() << "no " << firmware << ": build the preset `firmware` first";
    rig = read_rig(std::filesystem::path(DIASTOLE_SOURCE_DIR) / "examples/rig.toml");
  }
  void power(SimBoardOptions options = {}) {
    desk = std::make_unique<EmulatedDesk>(firmware, options);
    client = std::make_unique<ControllerClient>(*desk, rig,
                                                [this] { return std::make_unique<EmulatedLine>(*desk); });
  }
  void connect(uint64_t after_ms = 500) {
    desk->sleep_until_ns(desk->now_ns() + after_ms * ms, nullptr);
    client->connect();
  }
  [[nodiscard]] SimBoard& board() { return desk->controller.board(); }
  static wire::MachineSettings numbered(int number) {
    wire::MachineSettings settings;
    settings.backlash_nm = number;
    return settings;
  }
  /// Replaces the first instructions of a function of the running image.
  void patch(const std::string& function, const std::vector<uint16_t>& code) {
    const std::optional<uint32_t> address = ElfSymbols(elf).address_of(function);
    ASSERT_TRUE(address) << function;
    std::vector<uint8_t> bytes(2 * code.size());
    std::memcpy(bytes.data(), code.data(), bytes.size());
    const auto before = board().flash().subspan(*address - 0x0800'0000, bytes.size());
    replaced_.assign(before.begin(), before.end());
    replaced_at_ = *address;
    board().load(bytes, *address);
  }
  /// Puts back what was there, so that the image verifies again.
  void restore() { board().load(replaced_, replaced_at_); }
  /// Has the patched serial interrupt run, and waits until the start after the watchdog's reset.
  void crash_in_the_serial_interrupt() {
    board().send(std::vector<uint8_t>{0});
    desk->sleep_until_ns(desk->now_ns() + 5 * ms, nullptr);
    EXPECT_FALSE(board().level(diastole_wiring().enable.pin));
    restore();
    connect(1'500);
  }
  /// The registers of the crash that the black box tells.
  std::map<wire::CrashRegister, uint32_t> crash() {
    std::map<wire::CrashRegister, uint32_t> found;
    for (const wire::BlackBoxEntry& entry : client->black_box())
      if (entry.kind == wire::Noted::crash)
        found[static_cast<wire::CrashRegister>(entry.detail)] = static_cast<uint32_t>(entry.argument);
    return found;
  }

  std::vector<uint8_t> replaced_;
  uint32_t replaced_at_ = 0;
  std::unique_ptr<EmulatedDesk> desk;
  RigConfig rig;
  std::unique_ptr<ControllerClient> client;
};

TEST_F(ChipFaults, TheBootloaderSetsBrownOutLevelThreeAndProtectsItselfOnce) {
  power();
  connect();
  EXPECT_EQ(board().option_bytes() & 0xc, 0U) << "BOR level 3";
  EXPECT_EQ(board().option_bytes() >> 16 & 0xfff, 0xffeU) << "sector 0";
  const auto resets = board().statistics().resets.size();
  const auto operations = board().statistics().flash_operations;
  board().power_cycle();
  connect();
  EXPECT_EQ(board().statistics().flash_operations, operations);
  EXPECT_EQ(board().statistics().resets.size(), resets + 2) << "once is enough";
  EXPECT_THAT(board().statistics().notes, ::testing::IsEmpty());
}

TEST_F(ChipFaults, NoFlashIsWrittenWhileTheSupplyIsLow) {
  power();
  connect();
  client->write_settings(numbered(1));
  const auto before = board().statistics().flash_operations;
  board().set_supply_mV(2'750);  // above the brown-out reset, below the detector
  EXPECT_THROW(client->write_settings(numbered(2)), HardwareError);
  EXPECT_EQ(board().statistics().flash_operations, before);
  EXPECT_EQ(board().marginal_words(), 0U);
  board().set_supply_mV(3'300);
  client->write_settings(numbered(3));
  EXPECT_EQ(client->settings().settings.backlash_nm, 3);
}

TEST_F(ChipFaults, ABrownOutAtAnyMomentHoldsTheChipAndLosesNoSettings) {
  power();
  connect();
  int current = 1;
  client->write_settings(numbered(current));
  for (int k = 0; k < 12; ++k) {
    const uint64_t dip_ns = desk->now_ns() + static_cast<uint64_t>(k) * 137'111;
    desk->at(dip_ns, [this] { board().set_supply_mV(2'500); });
    desk->at(dip_ns + 3 * ms, [this] { board().set_supply_mV(3'300); });
    bool whole = true;
    try {
      client->write_settings(numbered(current + 1));
    } catch (const HardwareError&) {
      whole = false;
    }
    connect();
    const int32_t found = client->settings().settings.backlash_nm;
    ASSERT_TRUE(found == current + 1 || (!whole && found == current)) << k << ": " << found;
    current = found;
    EXPECT_EQ(board().marginal_words(), 0U) << k;
  }
}

TEST_F(ChipFaults, ABoardWithAnotherCrystalIsToldAndDoesNotMove) {
  for (const uint32_t crystal_Hz : {12'000'000U, 25'000'000U, 0U}) {
    power({.crystal_Hz = crystal_Hz});
    connect(1'000);
    EXPECT_EQ(client->status().state, wire::State::faulted) << crystal_Hz;
    EXPECT_EQ(client->status().fault, wire::Fault::clock) << crystal_Hz;
    EXPECT_THROW(client->home(), HardwareError);
    EXPECT_THROW(client->clear_fault(), HardwareError);
    EXPECT_EQ(board().statistics().core_Hz, 168'000'000U) << "never beyond what the chip takes";
    EXPECT_THAT(board().statistics().notes, ::testing::IsEmpty());
  }
}

TEST_F(ChipFaults, ACrystalThatFailsStopsTheMotorAtOnceAndIsTold) {
  power();
  connect();
  client->home();
  desk->sleep_until_ns(desk->now_ns() + 100 * ms, nullptr);
  ASSERT_TRUE(board().level(diastole_wiring().enable.pin));
  board().fail_crystal();
  desk->sleep_until_ns(desk->now_ns() + 10'000, nullptr);
  EXPECT_FALSE(board().level(diastole_wiring().enable.pin));
  connect(1'500);
  EXPECT_EQ(client->status().fault, wire::Fault::clock);
  EXPECT_EQ(crash()[wire::CrashRegister::exception], 2U) << "NMI: clock security";
}

TEST_F(ChipFaults, AProcessorFaultIsKeptThroughTheResetWithItsPlace) {
  power();
  connect();
  patch("USART3_IRQHandler", {0xde00});  // udf
  crash_in_the_serial_interrupt();
  auto registers = crash();
  ASSERT_EQ(registers.size(), wire::kCrashRegisters);
  EXPECT_EQ(registers[wire::CrashRegister::exception], 6U) << "usage fault";
  EXPECT_EQ(registers[wire::CrashRegister::cfsr], 1U << 16) << "undefined instruction";
  EXPECT_EQ(ElfSymbols(elf).name_at(registers[wire::CrashRegister::pc]).value_or(""), "USART3_IRQHandler");
  EXPECT_GT(registers[wire::CrashRegister::cycles], 1'000'000U);
}

TEST_F(ChipFaults, AStackThatRunsOverMeetsItsGuard) {
  power();
  connect();
  patch("USART3_IRQHandler", {0xb4ff, 0xe7fd});  // push {r0-r7}; and again
  crash_in_the_serial_interrupt();
  auto registers = crash();
  EXPECT_EQ(registers[wire::CrashRegister::exception], 4U) << "MemManage";
  EXPECT_EQ(registers[wire::CrashRegister::cfsr] & 0x92U, 0x92U)
      << "denied, at an address, not stacked either";
  EXPECT_EQ(registers[wire::CrashRegister::mmfar] & ~0xfffU, 0x2001'c000U);
  EXPECT_EQ(registers[wire::CrashRegister::pc], 0U) << "nothing was stacked, nothing is made up";
}

TEST_F(ChipFaults, AJumpIntoRamExecutesNothing) {
  power();
  connect();
  patch("USART3_IRQHandler",
        {0xf240, 0x1001, 0xf2c2, 0x0000, 0x4780});  // movw r0, #0x101; movt r0, #0x2000; blx r0
  crash_in_the_serial_interrupt();
  auto registers = crash();
  EXPECT_EQ(registers[wire::CrashRegister::exception], 4U) << "MemManage";
  EXPECT_EQ(registers[wire::CrashRegister::cfsr] & 1U, 1U) << "execution denied";
}

TEST_F(ChipFaults, RevisionADoesNotPrefetch) {
  constexpr uint32_t prefetch = 1U << 8;
  power();
  connect();
  EXPECT_EQ(board().flash_access_control() & prefetch, prefetch);
  power({.device_id = 0x2000'6411});
  connect();
  EXPECT_EQ(board().flash_access_control() & prefetch, 0U);
  EXPECT_EQ(client->status().state, wire::State::unhomed);
}

TEST(ElfSymbolsOf, TheFirmwareFindFunctionsByAddressAndName) {
  if (!std::filesystem::exists(elf)) GTEST_SKIP() << "no " << elf;
  const ElfSymbols symbols(elf);
  const auto address = symbols.address_of("USART3_IRQHandler");
  ASSERT_TRUE(address);
  EXPECT_EQ(symbols.name_at(*address + 1), "USART3_IRQHandler");
  EXPECT_FALSE(symbols.name_at(0x2000'0000));
  EXPECT_THROW(ElfSymbols("/dev/null"), InputError);
  EXPECT_THROW(ElfSymbols(DIASTOLE_SOURCE_DIR "/README.md"), InputError);
}

}  // namespace
}  // namespace diastole::sim_board_test
