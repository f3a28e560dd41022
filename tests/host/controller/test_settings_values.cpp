#include "host/controller/settings_values.hpp"

#include <gmock/gmock.h>

#include "host/controller/controller_client.hpp"
#include "host/controller/controller_words.hpp"
#include "tests/host/bench/desk.hpp"
#include "tests/host/bench/scratch.hpp"

namespace diastole {
namespace {

using runfile::Attribute;
using testing::AllOf;
using testing::HasSubstr;

TEST(SettingsValues, AreInTheUnitsOfPeopleBothWays) {
  wire::MachineSettings settings;
  change_settings(settings, {{"backlash_um", 40.5}, {"screw_rev_per_cm", 6.3}, {"board_name", "MR1"}});
  EXPECT_EQ(settings.backlash_nm, 40'500);
  EXPECT_EQ(settings.screw_mrev_per_m, 630'000);
  const Attributes shown = settings_values(settings);
  EXPECT_EQ(shown.at("backlash_um"), Attribute(40.5));
  EXPECT_EQ(shown.at("bore_mm"), Attribute(100.0));
  EXPECT_EQ(shown.at("screw_rev_per_cm"), Attribute(6.3));
  EXPECT_EQ(shown.at("board_name"), Attribute("MR1"));
  wire::MachineSettings again;
  change_settings(again, shown);
  EXPECT_EQ(again, settings);
}

TEST(SettingsValues, WhatCannotBeIsRefusedByNameValueAndRange) {
  wire::MachineSettings settings;
  const auto message = [&](const Attributes& changes) {
    return message_of<InputError>([&] { change_settings(settings, changes); });
  };
  EXPECT_THAT(message({{"microsteps", 300}}),
              AllOf(HasSubstr("microsteps"), HasSubstr("300"), HasSubstr("1 to 256")));
  EXPECT_THAT(message({{"microsteps", 7.5}}), HasSubstr("in steps of 1"));
  EXPECT_THAT(message({{"microsteps", "many"}}), HasSubstr("no number"));
  EXPECT_THAT(message({{"backlash_mm", 1}}), HasSubstr("backlash_um"));
  EXPECT_THAT(message({{"board_name", std::string(21, 'x')}}), HasSubstr("21 bytes"));
  EXPECT_EQ(settings, wire::MachineSettings{});
}

struct SettingsOnDesk : testing::Test {
  Desk desk;
  DeskClock clock{desk};
  RigConfig rig = example_rig();
  ControllerClient client{clock, rig, [this] { return std::make_unique<DeskLine>(desk); }};
};

TEST_F(SettingsOnDesk, ADisagreementStopsOrdersToMoveUntilItIsRemoved) {
  client.connect();
  EXPECT_FALSE(client.settings_problem());
  wire::MachineSettings settings;
  settings.microsteps = 16;
  client.write_settings(settings);
  ASSERT_TRUE(client.settings_problem());
  EXPECT_THAT(message_of<InputError>([&] { client.home(); }),
              AllOf(HasSubstr("controller.microsteps"), HasSubstr("is 8"), HasSubstr("is 16"),
                    HasSubstr("--set microsteps=8")));
  EXPECT_THROW(client.jog(1, 1), InputError);
  settings.microsteps = 8;
  settings.calibration_ppm = -1000;
  client.write_settings(settings);
  EXPECT_FALSE(client.settings_problem());
  EXPECT_NEAR(client.microstep_pL(), 7'791'649 * 0.999, 1);
  client.home();
}

TEST_F(SettingsOnDesk, TheOtherSharedValuesAreComparedToo) {
  client.connect();
  wire::MachineSettings settings;
  settings.bore_um = 80'000;
  client.write_settings(settings);
  EXPECT_THAT(client.settings_problem().value().place, "rig.bore_mm");
  settings = {};
  settings.travel_um = 100'000;
  client.write_settings(settings);
  EXPECT_THAT(client.settings_problem().value().place, "controller.limits.travel_mL");
  settings = {};
  settings.full_step_rate_Hz = 10'000;
  client.write_settings(settings);
  EXPECT_THAT(client.settings_problem().value().place, "controller.limits.step_rate_Hz");
}

TEST_F(SettingsOnDesk, TheBlackBoxIsReadInWords) {
  client.connect();
  EXPECT_THROW(
      client.load(parse_experiment("format = \"diastole-experiment\"\nversion = 1\n[[segment]]\n"
                                   "waveform = \"parabolic\"\nstroke_mL = 1\nperiod_s = 1\ncycles = 1\n",
                                   "e")),
      HardwareError);
  const auto entries = client.black_box();
  ASSERT_GE(entries.size(), 3U);
  EXPECT_EQ(in_words(entries[0]), "started at power-on");
  EXPECT_THAT(in_words(entries[1]), HasSubstr("a host opened session"));
  EXPECT_THAT(in_words(entries.back()), HasSubstr("Arm refused: The controller is not in a state"));
}

}  // namespace
}  // namespace diastole
