// From an imaging study's schedule to the frames' pressures, by whole programs; and the catheter's test.

#include <gmock/gmock.h>

#include <chrono>
#include <cmath>

#include "protocol/signal/step_response.hpp"
#include "tests/flow/programs.hpp"
#include "tests/flow/rig_with_daemon.hpp"
#include "tests/host/bench/run_in_memory.hpp"
#include "tests/sanitized.hpp"
#include "tools/benchmarks/long_journal.hpp"
#include "tools/benchmarks/timed_process.hpp"

namespace diastole::flow {
namespace {

using namespace nlohmann::literals;
using nlohmann::json;
using testing::HasSubstr;

constexpr const char* study_toml = R"(format = "diastole-experiment"
version = 1
[[segment]]
waveform = "parabolic"
stroke_mL = 40
period_s = 1.2
[schedule]
dummy_cycles = 2
pause_cycles = 1
[[schedule.block]]
name = "tagged"
slices = 2
lines = 28
lines_per_segment = 7
prompt = "Set the next slice."
[[schedule.block]]
name = "flow"
cycles_per_slice = 4
frames = 32
tr_ms = 75
gate_every = 2
)";

TEST(Study, IsToldBeforeItStarts) {
  const Workplace workplace;
  workplace.write("study.experiment.toml", study_toml);
  const Ended words = run(workplace, {"diastole", "run", "study.experiment.toml", "--dry-run"});
  EXPECT_EQ(words.exit_code, 0) << words.err;
  EXPECT_THAT(words.out, HasSubstr("tagged: 2 slices of 4 cycles after 2 dummy cycles"));
  EXPECT_THAT(words.out, HasSubstr("20 cycles, about 25 s, and the time of waiting for you"));
  const json plan =
      run(workplace, {"diastole", "run", "study.experiment.toml", "--dry-run", "--json"}).json();
  EXPECT_EQ(plan.at("cycles"), 20);
  EXPECT_EQ(plan.at("slices"), 3);
}

TEST(Study, BecomesSlicesFramesAndABidsRecording) {
  const Workplace workplace;
  workplace.write("study.experiment.toml", study_toml);
  workplace.write("times.csv", "frame,trigger_time_ms,width_ms\n0,20,60\n1,320,60\n2,620,60\n3,920,60\n");
  const Ended simulated =
      run(workplace, {"diastole", "simulate", "study.experiment.toml", "-o", "study.run.h5", "--json"});
  ASSERT_EQ(simulated.exit_code, 0) << simulated.err;
  EXPECT_EQ(simulated.json().at("end"), "completed");
  // Each prompt is answered at the same moment of simulated time, however fast the machine is.
  const json again =
      run(workplace, {"diastole", "simulate", "study.experiment.toml", "-o", "again.run.h5", "--json"})
          .json();
  EXPECT_EQ(again.at("triggers"), 21) << "one cycle passes at the prompt between the slices";
  EXPECT_EQ(simulated.json().at("triggers"), 21);

  const Ended inspected = run(workplace, {"diastole", "inspect", "study.run.h5", "--json"});
  EXPECT_EQ(inspected.exit_code, 0) << inspected.out;
  const json slices = inspected.json().at("slices");
  ASSERT_EQ(slices.size(), 3U);
  EXPECT_EQ(slices[2].at("block"), "flow");
  for (const json& slice : slices)
    EXPECT_EQ(slice.at("triggers"), 4);
  EXPECT_EQ(inspected.json().at("trigger_faults"), (json{{"missing", 0}, {"extra", 0}, {"non_periodic", 0}}));

  const Ended binned = run(workplace, {"diastole", "bin", "study.run.h5", "--frame-times", "times.csv",
                                       "--slice", "1", "--frames-csv", "study.frames.csv", "--json"});
  ASSERT_EQ(binned.exit_code, 0) << binned.err;
  EXPECT_EQ(binned.json().at("frames").size(), 4U);
  EXPECT_EQ(binned.json().at("frames")[0].at("cycles"), 4);
  EXPECT_NEAR(binned.json().at("delay_removed_s").get<double>(), 0.6 / (M_PI * 60), 1e-6);
  EXPECT_THAT(run_line(workplace, "head -2 study.frames.csv").out,
              testing::StartsWith("frame,time_s,pressure_kPa,sigma_kPa\n0,0.050000,"));
  EXPECT_EQ(run(workplace, {"diastole", "bin", "study.run.h5", "--frame-times", "times.csv", "--frames-csv",
                            "study.frames.csv"})
                .exit_code,
            2);

  const json scheduled = run(workplace, {"diastole", "bin", "study.run.h5", "--slice", "2", "--json"}).json();
  ASSERT_EQ(scheduled.at("frames").size(), 32U) << "as the block flow says";
  EXPECT_NEAR(scheduled.at("frames")[1].at("from_s").get<double>(), 0.075, 1e-9);
  EXPECT_EQ(run(workplace, {"diastole", "bin", "study.run.h5", "--slice", "0", "--json"})
                .json()
                .at("frames")
                .size(),
            16U)
      << "the block tagged says nothing";

  const Ended too_long =
      run(workplace, {"diastole", "bin", "study.run.h5", "--tr-ms", "188", "--frames", "16"});
  EXPECT_EQ(too_long.exit_code, 2);
  EXPECT_THAT(too_long.err, HasSubstr("longer than the cycle"));

  const Ended exported =
      run(workplace, {"diastole", "export", "study.run.h5", "--bids", "bids", "--subject", "03", "--json"});
  ASSERT_EQ(exported.exit_code, 0) << exported.err;
  EXPECT_TRUE(std::filesystem::exists(workplace / "bids/sub-03_task-study_physio.tsv.gz"));
  EXPECT_EQ(run_line(workplace, "gzip -cd bids/*.tsv.gz | wc -l").out,
            std::to_string(exported.json().at("rows").get<int>()) + "\n");
}

TEST(Study, GoesOnWithTheNextSliceWhenItWasStopped) {
  RigWithDaemon rig(RigWithDaemon::Time::conducted);
  rig.start_daemon();
  rig.place.write("study.experiment.toml", study_toml);
  const std::vector<std::string> resume{
      "diastole", "run",      "study.experiment.toml", "-o",    "rest.run.h5",
      "--resume", "--socket", rig.path("socket"),      "--json"};
  auto client = rig.client();
  home(client);
  const Ended too_early = run(rig.place, resume);
  EXPECT_EQ(too_early.exit_code, 2);
  EXPECT_THAT(too_early.err, HasSubstr("has no session to resume"));

  // Simulated time races on, but a session waits at its prompts.
  const auto waits_at = [&client](int slice) {
    const json progress = client.call("run.progress");
    return progress.at("state") == "running" &&  // and not the end of a run before
           progress.value("/schedule/phase"_json_pointer, "") == "waiting" &&
           progress.value("/schedule/slice"_json_pointer, -1) == slice;
  };
  const auto wait_until = [&client](const auto& reached) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    while (!reached() && std::chrono::steady_clock::now() < end) {
    }
    ASSERT_TRUE(reached()) << client.call("run.progress").dump();
  };
  client.call("run.start", {{"experiment", study_toml}, {"file", "study.experiment.toml"}});
  wait_until([&] { return waits_at(0); });
  client.call("run.continue", {{"slice", 0}});
  wait_until([&] { return waits_at(1); });
  client.call("run.stop");
  wait_until([&] { return client.call("run.progress").at("state") == "done"; });
  EXPECT_EQ(client.call("run.progress").at("result").at("end"), "stopped_now");
  client.call("control.release");

