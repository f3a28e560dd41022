// An hour of cycles through the whole simulated rig, as fast as it goes, the instrument gone for moments in it: every
// sample is there or declared, every trigger is there, and the daemon's memory does not grow with the run.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "protocol/runfile/reader.hpp"
#include "tests/flow/rig_with_daemon.hpp"
#include "tools/benchmarks/process_figures.hpp"

namespace diastole::flow {
namespace {

using nlohmann::json;

constexpr int cycles = 3000;
constexpr double period_s = 1.2;
constexpr double rest_s = 1;
constexpr double tail_s = 0.25;  // recorded beyond the last step (host/acquisition/acquisition.hpp)
constexpr double rate_Hz = 300;
constexpr uint64_t samples_a_minute = 18'000;

/// Resident memory of the daemon at each full minute of the run, in MB.
std::vector<double> follow(DaemonClient& client, pid_t daemon) {
  std::vector<double> resident_MB;
  for (json progress; progress.is_null() || progress["state"] == "running";) {
    progress = client.call("run.progress", {{"first_remark", 0}});
    const uint64_t accounted = progress["received"].get<uint64_t>() + progress["missing"].get<uint64_t>();
    if (accounted >= (resident_MB.size() + 1) * samples_a_minute)
      resident_MB.push_back(figures_of(daemon).resident_MB);
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  return resident_MB;
}

TEST(Hour, LosesNothingUntoldAndKeepsItsMemory) {
  RigWithDaemon rig(RigWithDaemon::Time::conducted, source_text("examples/rig.toml"),
                    {"--fault", "daq-drop@ttl+1800+0.7"});
  rig.start_daemon();
  auto client = rig.client();
  client.call("rig.home");
  const auto begun = std::chrono::steady_clock::now();
  client.call("run.start",
              {{"experiment", fmt::format("format = \"diastole-experiment\"\nversion = 1\nrest_s = {}\n"
                                          "[[segment]]\nwaveform = \"parabolic\"\nstroke_mL = 40.0\n"
                                          "period_s = {}\ncycles = {}\n",
                                          rest_s, period_s, cycles)},
               {"file", "hour.experiment.toml"}});
  const std::vector<double> resident_MB = follow(client, rig.daemon->pid());
  json progress = client.call("run.progress");
  for (; progress["state"] == "writing"; progress = client.call("run.progress"))
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - begun;
  ASSERT_EQ(progress["state"], "done") << progress.dump();
  const json result = progress["result"];
  EXPECT_EQ(result["end"], "completed");

  const auto run = runfile::read_run(result["run_file"].get<std::string>());
  // By the clocks, and not by counting samples: from the start of run until tail_s after the controller's end.
  ASSERT_TRUE(run.pressure.grid && run.pump.grid);
  EXPECT_LT(run.pressure.grid->start_s, 1 / rate_Hz);
  EXPECT_NEAR(run.pressure.grid->rate_Hz, rate_Hz, 1e-3 * rate_Hz);
  EXPECT_NEAR(run.pressure.grid->end_s, rest_s + cycles * period_s + tail_s, 0.02);
  const int64_t expected = run.pressure.grid->rows();
  EXPECT_EQ(result["samples"].get<int64_t>() + result["gaps"].get<int64_t>(), expected);
  EXPECT_EQ(result["expected"], expected);
  EXPECT_EQ(std::ssize(run.pressure.time_s), expected);
  EXPECT_EQ(std::ssize(run.pump.time_s), run.pump.grid->rows());
  EXPECT_EQ(static_cast<int64_t>(result["gaps"]), run.missing("pressure"));
  EXPECT_GE(result["gaps"], 200) << "0.7 s without the instrument";
  EXPECT_LE(result["gaps"], 600);
  EXPECT_EQ(run.trigger_s.size(), static_cast<size_t>(cycles));
  EXPECT_EQ(run.missing("trigger"), 0);

  ASSERT_GE(resident_MB.size(), 30U);
  const std::span<const double> settled = std::span(resident_MB).subspan(5);
  const double slope_kB_a_minute = 1e3 * slope_per_interval(settled);
  EXPECT_LT(slope_kB_a_minute, 20);
  fmt::print(
      "{} samples + {} declared missing, {} triggers; resident {:.1f} to {:.1f} MB, {:+.1f} kB a minute; "
      "{:.0f} s of wall time\n",
      result["samples"].get<size_t>(), result["gaps"].get<size_t>(), run.trigger_s.size(), settled.front(),
      settled.back(), slope_kB_a_minute, wall.count());
}

}  // namespace
}  // namespace diastole::flow
