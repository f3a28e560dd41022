#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "protocol/contract/input_error.hpp"
#include "tools/sim_rig/rig_description.hpp"
#include "tools/sim_rig/rig_faults.hpp"

namespace diastole::sim_rig {
namespace {

using testing::HasSubstr;

RigDescription described(const std::string& more) {
  return read_rig_description(TableReader::from_text(default_rig_toml() + more, "rig.toml"));
}

TEST(RigDescription, TheBuiltInRigIsThePapers) {
  const RigDescription rig = described("");
  EXPECT_NEAR(rig.microstep_mL, 0.00779165, 1e-8);
  EXPECT_DOUBLE_EQ(rig.plant.hose.length_m, 5);
  EXPECT_DOUBLE_EQ(rig.plant.C1_kPa, 8.8);
  ASSERT_EQ(rig.channels.size(), 1U);
  EXPECT_EQ(rig.channels[0].place, DaqChannel::Place::cavity);
}

TEST(RigDescription, TheSimulationTableIsStrict) {
  EXPECT_DOUBLE_EQ(described("\n[simulation]\nC1_kPa = 6.5\n").plant.C1_kPa, 6.5);
  try {
    described("\n[simulation]\nC1_kpa = 6.5\n");
    FAIL() << "an unknown key was taken";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("C1_kPa"));
  }
  EXPECT_THROW(described("\n[simulation]\nC1_kPa = nan\n"), InputError);
}

TEST(RigFaults, AreReadFromTheCommandLine) {
  const RigFaults faults = parse_rig_faults({"serial-hangup@3.5", "daq-stall@2+0.05", "daq-delay@1+2/0.5"});
  EXPECT_EQ(faults.serial_hangup_ns, 3'500'000'000U);
  EXPECT_EQ(faults.daq.stall.from_ns, 2'000'000'000U);
  EXPECT_EQ(faults.daq.stall.until_ns, 2'050'000'000U);
  EXPECT_EQ(faults.daq.delay_ns, 500'000'000U);
  EXPECT_FALSE(faults.daq.drop.holds(0));
}

TEST(RigFaults, OfTheInstrumentMayCountFromTheFirstTrigger) {
  const RigFaults faults = parse_rig_faults({"daq-stall@ttl+1.5+0.25"});
  EXPECT_EQ(faults.daq_from_ttl.stall.from_ns, 1'500'000'000U);
  EXPECT_EQ(faults.daq_from_ttl.stall.until_ns, 1'750'000'000U);
  EXPECT_TRUE(faults.daq.stall.empty());
}

TEST(RigFaults, AnythingElseIsRefusedWithTheForms) {
  for (const char* text : {"serial-hangup", "daq-stall@2", "serial-hangup@3+1", "fire@3", "daq-drop@x+1",
                           "daq-stall@2+-1", "daq-stall@2+1s", "daq-stall@ttl+2", "serial-hangup@ttl+2"}) {
    try {
      parse_rig_faults({text});
      FAIL() << text;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), testing::AllOf(HasSubstr(text), HasSubstr("daq-stall@T+D")));
    }
  }
}

}  // namespace
}  // namespace diastole::sim_rig
