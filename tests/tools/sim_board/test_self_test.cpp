// The real image measures itself over loop-back wires on the emulated board: a healthy one passes, and each fault that is
// planted fails its own check.

#include <gmock/gmock.h>

#include <cmath>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "host/controller/self_test.hpp"
#include "protocol/contract/input_error.hpp"
#include "tests/tools/sim_board/chip_bench.hpp"
#include "tools/sim_board/loop_back.hpp"

namespace diastole::sim_board_test {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::IsSupersetOf;
using wire::SelfTestItem;

class SelfTest : public testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(firmware))
      GTEST_SKIP() << "no " << firmware << ": build the preset `firmware` first";
  }
  /// A board that has just started, wired and connected.
  void power(const LoopBack& wires, SimBoardOptions options = {}) {
    bench = std::make_unique<ChipBench>(options);
    connect_loop_back(bench->board(), wires);
    bench->connect();
  }
  [[nodiscard]] ControllerClient& client() { return bench->client; }
  /// As the daemon asks for it; `clock_s` 0 leaves the clocks out.
  SelfTestReadings measure(double clock_s = 0) {
    SelfTestReadings readings;
    readings.tick_rate_Hz = client().hello().tick_rate_Hz;
    readings.supply = client().self_test(SelfTestItem::supply);
    for (const uint16_t code : self_test_codes)
      readings.levels.push_back(client().self_test(SelfTestItem::level, code));
    for (int i = 0; i < self_test_pulses; ++i)
      readings.pulses.push_back(client().self_test(SelfTestItem::pulse));
    readings.steps = client().self_test(SelfTestItem::steps, self_test_steps);
    client().take_events();
    for (const uint64_t end_ns = bench->desk.now_ns() + static_cast<uint64_t>(1e9 * clock_s);
         bench->desk.now_ns() < end_ns;) {
      bench->pass(ms);
      client().service();
      for (const ControllerEvent& event : client().take_events())
        if (const auto* reading = std::get_if<ClockReading>(&event))
          readings.clock.push_back({1e-9 * static_cast<double>(reading->host_ns),
                                    static_cast<double>(reading->tick) / readings.tick_rate_Hz,
                                    1e-9 * static_cast<double>(reading->half_round_trip_ns)});
    }
    return readings;
  }
  /// Names of the checks that did not pass; that of the clocks only if they were compared.
  static std::vector<std::string> failed(const SelfTestReadings& readings) {
    std::vector<std::string> names;
    for (const SelfTestCheck& check : judge(readings))
      if (!check.passed() && (check.name != "clock" || !readings.clock.empty())) names.push_back(check.name);
    return names;
  }

  std::unique_ptr<ChipBench> bench;
};

/// What a self-test might leave behind: modes, pulls and functions of pins, clock gates, the timers that it borrows.
std::map<uint32_t, uint32_t> registers(SimBoard& board) {
  std::map<uint32_t, uint32_t> found;
  for (const uint32_t address :
       {0x4002'0000U, 0x4002'000cU, 0x4002'0020U, 0x4002'0800U, 0x4002'080cU, 0x4002'3844U,
        0x4002'3824U, 0x4000'0018U, 0x4000'0020U, 0x4000'000cU, 0x4000'0c0cU, 0x4000'0c18U,
        0x4000'0c1cU, 0x4000'0c20U, 0x4000'0408U, 0x4000'0800U, 0x4000'0808U, 0x4000'7400U,
        0x4000'7408U, 0x4000'742cU, 0x4002'6088U, 0xe000'e104U})
    found[address] = board.peripheral_word(address);
  return found;
}

TEST_F(SelfTest, AHealthyBoardPassesAndIsLeftAsItWas) {
  power({});
  const wire::Status before = client().status();
  const auto registers_before = registers(bench->board());
  const SelfTestReadings readings = measure(10);
  for (const SelfTestCheck& check : judge(readings)) {
    EXPECT_TRUE(check.passed()) << check.name << ' ' << check.measured.value_or(std::nan(""));
    std::printf("%-32s %9.4g %-7s limits %.4g to %.4g\n", check.what.c_str(),
                check.measured.value_or(std::nan("")), check.unit.c_str(), check.least, check.most);
  }
  const wire::Status after = client().status();
  EXPECT_EQ(after.state, before.state);
  EXPECT_EQ(after.position_microsteps, before.position_microsteps);
  EXPECT_EQ(after.steps, before.steps);
  EXPECT_EQ(after.triggers, before.triggers);
  EXPECT_EQ(after.r_waves, before.r_waves);
  EXPECT_EQ(registers(bench->board()), registers_before);
  EXPECT_FALSE(bench->motor_is_on());
  EXPECT_EQ(bench->desk.controller.position_microsteps(), Mechanics().parked_microsteps);
  EXPECT_THAT(bench->board().statistics().notes, IsEmpty());
  EXPECT_EQ(bench->board().statistics().resets.size(), 3U)
      << "power, option bytes, the bootloader's leave: no watchdog";
}

