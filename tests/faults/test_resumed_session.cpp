// A session of slices whose daemon is killed again and again; each time run.start takes it up, as `diastole run --resume` asks it to.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <fstream>
#include <map>
#include <set>
#include <thread>

#include "protocol/contract/input_error.hpp"
#include "protocol/runfile/layout.hpp"
#include "protocol/runfile/reader.hpp"
#include "tests/faults/fault_table.hpp"
#include "tests/flow/rig_with_daemon.hpp"

namespace diastole::faults {
namespace {

using namespace std::chrono_literals;
using flow::RigWithDaemon;
using nlohmann::json;

constexpr double period_s = 0.3, sample_rate_Hz = 300;
constexpr int64_t slices = 40, cycles_per_slice = 2;
constexpr int kills_per_session = 14;
constexpr double most_lost_s = 1;  // by a kill

const std::string study = fmt::format(
    "format = \"diastole-experiment\"\nversion = 1\nrest_s = 0.2\n[[segment]]\nwaveform = "
    "\"parabolic\"\nstroke_mL = 2\n"
    "period_s = {}\n[schedule]\ndummy_cycles = 1\npause_cycles = 1\n[[schedule.block]]\nname = "
    "\"tagged\"\nslices = {}\n"
    "cycles_per_slice = {}\n",
    period_s, slices, cycles_per_slice);

/// What a person does at a rig that he finds: clears the fault of the lease that has run out, and homes.
void make_ready(DaemonClient& client) {
  const json found = client.call("rig.status");
  EXPECT_TRUE(found["state"] == "unhomed" || found["state"] == "homed" || found["state"] == "faulted")
      << found.dump();
  EXPECT_TRUE(client.call("run.progress").is_null()) << "it runs by itself";
  if (found["state"] == "faulted") client.call("rig.clear_fault");
  if (client.call("rig.status")["state"] != "homed") client.call("rig.home", json::object(), 300s);
}

using SamplesOfRuns = std::map<std::string, uint64_t>;  ///< by run_id

/// True when the run came to its end; otherwise the daemon was killed when it had so many samples. How many, `received` keeps.
bool run_or_kill(RigWithDaemon& rig, bool resume, uint64_t samples, SamplesOfRuns& received) {
  rig.start_daemon();
  auto client = rig.client();
  make_ready(client);
  try {
    client.call("run.start", {{"experiment", study}, {"file", "study.experiment.toml"}, {"resume", resume}},
                60s);
  } catch (const InputError& error) {
    EXPECT_TRUE(std::string(error.what()).find("nothing left to do") != std::string::npos) << error.what();
    return true;  // the kill before came after the last slice
  }
  for (uint64_t now = 0; now < samples;) {
    const json progress = client.call("run.progress");
    now = received[progress["run_id"]] = progress["received"];
    if (now < samples && progress["state"] == "done") return true;
  }
  rig.daemon->signal(SIGKILL);
  rig.daemon->wait();
  rig.daemon.reset();
  return false;
}

/// Slices of a run of which it holds everything until the end of their last cycle.
std::set<int64_t> whole_slices(const runfile::RecordedRun& run) {
  std::set<int64_t> whole;
  if (run.pressure.time_s.empty() || run.pump.time_s.empty()) return whole;
  const double until_s = std::min(run.pressure.time_s.back(), run.pump.time_s.back()) + 2.0 / 300;
  for (const runfile::Slice& slice : run.slices) {
    if (slice.triggers < slice.cycles) continue;
    const double last_s = run.trigger_s.at(static_cast<size_t>(slice.first_trigger + slice.triggers - 1));
    const auto hidden = std::ranges::any_of(run.gaps, [&](const runfile::Gap& gap) {
      const auto& time_s = gap.stream == "pump" ? run.pump.time_s : run.pressure.time_s;
      return gap.stream != "trigger" && time_s.at(static_cast<size_t>(gap.first_index)) < last_s + period_s;
    });
    if (until_s >= last_s + period_s && !hidden) whole.insert(slice.number);
  }
  return whole;
}

size_t raised_triggers(const std::filesystem::path& pins) {
  size_t raised = 0;
  std::ifstream file(pins);
  for (std::string line; std::getline(file, line);)
    raised += line.ends_with(",TTL,1") ? 1 : 0;
  return raised;
}

/// What the run files hold that are made of the journals.
struct Recorded {
  std::map<int64_t, int> times;  ///< that each slice was imaged whole
  SamplesOfRuns samples;
  size_t triggers = 0;
};

Recorded recorded_by(const RigWithDaemon& rig) {
  Recorded recorded;
  for (const auto& entry : std::filesystem::directory_iterator(rig.place / "journals")) {
    if (entry.path().extension() != ".journal") continue;
    const flow::Ended recovered =
        flow::run(rig.place, {"diastole", "recover", entry.path(), "-o", "part.run.h5", "--force", "--json"});
    EXPECT_LE(recovered.exit_code, 1) << recovered.err;
    if (recovered.json()["run"].is_null()) continue;
    const auto run = runfile::read_run(rig.place / "part.run.h5");
    recorded.triggers += run.trigger_s.size();
    recorded.samples[run.run_id] =
        run.pressure.time_s.size() - static_cast<size_t>(run.missing(runfile::pressure_stream));
    for (const int64_t slice : whole_slices(run))
      ++recorded.times[slice];
  }
  return recorded;
}

/// Of any run, of what its daemon had received.
uint64_t most_lost_samples(const SamplesOfRuns& received, SamplesOfRuns recorded) {
  uint64_t most = 0;
  for (const auto& [run_id, samples] : received)
    most = std::max(most, samples - std::min(samples, recorded[run_id]));
  return most;
}

/// The connection before gives the control back when the daemon sees its end, which may be a moment later.
void resume_with_control(DaemonClient& client) {
  for (int tries = 100; true; --tries) {
    try {
      client.call("run.start", {{"experiment", study}, {"file", "study.toml"}, {"resume", true}});
      return;
    } catch (const HardwareError&) {
      if (tries == 0) throw;
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
  }
}

TEST(Faults, SessionKilledAndResumed) {
  int kills = 0;
  size_t unrecorded = 0;
  uint64_t lost_samples = 0;
  const int tried = trials(1, 18);
  const int survived = survivors(tried, [&](int, std::mt19937& random) {
    RigWithDaemon rig(RigWithDaemon::Time::conducted, flow::source_text("examples/rig.toml"),
                      {"--pins", "pins.csv"});
    bool done = false;
    SamplesOfRuns received;
    for (int attempt = 0; !done && attempt < 100; ++attempt) {
      const bool kill = attempt < kills_per_session;
      done = run_or_kill(rig, attempt > 0, kill ? static_cast<uint64_t>(between(random, 0, 1200)) : 1'000'000,
                         received);
      kills += done ? 0 : 1;
    }
    if (!done) return false;
    auto client = rig.client();
    EXPECT_THROW(resume_with_control(client), InputError) << "nothing is left";
    rig.daemon->signal(SIGTERM);
    EXPECT_EQ(rig.daemon->wait().exit_code, 0);
    rig.daemon.reset();
    rig.end_rig();
    const Recorded recorded = recorded_by(rig);
    const size_t cycles = raised_triggers(rig.place / "pins.csv") - recorded.triggers;
    EXPECT_LE(static_cast<double>(cycles) * period_s, kills_per_session * most_lost_s);
    unrecorded = std::max(unrecorded, cycles);
    const uint64_t lost = most_lost_samples(received, recorded.samples);
    EXPECT_LE(static_cast<double>(lost), most_lost_s * sample_rate_Hz);
    lost_samples = std::max(lost_samples, lost);
    const bool each_once =
        std::ssize(recorded.times) == slices &&
        std::ranges::all_of(recorded.times, [](const auto& slice) { return slice.second == 1; });
    EXPECT_TRUE(each_once) << json(recorded.times).dump();
    return each_once;
  });
  EXPECT_GE(kills, 8 * tried);
  add_to_table({"session killed, resumed", fmt::format("{} kills at random moments of a study", kills), tried,
                survived,
                fmt::format("no slice lost or repeated; {} received samples of a run and {} cycles of a "
                            "session unrecorded at most",
                            lost_samples, unrecorded)});
}

}  // namespace
}  // namespace diastole::faults
