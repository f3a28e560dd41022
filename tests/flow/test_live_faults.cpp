// Faults that are switched on by name while a run is under way, and what controller and daemon make of them.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <thread>

#include "tests/flow/rig_with_daemon.hpp"
#include "tools/sim_rig/control_client.hpp"

namespace diastole::flow {
namespace {

using nlohmann::json;

struct LiveFault {
  const char* name;
  const char* end;   ///< of the run
  const char* code;  ///< of the remark that tells it
  const char* passes_at = nullptr;
};

constexpr LiveFault live_faults[] = {
    {"estop", "faulted", "estop"},
    {"far-limit", "faulted", "limit_switch"},
    {"home-limit", "faulted", "home_switch"},
    {"serial-deaf", "lease_lost", "lease_lost", "run+1.0"},
    {"serial-silence", "link_lost", "link_lost"},
    {"serial-hangup", "link_lost", "link_lost"},
    {"power-cut", "link_lost", "link_lost", "run+0.6"},
};

/// Orders a moment in the run, and waits for it.
class Bystander {
 public:
  explicit Bystander(const std::string& socket) : rig_(socket) {}

  void expect_at(const std::string& moment) { rig_.order("hold " + moment); }
  /// False when the run is over before.
  bool wait(DaemonClient& daemon) {
    while (!rig_.held()) {
      if (daemon.call("run.progress")["state"] == "done") return false;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return true;
  }
  void order(const std::string& text) { rig_.order(text); }

 private:
  sim_rig::ControlClient rig_;
};

json result_of_run(DaemonClient& daemon) {
  while (true) {
    const json state = daemon.call("run.progress");
    if (state["state"] == "done" || state["state"] == "failed") return state;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

TEST(LiveFaults, AreTakenAsTheRealOnesAndLeaveTheRigUsable) {
  RigWithDaemon rig(RigWithDaemon::Time::conducted);
  rig.start_daemon();
  DaemonClient daemon = rig.client();
  Bystander bystander(rig.path("control"));
  const std::string experiment = R"(format = "diastole-experiment"
version = 1
rest_s = 0.1
[[segment]]
waveform = "parabolic"
stroke_mL = 1.0   # homing goes 5 mL/s
period_s = 1.2
cycles = 2
)";
  for (const LiveFault& fault : live_faults) {
    SCOPED_TRACE(fault.name);
    const json status = daemon.call("rig.status");
    if (!status["fault"].is_null()) daemon.call("rig.clear_fault");
    daemon.call("rig.home");
    bystander.expect_at("run+0.5");
    daemon.call("run.start", {{"experiment", experiment}, {"file", "gel.experiment.toml"}});
    ASSERT_TRUE(bystander.wait(daemon));
    bystander.order(std::string("fault on ") + fault.name);
    // A controller without supply boots; one that hears nothing tells its end when it is heard again.
    if (fault.passes_at != nullptr) bystander.expect_at(fault.passes_at);
    bystander.order("go");
    if (bystander.wait(daemon)) {
      bystander.order(std::string("fault off ") + fault.name);
      bystander.order("go");
    }
    const json state = result_of_run(daemon);
    EXPECT_EQ(state["result"]["end"], fault.end);
    EXPECT_EQ(state["result"]["triggers"], 1);
    bool reported = false;
    for (const json& remark : state["remarks"])
      reported = reported || remark["code"] == fault.code;
    EXPECT_TRUE(reported) << state["remarks"].dump();
    bystander.order(std::string("fault off ") + fault.name);
  }
}

}  // namespace
}  // namespace diastole::flow
