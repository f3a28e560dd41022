// What the image keeps: settings in flash, also when power fails while they are written, and the black box over a reset.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "tests/tools/sim_board/built_firmware.hpp"
#include "tests/tools/sim_board/emulated_desk.hpp"

namespace diastole::sim_board_test {
namespace {

class Retained : public testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(firmware))
      GTEST_SKIP() << "no " << firmware << ": build the preset `firmware` first";
    desk = std::make_unique<EmulatedDesk>(firmware);
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

TEST_F(Retained, NoPowerCutWhileTheyAreWrittenLosesThem) {
  client->write_settings(numbered(1));
  int current = 1;
  for (uint64_t operation = 1; operation <= 36; ++operation) {
    SimBoard& board = desk->controller.board();
    board.cut_power_at_flash_operation(operation);
    bool whole = true;
    try {
      client->write_settings(numbered(current + 1));
    } catch (const HardwareError&) {
      whole = false;
    }
    board.cut_power_at_flash_operation(std::nullopt);
    board.power_cycle();
    connect();
    const int32_t found = client->settings().settings.backlash_nm;
    ASSERT_TRUE(found == current + 1 || (!whole && found == current)) << operation << ": " << found;
    ASSERT_GT(client->settings().records_written, 0U);
    current = found;
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
