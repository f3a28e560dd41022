// The daemon between its clients: what a stop, a signal, a second client and a question meet while it loads,
// homes and runs.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <thread>

#include "protocol/contract/input_error.hpp"
#include "tests/flow/rig_with_daemon.hpp"

namespace diastole::flow {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;
using testing::HasSubstr;

TEST(Daemon, AStopAtAnyMomentOfTheLoadIsObeyed) {
  RigWithDaemon rig(RigWithDaemon::Time::conducted);
  rig.start_daemon();
  auto watch = rig.client();
  home(watch);
  int before_the_start = 0;
  for (int offset_ms = 0; offset_ms < 40; offset_ms += 2) {
    {
      const Hasty hasty(rig.path("socket"), "run.start", many_segments());
      status_when(watch, "homed", false);
      std::this_thread::sleep_for(std::chrono::milliseconds(offset_ms));
      watch.call("run.stop", {{"how", "now"}});
      status_when(watch, "homed", true);
    }
    const json run = watch.call("run.progress");
    if (run.is_null()) {
      ++before_the_start;
    } else {
      EXPECT_LT(run["triggers"], 60) << "stopped after " << offset_ms << " ms";
    }
  }
  EXPECT_GT(before_the_start, 0);
}

TEST(Daemon, ASignalAtAnyMomentOfTheLoadEndsTheDaemonWithThePumpAtRest) {
  RigWithDaemon rig(RigWithDaemon::Time::conducted);
  rig.start_daemon();
  {
    auto first = rig.client();
    home(first);
  }
  for (int offset_ms = 0; offset_ms < 40; offset_ms += 7) {
    {
      const Hasty hasty(rig.path("socket"), "run.start", many_segments());
      auto watch = rig.client();
      status_when(watch, "homed", false);
      std::this_thread::sleep_for(std::chrono::milliseconds(offset_ms));
      rig.daemon->signal(offset_ms % 2 == 0 ? SIGTERM : SIGINT);
    }
    const Ended ended = rig.daemon->wait();
    EXPECT_EQ(ended.exit_code, 0) << ended.err;
    EXPECT_EQ(ended.err.find("\"completed\""), std::string::npos) << ended.err;
    if (ended.err.find(" begins") != std::string::npos) {
      EXPECT_THAT(ended.err, HasSubstr("controlled stop was asked for"));
    }
    rig.start_daemon();
    auto watch = rig.client();
    EXPECT_EQ(watch.call("rig.status")["state"], "homed") << "the pump must be at rest and know its place";
  }
}

TEST(Daemon, AnOrderWhileAnotherIsBeingLoadedIsRefusedAndNotQueued) {
  RigWithDaemon rig(RigWithDaemon::Time::conducted);
  rig.start_daemon();
  auto other = rig.client();
  home(other);
  { const Hasty hasty(rig.path("socket"), "run.start", many_segments()); }
  status_when(other, "homed", false);
  EXPECT_THROW(other.call("run.start", many_segments()), HardwareError);
  other.call("run.stop", {{"how", "now"}});
}

TEST(Daemon, StatusTellsInputsAndMotor) {
  RigWithDaemon rig(RigWithDaemon::Time::conducted);
  rig.start_daemon();
  const auto ask = [&] { return run(rig.place, {"diastole", "status", "--socket", rig.path("socket")}); };
  EXPECT_THAT(ask().out, HasSubstr("inputs    none active; motor off"));
  auto client = rig.client();
  home(client);
  EXPECT_THAT(ask().out, HasSubstr("inputs    none active; motor powered"));
}

TEST(Daemon, AHomingPumpTellsWhereItIsAndStopsWhenAsked) {
  const std::string slow = with(source_text("examples/rig.toml"), "microsteps = 8\n",
                                "microsteps = 8\n[controller.limits]\nhoming_flow_mL_s = 0.2\n");
  RigWithDaemon rig(RigWithDaemon::Time::real, slow);
  rig.start_daemon();
  Program homing(rig.place, {"diastole", "home", "--socket", rig.path("socket")});
  auto watch = rig.client();
  json status = status_when(watch, "unhomed", false);
  ASSERT_EQ(status["state"], "homing");
  const double first_mL = status["position_mL"];
  double now_mL = first_mL;
  while (now_mL == first_mL && status["state"] == "homing") {
    std::this_thread::sleep_for(5ms);
    status = watch.call("rig.status");
    now_mL = status["position_mL"];
  }
  EXPECT_EQ(status["state"], "homing") << "the position told must be of now";
  const Ended stop = run(rig.place, {"diastole", "stop", "--socket", rig.path("socket"), "--json"});
  EXPECT_EQ(stop.exit_code, 0) << stop.err;
  EXPECT_EQ(stop.json()["stopping"], true);
  const Ended ended = homing.wait();
  EXPECT_EQ(ended.exit_code, 3);
  EXPECT_THAT(ended.err, HasSubstr("homing was stopped"));
  EXPECT_EQ(watch.call("rig.status")["state"], "unhomed");
}

TEST(Daemon, ARunTellsWhereItIs) {
  RigWithDaemon rig(RigWithDaemon::Time::real);
  rig.start_daemon();
  auto watch = rig.client();
  const auto triggers_at_rest = watch.call("rig.home")["triggers"].get<int64_t>();
  watch.call("run.start", many_segments());
  json status;
  do {
    std::this_thread::sleep_for(10ms);
    status = watch.call("rig.status");
  } while (status["state"] == "running" &&
           (status["position_mL"] == 0.0 || status["triggers"] == triggers_at_rest));
  EXPECT_EQ(status["state"], "running");
  watch.call("run.stop", {{"how", "now"}});
}

TEST(Daemon, AClientWhoseDaemonDiesIsToldWhereTheRunIs) {
  RigWithDaemon rig(RigWithDaemon::Time::conducted);
  rig.start_daemon();
  auto first = rig.client();
  home(first);
  rig.place.write("long.experiment.toml",
                  with(source_text("examples/gel.experiment.toml"), "cycles = 10", "cycles = 5000"));
  Program run_command(rig.place, {"diastole", "run", "long.experiment.toml", "-o", "long.run.h5", "--socket",
                                  rig.path("socket")});
  ASSERT_TRUE(run_command.wait_for_text("cycle "));
  rig.daemon->signal(SIGKILL);
  rig.daemon->wait();
  const Ended ended = run_command.wait();
  EXPECT_EQ(ended.exit_code, 3);
  EXPECT_THAT(ended.err, testing::AllOf(HasSubstr(rig.path("journals")), HasSubstr(".journal"),
                                        HasSubstr("diastole recover")));
  rig.daemon.reset();
}

TEST(Daemon, AClientWhoseDaemonIsEndedGetsItsRunOrIsToldWhereItIs) {
  RigWithDaemon rig(RigWithDaemon::Time::conducted);
  rig.start_daemon();
  auto first = rig.client();
  home(first);
  rig.place.write("long.experiment.toml",
                  with(source_text("examples/gel.experiment.toml"), "cycles = 10", "cycles = 5000"));
  Program run_command(rig.place, {"diastole", "run", "long.experiment.toml", "-o", "long.run.h5", "--socket",
                                  rig.path("socket")});
  ASSERT_TRUE(run_command.wait_for_text("cycle "));
  rig.daemon->signal(SIGTERM);
  EXPECT_EQ(rig.daemon->wait().exit_code, 0);
  const Ended ended = run_command.wait();
  const bool delivered = std::filesystem::exists(rig.place / "long.run.h5");
  EXPECT_TRUE(delivered || ended.err.find(rig.path("journals")) != std::string::npos) << ended.err;
  rig.daemon.reset();
}

}  // namespace
}  // namespace diastole::flow
