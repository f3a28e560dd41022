// What the image keeps: settings in flash, also when power fails while they are written, and the black box over a reset.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <optional>
#include <vector>

#include "firmware/boards/stm32f405/memory_map.hpp"
#include "firmware/core/settings_store.hpp"
#include "protocol/contract/input_error.hpp"
#include "tests/tools/sim_board/built_firmware.hpp"
#include "tests/tools/sim_board/emulated_desk.hpp"

namespace diastole::sim_board_test {
namespace {

class Retained : public testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(firmware))
      GTEST_SKIP() << "no " << firmware << ": build the preset `firmware` first";
    power();
  }
  void power(SimBoardOptions options = {}) {
    client.reset();
    desk = std::make_unique<EmulatedDesk>(firmware, options);
    rig = read_rig(std::filesystem::path(DIASTOLE_SOURCE_DIR) / "examples/rig.toml");
    client = std::make_unique<ControllerClient>(*desk, rig,
                                                [this] { return std::make_unique<EmulatedLine>(*desk); });
    connect();
  }
  void connect() {
    desk->sleep_until_ns(desk->now_ns() + 50 * ms, nullptr);
    client->connect();
  }
  static wire::MachineSettings numbered(int number) {
    wire::MachineSettings settings;
    settings.backlash_nm = number;
    return settings;
  }
  /// False if the power went, in the middle of that flash operation, before they were acknowledged.
  bool write_with_power_cut(const wire::MachineSettings& settings, uint64_t operation) {
    SimBoard& board = desk->controller.board();
    board.cut_power_at_flash_operation(operation);
    bool whole = true;
    try {
      client->write_settings(settings);
    } catch (const HardwareError&) {
      whole = false;
    }
    board.cut_power_at_flash_operation(std::nullopt);
    return whole;
  }
  /// The number of the settings in force after another start.
  int32_t start_and_read() {
    desk->controller.board().power_cycle();
    connect();
    return client->settings().settings.backlash_nm;
  }
  [[nodiscard]] std::size_t count(wire::Noted kind) {
    const auto entries = client->black_box();
    return static_cast<std::size_t>(
        std::ranges::count_if(entries, [&](const wire::BlackBoxEntry& entry) { return entry.kind == kind; }));
  }

  std::unique_ptr<EmulatedDesk> desk;
  RigConfig rig;
  std::unique_ptr<ControllerClient> client;
};

TEST_F(Retained, SettingsOutliveAPowerCycle) {
  EXPECT_EQ(client->settings().records_written, 0U);
  client->write_settings(numbered(40'000));
  EXPECT_EQ(client->settings().settings.backlash_nm, 40'000);
  desk->controller.board().power_cycle();
  connect();
  EXPECT_EQ(client->settings().records_written, 1U);
  EXPECT_EQ(client->settings().settings, numbered(40'000));
  EXPECT_EQ(client->settings().backlash_microsteps, 40U);
}

/// Every operation, and every third with cells that keep an arbitrary part of their bits and read anew at each reset.
TEST_F(Retained, NoPowerCutWhileTheyAreWrittenLosesThem) {
  for (const std::optional<uint32_t> cell_seed : {std::optional<uint32_t>(), std::optional(2026U)}) {
    SCOPED_TRACE(cell_seed.value_or(0));
    power({.cell_seed = cell_seed});
    client->write_settings(numbered(1));
    int current = 1;
    for (uint64_t operation = 1; operation <= 36; operation += cell_seed ? 3 : 1) {
      SimBoard& board = desk->controller.board();
      const bool whole = write_with_power_cut(numbered(current + 1), operation);
      const size_t marginal = board.marginal_words();
      const int32_t found = start_and_read();
      ASSERT_TRUE(found == current + 1 || (!whole && found == current)) << operation << ": " << found;
      ASSERT_GT(client->settings().records_written, 0U);
      EXPECT_EQ(start_and_read(), found) << operation << ", " << marginal << " words that read anew";
      current = found;
    }
  }
}

/// The sector of the settings in force is full: the other one is erased for the next.
TEST_F(Retained, NoEraseThatIsCutOffLosesThem) {
  const stm32::FlashSector& full = stm32::kSettingsSectors[0];
  std::vector<uint8_t> records;
  int last = 0;
  while (records.size() < full.bytes) {
    const auto slot = firmware::encode_record({static_cast<uint32_t>(++last), numbered(last)});
    records.insert(records.end(), slot.begin(), slot.end());
  }
  for (uint32_t seed = 1; seed <= 4; ++seed) {
    SCOPED_TRACE(seed);
    power({.cell_seed = seed});
    SimBoard& board = desk->controller.board();
    board.power_off();
    board.load(records, full.address);
    board.load(std::vector<uint8_t>(stm32::kSettingsSectors[1].bytes, 0), stm32::kSettingsSectors[1].address);
    ASSERT_EQ(start_and_read(), last);
    EXPECT_FALSE(write_with_power_cut(numbered(last + 1), 1));
    EXPECT_GT(board.marginal_words(), 0U);
    EXPECT_EQ(start_and_read(), last);
    EXPECT_EQ(start_and_read(), last);
    client->write_settings(numbered(last + 1));
    EXPECT_EQ(board.marginal_words(), 0U) << "erased again, although it may read blank";
    EXPECT_EQ(start_and_read(), last + 1);
  }
}

TEST_F(Retained, TheBlackBoxOutlivesAResetAndIsEmptyAfterALossOfPower) {
  desk->controller.press_estop(desk->now_ns() + 5 * ms);
  desk->controller.press_estop(desk->now_ns() + 25 * ms, false);
  desk->sleep_until_ns(desk->now_ns() + 50 * ms, nullptr);
  desk->controller.board().reset();
  connect();
  const auto entries = client->black_box();
  ASSERT_FALSE(entries.empty());
  EXPECT_EQ(entries.back().boot, 2);
  EXPECT_EQ(count(wire::Noted::started), 2U);
  EXPECT_TRUE(std::ranges::any_of(entries, [](const wire::BlackBoxEntry& entry) {
    return entry.boot == 1 && entry.kind == wire::Noted::fault &&
           entry.detail == static_cast<uint8_t>(wire::Fault::estop);
  }));
  desk->controller.board().power_cycle();
  connect();
  EXPECT_EQ(client->black_box().front().number, 1U);
  EXPECT_EQ(count(wire::Noted::started), 1U);
}

}  // namespace
}  // namespace diastole::sim_board_test
