// The commands around a run: settings, jog, faults, stops, black box, on a simulated rig through the daemon.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>

#include "tests/flow/rig_with_daemon.hpp"

namespace diastole::flow {
namespace {

using nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

class ByHand : public testing::Test {
 protected:
  void SetUp() override { rig.start_daemon(); }
  Ended diastole(std::vector<std::string> words) {
    words.insert(words.begin(), "diastole");
    words.insert(words.end(), {"--socket", rig.path("socket")});
    return run(rig.place, words);
  }
  RigWithDaemon rig{RigWithDaemon::Time::conducted};
};

TEST_F(ByHand, SettingsAreShownChangedRefusedAndReset) {
  const Ended initial = diastole({"settings"});
  EXPECT_EQ(initial.exit_code, 0);
  EXPECT_THAT(initial.out,
              AllOf(HasSubstr("microsteps"), HasSubstr("backlash_um"), HasSubstr("none were ever written")));
  const Ended changed =
      diastole({"settings", "--set", "backlash_um=40", "--set", "board_name=MR1", "--json"});
  EXPECT_EQ(changed.exit_code, 0) << changed.err;
  const json reported = changed.json();
  EXPECT_EQ(reported["record"], 1);
  EXPECT_EQ(reported["settings"]["backlash_um"], 40.0);
  EXPECT_EQ(reported["settings"]["board_name"], "MR1");
  EXPECT_EQ(reported["settings"]["microsteps"], 8);
  EXPECT_EQ(reported["backlash_microsteps"], 40);
  const Ended wild = diastole({"settings", "--set", "backlash_um=4000"});
  EXPECT_EQ(wild.exit_code, 2);
  EXPECT_THAT(wild.err, AllOf(HasSubstr("backlash_um"), HasSubstr("4000"), HasSubstr("0 to 1000")));
  const Ended misspelt = diastole({"settings", "--set", "backlash=4"});
  EXPECT_EQ(misspelt.exit_code, 2);
  EXPECT_THAT(misspelt.err, HasSubstr("Did you mean \"backlash_um\"?"));
  const Ended calibrated = diastole({"settings", "--calibrate", "50", "49.5", "--json"});
  EXPECT_EQ(calibrated.json()["settings"]["calibration_ppm"], -10000);
  EXPECT_NEAR(calibrated.json()["microstep_uL"].get<double>(), 7.791649 * 0.99, 1e-5);
  EXPECT_EQ(diastole({"settings", "--defaults", "--json"}).json()["settings"]["backlash_um"], 0.0);
}

TEST_F(ByHand, ARigFileThatDisagreesIsToldInWordsAndNothingMoves) {
  const Ended written = diastole({"settings", "--set", "microsteps=16"});
  EXPECT_EQ(written.exit_code, 1);
  EXPECT_THAT(written.out, AllOf(HasSubstr("controller.microsteps"), HasSubstr("is 8"), HasSubstr("is 16"),
                                 HasSubstr("diastole settings --set microsteps=8")));
  const Ended home = diastole({"home"});
  EXPECT_EQ(home.exit_code, 2);
  EXPECT_THAT(home.err, AllOf(HasSubstr("controller.microsteps"), HasSubstr("16")));
  EXPECT_EQ(diastole({"jog", "--mL", "1"}).exit_code, 2);
  EXPECT_THAT(diastole({"status"}).out, HasSubstr("controller.microsteps"));
  // Neither does it after a restart of the daemon, which starts all the same.
  rig.daemon->signal(SIGTERM);
  rig.daemon->wait();
  rig.start_daemon();
  EXPECT_EQ(diastole({"home"}).exit_code, 2);
  EXPECT_EQ(diastole({"settings", "--set", "microsteps=8"}).exit_code, 0);
  EXPECT_EQ(diastole({"home"}).exit_code, 0);
}

TEST_F(ByHand, AJogMovesTellsItsUnitsAndItsLimits) {
  const Ended creep = diastole({"jog", "--mL", "2", "--rate-mL-s", "50"});
  EXPECT_EQ(creep.exit_code, 2);
  EXPECT_THAT(creep.err, AllOf(HasSubstr("--rate-mL-s"), HasSubstr("50"), HasSubstr("5 mL/s")));
  EXPECT_EQ(diastole({"home"}).exit_code, 0);
  const Ended out = diastole({"jog", "--mL", "5", "--rate-mL-s", "10"});
  EXPECT_EQ(out.exit_code, 0) << out.err;
  EXPECT_THAT(out.out, AllOf(HasSubstr("+5.00"), HasSubstr("mL"), HasSubstr("homed")));
  const Ended back = diastole({"jog", "--mL=-5.002", "--json"});
  EXPECT_NEAR(back.json()["position_mL"].get<double>(), 0, 1e-9);
  const Ended beyond = diastole({"jog", "--mL=-1"});
  EXPECT_EQ(beyond.exit_code, 2);
  EXPECT_THAT(beyond.err, AllOf(HasSubstr("withdraw 1 mL"), HasSubstr("stands at 0 mL")));
}

TEST_F(ByHand, AHaltCutsARunOffAndTheFaultIsClearedByACommand) {
  EXPECT_EQ(diastole({"home"}).exit_code, 0);
  auto client = rig.client();
  client.call("run.start", many_segments());
  client.call("control.release");
  EXPECT_EQ(diastole({"stop", "--halt"}).exit_code, 0);
  status_when(client, "faulted", true);
  const Ended status = diastole({"status"});
  EXPECT_THAT(status.out, AllOf(HasSubstr("fault     6 halted"), HasSubstr("diastole clear-fault")));
  const Ended cleared = diastole({"clear-fault"});
  EXPECT_EQ(cleared.exit_code, 0) << cleared.err;
  EXPECT_THAT(cleared.out, AllOf(HasSubstr("unhomed"), Not(HasSubstr("fault"))));
  const Ended box = diastole({"blackbox"});
  EXPECT_THAT(box.out, AllOf(HasSubstr("started at power-on"), HasSubstr("homing -> homed"),
                             HasSubstr("fault 6 (halted)"), HasSubstr("faulted -> unhomed"),
                             HasSubstr("all since power-on")));
}

TEST_F(ByHand, ADaemonStartsAtAFaultedControllerAndClearsIt) {
  EXPECT_EQ(diastole({"home"}).exit_code, 0);
  auto client = rig.client();
  client.call("run.start", many_segments());
  client.call("control.release");
  EXPECT_EQ(diastole({"stop", "--halt"}).exit_code, 0);
  status_when(client, "faulted", true);
  rig.daemon->signal(SIGTERM);
  rig.daemon->wait();
  rig.start_daemon();
  EXPECT_THAT(diastole({"status"}).out,
              AllOf(HasSubstr("fault     6 halted"), HasSubstr("diastole clear-fault")));
  const Ended home = diastole({"home"});
  EXPECT_EQ(home.exit_code, 3);
  EXPECT_THAT(home.err, AllOf(HasSubstr("halted"), HasSubstr("clear-fault")));
  EXPECT_EQ(diastole({"clear-fault"}).exit_code, 0);
  EXPECT_EQ(diastole({"home"}).exit_code, 0);
}

TEST_F(ByHand, ADaemonThatFindsThePumpRunningStopsItAndSaysSo) {
  const json homed = diastole({"home", "--json"}).json();
  {
    auto client = rig.client();
    client.call("run.start", many_segments());
    status_when(client, "running", true);
    while (client.call("run.progress", {{"first_remark", 0}}).at("triggers") < 3) {
    }
    EXPECT_GT(client.call("rig.status").at("steps"), homed.at("steps")) << "counted as the run goes on";
  }
  rig.daemon->signal(SIGKILL);
  rig.daemon->wait();
  rig.start_daemon();
  const Ended status = diastole({"status"});
  EXPECT_THAT(status.out,
              AllOf(HasSubstr("state     homed"), HasSubstr("found running"), HasSubstr("was stopped")));
  EXPECT_EQ(diastole({"status", "--json"}).json()["steps"], diastole({"status", "--json"}).json()["steps"]);
  EXPECT_EQ(diastole({"blackbox"}).exit_code, 0);
  EXPECT_THAT(diastole({"status"}).out, HasSubstr("found running")) << "whoever only reads changes nothing";
  const Ended jog = diastole({"jog", "--mL", "1"});
  EXPECT_EQ(jog.exit_code, 0) << jog.err;
  EXPECT_THAT(diastole({"status"}).out, Not(HasSubstr("found running")));
}

TEST_F(ByHand, WhoReadsTheBlackBoxKeepsNobodyFromTheRig) {
  auto client = rig.client();
  client.call("rig.home");
  for (int i = 0; i < 20; ++i) {
    const Hasty reader(rig.path("socket"), "rig.black_box", json::object());
    const Hasty another(rig.path("socket"), "rig.black_box", json::object());
    EXPECT_NO_THROW(client.call("rig.jog", {{"mL", i % 2 == 0 ? 1 : -1}, {"rate_mL_s", 5}}));
  }
}

TEST_F(ByHand, SettingsInForceGoIntoTheRunFile) {
  EXPECT_EQ(diastole({"settings", "--set", "calibration_ppm=-2000", "--set", "board_name=MR1"}).exit_code, 0);
  EXPECT_EQ(diastole({"home"}).exit_code, 0);
  rig.place.write("e.toml",
                  "format = \"diastole-experiment\"\nversion = 1\n[[segment]]\nwaveform = \"parabolic\"\n"
                  "stroke_mL = 10\nperiod_s = 1.0\ncycles = 1\n");
  EXPECT_EQ(diastole({"run", rig.path("e.toml"), "-o", rig.path("r.h5")}).exit_code, 0);
  const Ended dump = run_line(
      rig.place, "h5dump -a /rig/board_name -a /rig/calibration_ppm -a /rig/volume_per_step_mL r.h5");
  if (dump.exit_code == 127) GTEST_SKIP() << "h5dump is not installed";
  EXPECT_THAT(dump.out, AllOf(HasSubstr("MR1"), HasSubstr("-2000"), HasSubstr("0.0077760")));
}

}  // namespace
}  // namespace diastole::flow
