// A recorded run, played again through simulated instrument, real firmware and real daemon, is the run that was
// recorded, faults and gaps included; one that was tampered with is not, and the place is told.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <filesystem>

#include "protocol/runfile/reader.hpp"
#include "tests/flow/rig_with_daemon.hpp"
#include "tests/host/bench/run_in_memory.hpp"
#include "tools/diastole/replay/operator.hpp"

namespace diastole::flow {
namespace {

using nlohmann::json;
using testing::HasSubstr;

const std::string image = DIASTOLE_SOURCE_DIR "/build/firmware/bin/diastole-stm32f405.elf";

std::string gel_experiment(const std::string& cycles) {
  return with(with(source_text("examples/gel.experiment.toml"), "cycles = 10", "cycles = " + cycles),
              "rest_s = 1.0", "rest_s = 0.2");
}

/// A rig with two transducers and an instrument whose clock is off.
std::string two_channel_rig() {
  return with(source_text("examples/rig.toml"), "# [gpio]", R"([[daq.channel]]
name = "pump"
input = 3
kPa_per_V = 20.0
zero_V = 0.5

# [gpio])") +
         "\n[simulation]\ndaq_clock_error_ppm = 40.0\n";
}

/// Records `cycles` of the gel session in a workplace, with faults; returns the run file's name.
std::string record(const Workplace& place, const std::string& cycles,
                   const std::vector<std::string>& faults) {
  place.write("gel.experiment.toml", gel_experiment(cycles));
  place.write("two.rig.toml", two_channel_rig());
  std::vector<std::string> command{"diastole",   "simulate", "gel.experiment.toml", "-o",
                                   "gel.run.h5", "--config", "two.rig.toml"};
  for (const std::string& fault : faults)
    command.insert(command.end(), {"--fault", fault});
  const Ended recorded = run(place, command);
  EXPECT_TRUE(std::filesystem::exists(place / "gel.run.h5")) << recorded.err;
  return "gel.run.h5";
}

/// What a replay tells, after it ended with that exit code and left nothing behind.
json replay(const Workplace& place, const std::string& file, int exit_code,
            const std::vector<std::string>& options = {}) {
  std::vector<std::string> command{"diastole", "replay", file, "--json"};
  command.insert(command.end(), options.begin(), options.end());
  const Ended ended = run(place, command);
  EXPECT_EQ(ended.exit_code, exit_code) << ended.err << ended.out;
  EXPECT_TRUE(std::filesystem::is_empty(place.temporary())) << "temporary files are left";
  return ended.json();
}

/// Everything agrees, to the last bit of the pressure.
void expect_the_recording(const json& found) {
  EXPECT_EQ(found["equal"], true);
  EXPECT_EQ(found["max_abs_diff_kPa"], 0);
  EXPECT_LT(std::abs(found["max_trigger_diff_s"].get<double>()), 13e-9);
  EXPECT_EQ(found["max_steps_diff"], 0);
  EXPECT_TRUE(found["first_difference"].is_null());
}

/// What a line of the table says.
json line(const json& found, const std::string& what) {
  for (const json& each : found["lines"]) {
    if (each["what"] == what) return each;
  }
  ADD_FAILURE() << "no line tells of " << what;
  return {};
}

TEST(Replay, GapsAndAnEmergencyStopComeAgainFromTheSameFirmwareAndFromItsImage) {
  const Workplace place;
  const std::string file = record(place, "4", {"daq-error@run+0.6+0.1", "estop@run+1.234567"});
  json found = replay(place, file, 0, {"-o", "again.run.h5"});
  expect_the_recording(found);
  EXPECT_EQ(found["remarks"], json::array());
  EXPECT_EQ(line(found, "samples missing")["recorded"], "30");
  EXPECT_THAT(line(found, "event")["replayed"].get<std::string>(), HasSubstr("estop at 1.234"));
  EXPECT_EQ(line(found, "end")["replayed"], "faulted: estop");
  EXPECT_EQ(runfile::read_run(place / "again.run.h5").missing("pressure"), 30);

  if (!std::filesystem::exists(image)) GTEST_SKIP() << "the firmware's image is not built: " << image;
  found = replay(place, file, 0, {"--image", image});
  expect_the_recording(found);
  EXPECT_THAT(found["firmware"].get<std::string>(), HasSubstr("stm32f405"));
}

TEST(Replay, ATamperedRunIsFoundWithItsPlace) {
  const Workplace place;
  runfile::RecordedRun tampered = runfile::read_run(place / record(place, "2", {}));
  tampered.trigger_s.back() += 0.001;
  tampered.pump.commanded_mL[600] += 0.05;
  EXPECT_GT(tampered.pump.time_s[600], tampered.trigger_s.back());
  write_run(place / "tampered.run.h5", tampered);
  const json found = replay(place, "tampered.run.h5", 1);
  EXPECT_EQ(found["equal"], false);
  EXPECT_EQ(found["triggers_equal"], false);
  EXPECT_EQ(found["steps_equal"], false);
  EXPECT_EQ(found["pressure_equal"], true) << "the instrument plays what the file says";
  EXPECT_NEAR(found["max_trigger_diff_s"], -0.001, 2e-8);
  EXPECT_EQ(found["max_steps_diff"], 6);
  EXPECT_EQ(found["first_difference"]["time_s"], tampered.trigger_s.back());
  EXPECT_EQ(found["first_difference"]["cycle"], 1);
  EXPECT_THAT(found["first_difference"]["text"].get<std::string>(), HasSubstr("trigger 1"));
}

TEST(Replay, ALostLineIsLostAgain) {
  const Workplace place;
  const json found = replay(place, record(place, "2", {"serial-hangup@run+1"}), 0);
  expect_the_recording(found);
  EXPECT_EQ(line(found, "end")["replayed"], "link_lost");
}

TEST(Replay, SwitchesAndAResetComeAgain) {
  struct Happening {
    const char* fault;
    const char* end;
  };
  for (const auto& [fault, end] : {Happening{"far-limit@run+1.1", "faulted: limit_switch"},
                                   Happening{"home-limit@run+1.1", "faulted: home_switch"},
                                   Happening{"power-cut@run+1.0:off@run+1.1", "link_lost"}}) {
    SCOPED_TRACE(fault);
    const Workplace place;
    const json found = replay(place, record(place, "3", {fault}), 0);
    expect_the_recording(found);
    EXPECT_EQ(line(found, "end")["recorded"], end);
    EXPECT_EQ(line(found, "end")["replayed"], end);
  }
}

TEST(Replay, ALostLeaseComesAgainToAHeartbeatAndParts) {
  const Workplace place;
  const std::string file = record(place, "3", {"serial-deaf@run+0.7:off@run+1.6"});
  const Ended ended = run(place, {"diastole", "replay", file, "--json"});
  const json found = ended.json();
  EXPECT_EQ(line(found, "end")["recorded"], "faulted: lease_lost");
  EXPECT_EQ(line(found, "end")["replayed"], "faulted: lease_lost");
  EXPECT_EQ(line(found, "event")["verdict"], "equal") << "to a heartbeat";
  EXPECT_EQ(found["triggers_equal"], true);
  EXPECT_EQ(found["pressure_equal"], true);
  // The stop begins by as much earlier or later: the positions from there on differ, and no others.
  if (found["steps_equal"] == true) return;
  EXPECT_EQ(ended.exit_code, 1);
  EXPECT_GT(found["first_difference"]["time_s"], 0.7) << "the host was heard until then";
}

TEST(Replay, ARunOfAnInstrumentThatKeepsARateOfItsOwnHasThatRateAgain) {
  const Workplace place;
  place.write("usb.experiment.toml",
              "sample_rate_Hz = 300.48\n" + with(gel_experiment("2"), "sample_rate_Hz = 300\n", ""));
  const Ended recorded = run(place, {"diastole", "simulate", "usb.experiment.toml", "-o", "even.run.h5"});
  ASSERT_EQ(recorded.exit_code, 0) << recorded.err;
  // The USB-1208LS makes 300.48 Hz of the 300 Hz that the experiment asks for.
  runfile::RecordedRun usb = runfile::read_run(place / "even.run.h5");
  EXPECT_EQ(std::get<double>(usb.rig.at("daq_rate_Hz")), 300.48);
  usb.protocol_toml = gel_experiment("2");
  write_run(place / "usb.run.h5", usb);
  const json found = replay(place, "usb.run.h5", 0);
  expect_the_recording(found);
  EXPECT_EQ(line(found, "samples")["recorded"], line(found, "samples")["replayed"]);
}

TEST(Replay, InRealTimeItMovesAsTheRecordingDid) {
  const Workplace place;
  place.write("gel.experiment.toml", gel_experiment("1"));
  place.write("patient.rig.toml", with_longest_lease(two_channel_rig()));
  ASSERT_EQ(run(place, {"diastole", "simulate", "gel.experiment.toml", "-o", "gel.run.h5", "--config",
                        "patient.rig.toml"})
                .exit_code,
            0);
  const Ended ended = run(place, {"diastole", "replay", "gel.run.h5", "--real-time", "--json"});
  const json found =
      ended.json();  // on a busy machine samples may be missing: then it says so, with exit code 1
  EXPECT_EQ(ended.exit_code, found["equal"] == true ? 0 : 1) << ended.err;
  EXPECT_EQ(found["triggers_equal"], true) << ended.out;
  EXPECT_EQ(found["steps_equal"], true);
  EXPECT_EQ(line(found, "end")["replayed"], "completed");
}

/// A run that is stopped at the end of its cycle at 1.5 s; its run file and journal.
struct StoppedRun {
  std::string run_file, journal;
};

StoppedRun record_stopped(RigWithDaemon& rig) {
  rig.start_daemon();
  DaemonClient client = rig.client();
  client.call("rig.home");
  replay::Operator rig_operator(rig.path("control"), rig.path("socket"),
                                {{replay::Order::Kind::stop_at_cycle_end, 1.5, 0}});
  const json begun =
      client.call("run.start", {{"experiment", gel_experiment("8")}, {"file", "gel.experiment.toml"}});
  while (client.call("run.progress")["state"] != "done")
    rig_operator.attend();
  return {begun["run_file"], begun["journal"]};
}

TEST(Replay, AnOrderToStopIsGivenAgainAndAJournalThatBreaksOffIsPlayedAsFarAsItGoes) {
  RigWithDaemon rig(RigWithDaemon::Time::conducted, two_channel_rig());
  const StoppedRun stopped = record_stopped(rig);
  json found = replay(rig.place, stopped.run_file, 0);
  expect_the_recording(found);
  EXPECT_EQ(line(found, "triggers")["recorded"], "2");
  EXPECT_EQ(line(found, "end")["replayed"], "stopped_at_cycle_end");

  std::filesystem::resize_file(stopped.journal, std::filesystem::file_size(stopped.journal) / 2);
  found = replay(rig.place, stopped.journal, 0);
  expect_the_recording(found);
  EXPECT_EQ(line(found, "end")["recorded"], "broken off");
}

TEST(Replay, OneThatIsBrokenOffComparesNothingAndEndsWithExitCode1) {
  const Workplace place;
  Program replaying(place, {"diastole", "replay", record(place, "8", {}), "--real-time"});
  ASSERT_TRUE(replaying.wait_for_text("cycle "));
  replaying.signal(SIGINT);
  const Ended ended = replaying.wait();
  EXPECT_EQ(ended.exit_code, 1);
  EXPECT_EQ(ended.out, "");
  EXPECT_THAT(ended.err, HasSubstr("gel.run.h5: the replay was broken off; nothing was compared"));
}

TEST(Replay, WhatCannotBeReplayedIsRefusedWithWhatItLacks) {
  const Workplace place;
  place.write("no.run.h5", "no run file");
  Ended ended = run(place, {"diastole", "replay", "no.run.h5"});
  EXPECT_EQ(ended.exit_code, 2);
  EXPECT_THAT(ended.err, HasSubstr("no.run.h5"));
  ended = run(place, {"diastole", "replay", "missing.run.h5"});
  EXPECT_EQ(ended.exit_code, 2);
  runfile::RecordedRun empty =
      runfile::read_run(std::filesystem::path(DIASTOLE_SOURCE_DIR) / "examples/recorded-preload.run.h5");
  empty.protocol_toml = "";
  empty.segments.clear();
  empty.flow.clear();
  write_run(place / "empty.run.h5", empty);
  ended = run(place, {"diastole", "replay", "empty.run.h5"});
  EXPECT_EQ(ended.exit_code, 2);
  EXPECT_THAT(ended.err, HasSubstr("/protocol/segments"));
  ended = run(place, {"diastole", "replay", "empty.run.h5", "-o", "empty.run.h5", "--force"});
  EXPECT_EQ(ended.exit_code, 2) << "the recording itself is never replaced";
  EXPECT_TRUE(std::filesystem::is_empty(place.temporary()));
}

}  // namespace
}  // namespace diastole::flow
