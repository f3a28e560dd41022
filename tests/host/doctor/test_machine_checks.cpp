// What a machine lacks for a rig is said with what to do about it.

#include "host/doctor/machine_checks.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <filesystem>

#include "protocol/contract/input_error.hpp"
#include "tests/host/bench/scratch.hpp"

namespace diastole {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

MachineCheck check_named(const std::vector<MachineCheck>& checks, const std::string& name) {
  const auto found = std::ranges::find(checks, name, &MachineCheck::name);
  return found == checks.end() ? MachineCheck{"(none)", MachineCheck::State::good, "", ""} : *found;
}

RigConfig rig_at(const std::string& port, const std::filesystem::path& journals) {
  RigConfig rig = read_rig(std::filesystem::path(DIASTOLE_SOURCE_DIR) / "examples/rig.toml");
  rig.controller.port = port;
  rig.daemon.journal_dir = journals;
  return rig;
}

TEST(MachineChecks, ThePortThatTheRigNamesIsLookedFor) {
  const Scratch scratch("doctor");
  RigConfig rig = rig_at("/dev/ttyNothingHere", scratch.path());
  rig.daq.open = [](const auto&) -> std::unique_ptr<daq::Instrument> {
    throw HardwareError("instrument", "is switched off", "Switch it on.");
  };
  const auto checks = check_machine(rig);
  const MachineCheck port = check_named(checks, "serial port");
  EXPECT_EQ(port.state, MachineCheck::State::lacking);
  EXPECT_THAT(port.found, HasSubstr("/dev/ttyNothingHere is not there"));
  EXPECT_THAT(port.remedy, Not(IsEmpty()));
  const MachineCheck instrument = check_named(checks, "instrument");
  EXPECT_EQ(instrument.state, MachineCheck::State::lacking);
  EXPECT_THAT(instrument.found, HasSubstr("is switched off"));
  EXPECT_EQ(instrument.remedy, "Switch it on.");
  rig.controller.port = "/dev/null";
  EXPECT_EQ(check_named(check_machine(rig), "serial port").state, MachineCheck::State::good);
}

TEST(MachineChecks, WhateverLacksHasARemedyAndWhatIsGoodHasNone) {
  for (const MachineCheck& check : check_machine(std::nullopt)) {
    EXPECT_THAT(check.found, Not(IsEmpty())) << check.name;
    EXPECT_EQ(check.remedy.empty(), check.state != MachineCheck::State::lacking) << check.name;
  }
}

TEST(MachineChecks, TheDiskIsTriedInTheNearestFolderThatIsThereAndNothingStays) {
  const Scratch scratch("doctor-disk");
  const auto disk = check_named(check_machine(rig_at("/dev/null", scratch / "not/yet/made")), "disk");
  EXPECT_THAT(disk.found, AllOf(HasSubstr(scratch.path().string()), HasSubstr("GB free")));
  EXPECT_TRUE(std::filesystem::is_empty(scratch.path()));
}

TEST(MachineChecks, LatencyIsMeasuredInOrderAndJudgedByASampleLost) {
  const Latency latency = measure_latency(0.2, [] { return true; });
  EXPECT_EQ(latency.wakes, 200);
  EXPECT_LE(latency.median_us, latency.p999_us);
  EXPECT_LE(latency.p999_us, latency.worst_us);
  EXPECT_GT(latency.worst_us, 0);
  int asked = 0;
  EXPECT_EQ(measure_latency(60, [&] { return ++asked <= 10; }).wakes, 10);
  Latency late = latency;
  late.worst_us = latest_wake_us + 1;
  EXPECT_EQ(check_latency(late).state, MachineCheck::State::lacking);
  late.worst_us = latest_wake_us - 1;
  EXPECT_EQ(check_latency(late).state, MachineCheck::State::good);
}

}  // namespace
}  // namespace diastole
