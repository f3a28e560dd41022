#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "protocol/contract/input_error.hpp"
#include "tools/sim_rig/rig_description.hpp"

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

TEST(RigDescription, ADescribedLagIsThatOfTwoPoles) {
  std::string text = default_rig_toml();
  const size_t value = text.find("drive_lag_s = ") + 14;
  text.replace(value, text.find(' ', value) - value, "0.006");
  const auto lag_ms = [&](const std::string& more) {
    return read_rig_description(TableReader::from_text(text + more, "rig.toml")).plant.piston_lag_ms;
  };
  EXPECT_DOUBLE_EQ(lag_ms(""), 3.0);
  EXPECT_DOUBLE_EQ(lag_ms("\n[simulation]\npiston_lag_ms = 1.0\n"), 1.0) << "the true one";
}

TEST(RigDescription, ATransducerMayBeInvertedButNotBlind) {
  const auto with_factor = [](const std::string& kPa_per_V) {
    std::string text = default_rig_toml();
    const size_t value = text.find("kPa_per_V = ") + 12;
    text.replace(value, text.find_first_of(" \n", value) - value, kPa_per_V);
    return read_rig_description(TableReader::from_text(text, "rig.toml")).channels[0].kPa_per_V;
  };
  EXPECT_DOUBLE_EQ(with_factor("-4.0"), -4);
  EXPECT_THROW(with_factor("0.0"), InputError);
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

}  // namespace
}  // namespace diastole::sim_rig