  Program resumed(rig.place, resume);
  wait_until([&] { return waits_at(1); });
  client.call("run.continue", {{"slice", 1}});
  const Ended rest = resumed.wait();
  ASSERT_EQ(rest.exit_code, 0) << rest.err;
  EXPECT_THAT(rest.err, HasSubstr("goes on: 1 of its 3 slices are imaged"));
  EXPECT_THAT(rest.err, HasSubstr("slice 2 of 3: 4 cycles of tagged"));
  const json slices = run(rig.place, {"diastole", "inspect", "rest.run.h5", "--json"}).json().at("slices");
  ASSERT_EQ(slices.size(), 2U);
  EXPECT_EQ(slices[0].at("slice"), 1);
  EXPECT_EQ(slices[1].at("block"), "flow");
  for (const json& slice : slices)
    EXPECT_EQ(slice.at("triggers"), 4);
  // How many cycles pass at the prompt is nobody's plan; all others are.
  const int last = slices[1].at("first_trigger");
  EXPECT_EQ(last - slices[0].at("first_trigger").get<int>(), 4 + 1 + 2);
  EXPECT_GE(slices[0].at("first_trigger"), 2);
  EXPECT_EQ(rest.json().at("triggers"), last + 4);
  std::filesystem::remove(rig.place / "rest.run.h5");
  EXPECT_THAT(run(rig.place, resume).err, HasSubstr("nothing left to do: all 3 slices"));
}

