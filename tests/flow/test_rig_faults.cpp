// Faults of the rig during a run through daemon and `diastole run`: told, exit code not 0, and what was
// recorded is kept.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <memory>

#include "tests/flow/programs.hpp"

namespace diastole::flow {
namespace {

using nlohmann::json;

/// A simulated rig with a fault and a daemon that works with it.
class FaultyRig {
 public:
  enum class Time { conducted, real };

  FaultyRig(const std::string& fault, Time time) {
    std::vector<std::string> rig{"sim_rig", "--link", "pump", "--fault", fault};
    if (time == Time::conducted) rig.insert(rig.end(), {"--conductor", path("time")});
    rig_ = std::make_unique<Program>(place, rig);
    EXPECT_TRUE(rig_->wait_for_text("modbus_port")) << rig_->err();
    const auto addresses = json::parse(rig_->out());
    const std::string rig_file = source_text("examples/rig.toml");
    place.write("rig.toml", time == Time::real ? with_longest_lease(rig_file) : rig_file);
    std::vector<std::string> daemon{
        "diastole",      "daemon",
        "--config",      "rig.toml",
        "--port",        path("pump"),
        "--daq",         "127.0.0.1:" + std::to_string(addresses["modbus_port"].get<int>()),
        "--socket",      path("socket"),
        "--journal-dir", "journals"};
    if (time == Time::conducted) daemon.insert(daemon.end(), {"--conductor", path("time")});
    daemon_ = std::make_unique<Program>(place, daemon);
    EXPECT_TRUE(daemon_->wait_for_text("ready")) << daemon_->err();
    const Ended homed = run(place, {"diastole", "home", "--socket", path("socket")});
    EXPECT_EQ(homed.exit_code, 0) << homed.err;
  }
  ~FaultyRig() {
    for (const auto* program : {&daemon_, &rig_}) {
      (*program)->signal(SIGTERM);
      EXPECT_EQ((*program)->wait().exit_code, 0);
    }
  }
  FaultyRig(const FaultyRig&) = delete;
  FaultyRig& operator=(const FaultyRig&) = delete;

  Ended acquire(const std::string& cycles) {
    const std::string experiment =
        place.write("gel.experiment.toml",
                    with(source_text("examples/gel.experiment.toml"), "cycles = 10", "cycles = " + cycles));
    return run(place,
               {"diastole", "run", experiment, "-o", "gel.run.h5", "--socket", path("socket"), "--json"});
  }
  json inspect() { return run(place, {"diastole", "inspect", "gel.run.h5", "--json"}).json(); }

  Workplace place;

 private:
  [[nodiscard]] std::string path(const std::string& name) const { return (place / name).string(); }
  std::unique_ptr<Program> rig_;
  std::unique_ptr<Program> daemon_;
};

TEST(RigFaults, AnUnpluggedControllerEndsTheRunWithExitCode3AndKeepsTheData) {
  FaultyRig rig("serial-hangup@6", FaultyRig::Time::conducted);
  const Ended ended = rig.acquire("10");
  EXPECT_EQ(ended.exit_code, 3) << ended.err;
  const json session = ended.json();
  EXPECT_EQ(session["end"], "link_lost");
  EXPECT_GE(session["triggers"], 3);
  EXPECT_GT(session["samples"], 1000);
  EXPECT_EQ(session["samples"].get<int64_t>() + session["gaps"].get<int64_t>(), session["expected"]);
  EXPECT_EQ(rig.inspect()["sound"], false);
}

TEST(RigFaults, AControllerUnpluggedWhileTheDaemonStartsIsToldWithExitCode3) {
  const Workplace place;
  const std::string line = place / "pump";
  const std::string conductor = place / "time";
  Program rig(place,
              {"sim_rig", "--link", line, "--conductor", conductor, "--fault", "serial-hangup@0.0001"});
  ASSERT_TRUE(rig.wait_for_text("modbus_port")) << rig.err();
  place.write("rig.toml", source_text("examples/rig.toml"));
  const Ended daemon =
      run(place, {"diastole", "daemon", "--config", "rig.toml", "--port", line, "--conductor", conductor});
  EXPECT_EQ(daemon.exit_code, 3) << daemon.err;
  EXPECT_THAT(daemon.err, testing::AllOf(testing::HasSubstr(line), testing::HasSubstr("does not answer")));
}

TEST(RigFaults, ARunThatLeavesNoFileIsToldWithItsFirstError) {
  FaultyRig rig("serial-hangup@run+0", FaultyRig::Time::conducted);
  const Ended ended = rig.acquire("1");
  EXPECT_EQ(ended.exit_code, 3) << ended.err;
  EXPECT_THAT(ended.err, testing::HasSubstr("There is nothing to recover"));
  EXPECT_THAT(ended.err, testing::HasSubstr(
                             "(the run's first error: the serial line is gone; the pump stops by itself)"));
}

TEST(RigFaults, ADroppedInstrumentBecomesGapsOfExactlyItsLength) {
  FaultyRig rig("daq-drop@5+0.2", FaultyRig::Time::conducted);
  const Ended ended = rig.acquire("10");
  EXPECT_EQ(ended.exit_code, 1) << ended.err;
  const json session = ended.json();
  EXPECT_EQ(session["triggers"], 10);
  EXPECT_EQ(session["samples"].get<int64_t>() + session["gaps"].get<int64_t>(), session["expected"]);
  EXPECT_GE(session["gaps"], 59);
  EXPECT_LE(session["gaps"], 62);
}

TEST(RigFaults, ARunWithoutASingleSampleIsToldInWords) {
  FaultyRig rig("daq-drop@0.5+600", FaultyRig::Time::conducted);
  const Ended ended = rig.acquire("1");
  EXPECT_EQ(ended.exit_code, 1) << ended.err;
  const json session = ended.json();
  EXPECT_EQ(session["samples"], 0);
  EXPECT_EQ(session["gaps"], session["expected"]);
  const Ended inspected = run(rig.place, {"diastole", "inspect", "gel.run.h5"});
  EXPECT_EQ(inspected.exit_code, 1);
  EXPECT_THAT(inspected.out, testing::AllOf(testing::HasSubstr("cavity_kPa: no sample"),
                                            testing::HasSubstr("no pressure was recorded"),
                                            testing::Not(testing::HasSubstr("nan")),
                                            testing::Not(testing::HasSubstr("inf "))));
}

TEST(RigFaults, AStalledInstrumentBecomesGapsAndExitCode1) {
  FaultyRig rig("daq-stall@ttl+1+0.3", FaultyRig::Time::real);
  const Ended ended = rig.acquire("3");
  EXPECT_EQ(ended.exit_code, 1) << ended.err;
  const json session = ended.json();
  EXPECT_EQ(session["triggers"], 3);
  EXPECT_EQ(session["samples"].get<int64_t>() + session["gaps"].get<int64_t>(), session["expected"]);
  EXPECT_GE(session["gaps"], 80);
  EXPECT_THAT(ended.err, testing::HasSubstr("no answer within 20 ms"));
  EXPECT_EQ(rig.inspect()["sound"], false);
}

}  // namespace
}  // namespace diastole::flow