/// What is wrong with a board, and the checks that then fail, and no other.
struct PlantedFault {
  const char* what;
  LoopBack wires;
  std::vector<std::string> failed;
};

TEST_F(SelfTest, EveryFaultFailsItsOwnChecksAndEveryCheckHasAFault) {
  const std::vector<std::string> levels{"level_10", "level_30", "level_50", "level_70", "level_90"};
  const PlantedFault planted[] = {
      {"no STEP wire", {.step = false}, {"step_seen", "step_skew", "step_jitter", "step_count"}},
      {"no TTL wire", {.ttl = false}, {"ttl_count", "ttl_late", "ttl_jitter", "step_skew", "step_jitter"}},
      {"no R-wave wire",
       {.r_wave = false},
       {"r_wave_late", "level_10", "level_30", "level_50", "level_70", "level_90"}},
      {"one step of two thousand lost", {.lost_step = 1000}, {"step_count"}},
      {"late TTL", {.ttl_delay_ns = 150}, {"ttl_late", "step_skew"}},
      {"TTL with jitter", {.ttl_jitter_ns = 40}, {"ttl_jitter", "step_skew", "step_jitter"}},
      {"STEP that trails the TTL", {.step_delay_ns = 100}, {"step_skew"}},
      {"STEP with jitter", {.step_jitter_ns = 40}, {"step_jitter"}},
      {"late R-wave", {.r_wave_delay_ns = 20'000}, {"r_wave_late"}},
      {"R-wave 50 mV too high", {.r_wave_offset_V = 0.05}, levels},
      {"R-wave 3 % too low", {.r_wave_gain = 0.97}, {"level_30", "level_50", "level_70", "level_90"}},
  };
  power({});
  std::set<std::string> never_failed;
  for (const SelfTestCheck& check : judge(measure()))
    never_failed.insert(check.name);
  // A check that had nothing to measure has not been tried.
  const auto fails = [&](const SelfTestReadings& readings, const std::vector<std::string>& expected) {
    EXPECT_EQ(failed(readings), expected);
    for (const SelfTestCheck& check : judge(readings))
      if (check.measured && !check.passed()) never_failed.erase(check.name);
  };
  for (const PlantedFault& fault : planted) {
    SCOPED_TRACE(fault.what);
    power(fault.wires);
    fails(measure(), fault.failed);
  }
  power({});
  bench->board().set_supply_mV(3'000);
  fails(measure(), {"supply"});
  power({}, {.crystal_Hz = 8'008'000});
  bench->desk.planted = "outside the datasheet";
  fails(measure(10), {"clock"});
  EXPECT_THAT(never_failed, IsEmpty());
}

TEST_F(SelfTest, ATtlThatComesTwiceIsSeen) {
  power({.ttl_bounces = true});
  EXPECT_THAT(failed(measure()), IsSupersetOf({"ttl_count"}));
}

/// Whichever level is the active one.
TEST_F(SelfTest, ATtlPinThatIsHeldLowIsSeen) {
  for (const bool active_low : {false, true}) {
    SCOPED_TRACE(active_low);
    power({});
    wire::MachineSettings settings;
    settings.ttl_active_low = active_low ? 1 : 0;
    client().write_settings(settings);
    bench->board().short_pin(diastole_wiring().ttl.pin, false);
    EXPECT_THAT(failed(measure()),
                ElementsAre("ttl_count", "ttl_late", "ttl_jitter", "step_skew", "step_jitter"));
  }
}

TEST_F(SelfTest, IsRefusedWhileTheMotorIsPoweredOrMoves) {
  power({});
  bench->client.home();
  EXPECT_THROW((void)client().self_test(SelfTestItem::pulse), HardwareError) << "homing";
  for (int i = 0; i < 60'000 && client().status().state == wire::State::homing; ++i)
    bench->pass(ms);
  ASSERT_EQ(client().status().state, wire::State::homed);
  const auto steps = client().status().steps;
  EXPECT_THROW((void)client().self_test(SelfTestItem::steps, 100), HardwareError) << "the motor holds";
  EXPECT_EQ(client().status().steps, steps);
}

TEST_F(SelfTest, RunsOnABareBoardWhoseEmergencyStopReadsPressed) {
  power({});
  bench->desk.controller.press_estop(bench->desk.now_ns());
  bench->pass(50 * ms);
  ASSERT_EQ(client().status().state, wire::State::faulted);
  EXPECT_THAT(failed(measure()), IsEmpty());
  EXPECT_EQ(client().status().fault, wire::Fault::estop);
}

TEST_F(SelfTest, GoesByTheTtlsPolarity) {
  power({});
  wire::MachineSettings settings;
  settings.ttl_active_low = 1;
  client().write_settings(settings);
  EXPECT_THAT(failed(measure()), IsEmpty());
}

}  // namespace
}  // namespace diastole::sim_board_test