TEST(RunFile, OfALongRunIsMadeAndReadInAsMuchMemoryAsOfAShortOne) {
  if (sanitized) GTEST_SKIP() << "sanitizers keep freed memory";
  const Workplace place;
  /// Of `diastole recover`, `inspect` and `bin`.
  const auto memory_MB = [&](int seconds) {
    std::filesystem::remove(place / "long.journal");
    write_long_journal(place / "long.journal", {.channels = 10, .rate_Hz = 10'000, .seconds = seconds});
    const ProcessCost figures = run_timed({DIASTOLE_BIN_DIR "/diastole", "recover", place / "long.journal",
                                           "-o", place / "long.run.h5", "--force"},
                                          place.path(), place / "log");
    EXPECT_EQ(figures.exit_code, 0);
    std::vector<double> peaks_MB{figures.peak_MB};
    for (const char* command : {"inspect", "bin"}) {
      const ProcessCost reading = run_timed({DIASTOLE_BIN_DIR "/diastole", command, place / "long.run.h5"},
                                            place.path(), place / "log");
      EXPECT_EQ(reading.exit_code, 0) << command;
      peaks_MB.push_back(reading.peak_MB);
    }
    return peaks_MB;
  };
  const std::vector<double> of_short_MB = memory_MB(2), of_long_MB = memory_MB(20);
  for (size_t i = 0; i < of_short_MB.size(); ++i)
    EXPECT_LT(of_long_MB[i], of_short_MB[i] + 8) << "16 MB more of samples";
}

TEST(Catheter, IsFoundInAPopTestAndDrawn) {
  const Workplace workplace;
  runfile::RecordedRun run_of_pops;
  run_of_pops.run_id = run_of_pops.started_utc = run_of_pops.producer = "test";
  run_of_pops.segments = {{0, "hold", 0, 6, 0, 1}};
  const signal::SecondOrder catheter{45, 0.3};
  unsigned noise = 1;
  for (int i = 0; i < 1800; ++i) {
    const double t = i / 300.0;
    noise = noise * 1664525U + 1013904223U;
    const double pops_kPa = 8 - 8 * unit_step(catheter, t - 1.501) + 8 * unit_step(catheter, t - 3.7);
    run_of_pops.pressure.time_s.push_back(t);
    run_of_pops.pressure.channels["cavity_kPa"].push_back(pops_kPa + 0.05 * (noise / 4294967296.0 - 0.5));
    run_of_pops.pump.time_s.push_back(t);
    run_of_pops.pump.commanded_mL.push_back(0);
  }
  write_run(workplace / "pop.run.h5", run_of_pops);
  const Ended found = run(workplace, {"diastole", "catheter", "pop.run.h5", "-o", "catheter.html", "--json"});
  ASSERT_EQ(found.exit_code, 0) << found.err;
  EXPECT_NEAR(found.json().at("f0_Hz").at("value").get<double>(), 45, 0.2);
  EXPECT_NEAR(found.json().at("zeta").at("value").get<double>(), 0.3, 0.005);
  EXPECT_EQ(found.json().at("steps").size(), 2U);
  EXPECT_THAT(run_line(workplace, "head -c 400 catheter.html").out, HasSubstr("diastole report"));
}

TEST(Catheter, IsNotFoundInACyclingRun) {
  const Workplace workplace;
  const Ended refused =
      run(workplace,
          {"diastole", "catheter", std::string(DIASTOLE_SOURCE_DIR) + "/examples/recorded-baseline.run.h5"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("no step between two quiet levels"));
  EXPECT_THAT(refused.err, HasSubstr("pop test"));
}

}  // namespace
}  // namespace diastole::flow
