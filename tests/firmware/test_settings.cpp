// Settings over the wire: read, write, refusals, a reset in between, and what they bind.

#include <gtest/gtest.h>

#include "tests/firmware/bench.hpp"

namespace diastole::firmware {
namespace {

using wire::Refusal;
using wire::State;

wire::SettingsReport read_settings(Bench& bench) {
  const std::size_t before = bench.heard.settings.size();
  bench.request(wire::ReadSettings{});
  EXPECT_TRUE(bench.run_until([&] { return bench.heard.settings.size() > before; }, microseconds(1'000'000)));
  return bench.heard.settings.back();
}

wire::WriteSettings sixteen_microsteps() {
  wire::WriteSettings write;
  write.settings.microsteps = 16;
  write.settings.backlash_nm = 40'000;
  write.settings.board_name_size = 3;
  write.settings.board_name = {'M', 'R', '1'};
  return write;
}

TEST(Settings, AreInitialUntilWrittenAndSurviveAReset) {
  RecordedController::Options options;
  {
    Bench bench(options);
    bench.connect();
    EXPECT_EQ(read_settings(bench).records_written, 0U);
    EXPECT_EQ(read_settings(bench).settings, wire::MachineSettings{});
    ASSERT_TRUE(bench.ask(sixteen_microsteps()));
  }
  Bench bench(options);
  bench.connect();
  const wire::SettingsReport report = read_settings(bench);
  EXPECT_EQ(report.records_written, 1U);
  EXPECT_EQ(report.settings, sixteen_microsteps().settings);
  EXPECT_EQ(report.microstep_pL, wire::microstep_pL(report.settings));
  EXPECT_EQ(report.backlash_microsteps, 81U);
}

TEST(Settings, OneOutOfItsRangeIsRefusedByNumberWithTheNearestAllowed) {
  Bench bench;
  bench.connect();
  wire::WriteSettings write;
  write.settings.backlash_nm = 2'000'000;
  EXPECT_FALSE(bench.ask(write));
  const wire::Nak& nak = bench.heard.naks.back();
  EXPECT_EQ(nak.refusal, Refusal::setting_out_of_range);
  EXPECT_EQ(nak.segment, static_cast<int>(wire::Setting::backlash_nm));
  EXPECT_EQ(nak.asked, 2'000'000);
  EXPECT_EQ(nak.allowed, 1'000'000);
  EXPECT_EQ(read_settings(bench).records_written, 0U);
}

TEST(Settings, AreNotWrittenWhileAnythingMoves) {
  Bench bench;
  bench.prepare();
  bench.add_segment(wire::Waveform::parabolic, 3, 10'000'000, 1'000'000);
  ASSERT_TRUE(bench.ask(wire::Arm::example()));
  ASSERT_TRUE(bench.ask(wire::Start{0, Bench::kLease}));
  EXPECT_FALSE(bench.ask(sixteen_microsteps()));
  EXPECT_EQ(bench.heard.naks.back().refusal, Refusal::wrong_state);
  ASSERT_TRUE(bench.run_until([&] { return bench.state() == State::homed; }, microseconds(10'000'000)));
  EXPECT_TRUE(bench.ask(sixteen_microsteps()));
  EXPECT_EQ(bench.state(), State::unhomed) << "the unit of the position has changed";
}

TEST(Settings, OnceWrittenGeometryAndLimitsMustAgreeWithThem) {
  Bench bench;
  bench.connect();
  EXPECT_TRUE(bench.ask(wire::Configure::example()));
  ASSERT_TRUE(bench.ask(sixteen_microsteps()));
  EXPECT_FALSE(bench.ask(wire::Home{0, Bench::kLease}));
  EXPECT_EQ(bench.heard.naks.back().refusal, Refusal::not_configured);
  wire::Configure configure = wire::Configure::example();
  EXPECT_FALSE(bench.ask(configure));
  EXPECT_EQ(bench.heard.naks.back().refusal, Refusal::settings_mismatch);
  EXPECT_EQ(bench.heard.naks.back().limit, wire::Limit::microstep);
  EXPECT_EQ(bench.heard.naks.back().asked, 7'791'649);
  EXPECT_EQ(bench.heard.naks.back().allowed, 3'895'824);
  configure.microstep_pL = 3'895'824;
  EXPECT_TRUE(bench.ask(configure));
  configure.travel_uL = 8'000'000;
  EXPECT_FALSE(bench.ask(configure));
  EXPECT_EQ(bench.heard.naks.back().limit, wire::Limit::travel);
  configure.travel_uL = 7'000'000;
  wire::WriteSettings slow = sixteen_microsteps();
  slow.settings.full_step_rate_Hz = 10'000;
  ASSERT_TRUE(bench.ask(slow));
  EXPECT_FALSE(bench.ask(configure));
  EXPECT_EQ(bench.heard.naks.back().limit, wire::Limit::step_rate);
  EXPECT_EQ(bench.heard.naks.back().allowed, 160'000);
}

}  // namespace
}  // namespace diastole::firmware
