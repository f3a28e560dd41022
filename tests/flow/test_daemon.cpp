// The daemon between its clients: what a stop, a signal, a second client and a question meet while it loads,
// homes and runs.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <memory>
#include <thread>

#include "host/daemon/client.hpp"
#include "host/daemon/json_rpc.hpp"
#include "host/transport/unix_socket.hpp"
#include "protocol/contract/input_error.hpp"
#include "tests/flow/programs.hpp"

namespace diastole::flow {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;
using testing::HasSubstr;

/// A simulated rig, and a daemon that can be started at it more than once.
class RigWithDaemon {
 public:
  enum class Time { conducted, real };

  explicit RigWithDaemon(Time time, const std::string& rig_file = source_text("examples/rig.toml"))
      : time_(time) {
    place.write("rig.toml", rig_file);
    std::vector<std::string> rig{"sim_rig", "--link", path("pump"), "--config", path("rig.toml")};
    if (time == Time::conducted) rig.insert(rig.end(), {"--conductor", path("time")});
    rig_ = std::make_unique<Program>(place, rig);
    EXPECT_TRUE(rig_->wait_for_text("modbus_port")) << rig_->err();
    modbus_port_ = json::parse(rig_->out())["modbus_port"];
  }
  ~RigWithDaemon() {
    for (const auto* program : {&daemon, &rig_}) {
      if (*program == nullptr) continue;
      (*program)->signal(SIGTERM);
      EXPECT_EQ((*program)->wait().exit_code, 0);
    }
  }
  RigWithDaemon(const RigWithDaemon&) = delete;
  RigWithDaemon& operator=(const RigWithDaemon&) = delete;

  void start_daemon() {
    std::vector<std::string> arguments{
        "diastole", "daemon",       "--config",      "rig.toml",
        "--port",   path("pump"),   "--daq",         "127.0.0.1:" + std::to_string(modbus_port_),
        "--socket", path("socket"), "--journal-dir", "journals"};
    if (time_ == Time::conducted) arguments.insert(arguments.end(), {"--conductor", path("time")});
    daemon = std::make_unique<Program>(place, arguments);
    ASSERT_TRUE(daemon->wait_for_text("ready")) << daemon->err();
  }
  [[nodiscard]] DaemonClient client() const { return DaemonClient(path("socket")); }
  [[nodiscard]] std::string path(const std::string& name) const { return (place / name).string(); }

  Workplace place;
  std::unique_ptr<Program> daemon;

 private:
  Time time_;
  std::unique_ptr<Program> rig_;
  int modbus_port_ = 0;
};

/// 60 segments, which take a while to load, and 18 s to run.
json many_segments() {
  std::string text = "format = \"diastole-experiment\"\nversion = 1\nrest_s = 0.2\n";
  for (int i = 0; i < 60; ++i)
    text += "[[segment]]\nwaveform = \"parabolic\"\nstroke_mL = 2.0\nperiod_s = 0.3\n";
  return {{"experiment", text}, {"file", "many.experiment.toml"}};
}

/// Asks until the state is (or is no longer) `state`, half a minute at most; returns the last status.
json status_when(DaemonClient& client, const std::string& state, bool is) {
  json status;
  for (const auto end = std::chrono::steady_clock::now() + 30s; std::chrono::steady_clock::now() < end;) {
    status = client.call("rig.status");
    if ((status["state"] == state) == is) return status;
    std::this_thread::sleep_for(1ms);
  }
  ADD_FAILURE() << "still " << status.dump();
  return status;
}

/// Homes the pump and leaves the control to others.
json home(DaemonClient& client) {
  const json status = client.call("rig.home");
  client.call("control.release");
  return status;
}

/// A client that gives an order and does not wait for the answer.
class Hasty {
 public:
  Hasty(const std::string& socket, const std::string& method, const json& params)
      : socket_(connect_unix_socket(socket)) {
    const std::string line = rpc::request_line(1, method, params);
    EXPECT_EQ(::send(socket_.get(), line.data(), line.size(), MSG_NOSIGNAL),
              static_cast<ssize_t>(line.size()));
  }

 private:
  Descriptor socket_;
};

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
  for (int offset_ms = 0; offset_ms < 40; offset_ms += 2) {
    {
      const Hasty hasty(rig.path("socket"), "run.start", many_segments());
      auto watch = rig.client();
      status_when(watch, "homed", false);
      std::this_thread::sleep_for(std::chrono::milliseconds(offset_ms));
      rig.daemon->signal(offset_ms % 4 == 0 ? SIGTERM : SIGINT);
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
