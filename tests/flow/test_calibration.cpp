// Zeroing and calibrating through the daemon.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "tests/flow/rig_with_daemon.hpp"

namespace diastole::flow {
namespace {

using nlohmann::json;
using testing::HasSubstr;

std::string text_of(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

/// In real time a busy machine may lose more samples than a measurement allows: then again, as it advises.
Ended measured(const RigWithDaemon& rig, const std::vector<std::string>& arguments) {
  Ended ended = run(rig.place, arguments);
  for (int again = 0;
       again < 20 && ended.exit_code == 3 && ended.err.find("samples came") != std::string::npos; ++again)
    ended = run(rig.place, arguments);
  return ended;
}

TEST(Calibration, AZeroIsKeptBesideTheRigFileAndStandsInTheNextDaemon) {
  RigWithDaemon rig(RigWithDaemon::Time::real,
                    source_text("examples/rig.toml") + "\n[simulation]\ncavity_offset_kPa = 0.8\n");
  rig.start_daemon();
  const Ended zeroed = measured(rig, {"diastole", "zero", "--seconds", "2", "--operator", "A. Nguyen",
                                      "--json", "--socket", rig.path("socket")});
  ASSERT_EQ(zeroed.exit_code, 0) << zeroed.err;
  const json channel = zeroed.json()["channels"][0];
  EXPECT_EQ(channel["name"], "cavity");
  EXPECT_NEAR(channel["zero_V"].get<double>(), 0.2, 0.02) << "0.8 kPa at 4 kPa/V";
  EXPECT_THAT(text_of(rig.path("rig.calibration.toml")), HasSubstr("A. Nguyen"));
  rig.daemon->signal(SIGTERM);
  EXPECT_EQ(rig.daemon->wait().exit_code, 0);
  rig.start_daemon();
  const Ended point = measured(rig, {"diastole", "calibrate", "cavity", "--kPa", "0", "--seconds", "1",
                                     "--json", "--socket", rig.path("socket")});
  ASSERT_EQ(point.exit_code, 0) << point.err;
  EXPECT_EQ(point.json()["channels"][0]["points"], 1);
  EXPECT_NEAR(point.json()["channels"][0]["zero_V"].get<double>(), 0.2, 0.02) << "of the daemon before";
  const Ended line = measured(rig, {"diastole", "calibrate", "cavity", "--kPa", "10", "--seconds", "1",
                                    "--socket", rig.path("socket")});
  EXPECT_EQ(line.exit_code, 2);
  EXPECT_THAT(line.err, HasSubstr("no line")) << "the simulated pressure did not follow";
}

TEST(Calibration, AChannelThatThereIsNotIsNamed) {
  RigWithDaemon rig(RigWithDaemon::Time::conducted);
  rig.start_daemon();
  const Ended ended = run(rig.place, {"diastole", "zero", "spare", "--socket", rig.path("socket")});
  EXPECT_EQ(ended.exit_code, 2);
  EXPECT_THAT(ended.err, HasSubstr("spare"));
  EXPECT_FALSE(std::filesystem::exists(rig.path("rig.calibration.toml")));
}

TEST(Calibration, ASimulatedRigKeepsNothing) {
  RigWithDaemon rig(RigWithDaemon::Time::conducted,
                    source_text("examples/rig.toml") + "\n[simulation]\ncavity_offset_kPa = 0.8\n");
  rig.start_daemon();
  const Ended zeroed = run(rig.place, {"diastole", "zero", "--socket", rig.path("socket")});
  EXPECT_EQ(zeroed.exit_code, 0) << zeroed.err;
  EXPECT_THAT(zeroed.out, HasSubstr("simulated"));
  EXPECT_FALSE(std::filesystem::exists(rig.path("rig.calibration.toml")));
}

}  // namespace
}  // namespace diastole::flow
