// Faults of the programs' surroundings: the daemon killed, its line pulled out, its wall clock moved, its socket
// attacked.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <functional>
#include <optional>

#include "host/transport/conducted_clock.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/runfile/reader.hpp"
#include "tests/faults/fault_table.hpp"
#include "tests/faults/hostile_clients.hpp"
#include "tests/flow/rig_with_daemon.hpp"
#include "tests/sanitized.hpp"

namespace diastole::faults {
namespace {

using namespace std::chrono_literals;
using flow::Ended;
using flow::RigWithDaemon;
using nlohmann::json;
using Time = RigWithDaemon::Time;

struct LastEdge {
  double first_ttl_s = -1;
  double last_s = -1;
};

/// From the rig's pin trace: when the first TTL rose, and when anything last moved.
LastEdge last_edge(const std::filesystem::path& pins) {
  LastEdge edge;
  std::ifstream file(pins);
  for (std::string line; std::getline(file, line);) {
    if (line.empty() || std::isdigit(static_cast<unsigned char>(line[0])) == 0) continue;
    edge.last_s = 1e-9 * std::stod(line);
    if (edge.first_ttl_s < 0 && line.ends_with(",TTL,1")) edge.first_ttl_s = edge.last_s;
  }
  return edge;
}

std::filesystem::path only_journal(const RigWithDaemon& rig) {
  std::filesystem::path found;
  for (const auto& entry : std::filesystem::directory_iterator(rig.place / "journals"))
    if (entry.path().extension() == ".journal") found = entry.path();
  return found;
}

struct Recovered {
  double recorded_s = 0;   ///< from the first trigger to the last position
  bool accounted = false;  ///< every sample until then is there or declared missing
};

/// Reads it, which refuses a run file with a corrupt row.
Recovered recovered_from(const std::filesystem::path& file) {
  const auto run = runfile::read_run(file);
  if (run.trigger_s.empty() || run.pressure.time_s.empty() || run.pump.time_s.empty()) return {0, true};
  const auto& samples = run.pressure;
  const bool whole = samples.grid && samples.grid->rows() == std::ssize(samples.time_s);
  const bool reaches = samples.time_s.back() > std::max(run.pump.time_s.back(), run.trigger_s.back()) - 0.01;
  return {run.pump.time_s.back() - run.trigger_s.front(), whole && reaches};
}

/// Has the daemon killed when it has `samples` of its run, received or missing, and a little later.
void kill_in_the_run(RigWithDaemon& rig, uint64_t samples, double later_s) {
  rig.start_daemon();
  auto client = rig.client();
  client.call("rig.home", json::object(), 300s);
  client.call("run.start", flow::many_segments());
  for (json progress; progress.is_null() ||
                      (progress["state"] == "running" &&
                       progress["received"].get<uint64_t>() + progress["missing"].get<uint64_t>() < samples);)
    progress = client.call("run.progress");
  std::this_thread::sleep_for(std::chrono::duration<double>(later_s));
  rig.daemon->signal(SIGKILL);
  rig.daemon->wait();
  rig.daemon.reset();
}

std::optional<Recovered> recover(const RigWithDaemon& rig) {
  const Ended recovered = flow::run(
      rig.place, {"diastole", "recover", only_journal(rig).string(), "-o", "saved.run.h5", "--json"});
  if (recovered.exit_code != 0 && recovered.exit_code != 1) {
    ADD_FAILURE() << recovered.exit_code << recovered.err;
    return std::nullopt;
  }
  if (recovered.json()["run"].is_null()) return Recovered{0, true};
  return recovered_from(rig.place / "saved.run.h5");
}

TEST(Faults, DaemonKilled) {
  double most_lost_s = 0;
  int during_the_run = 0;
  const int tried = trials(8, 500);
  const int survived = survivors(tried, [&](int, std::mt19937& random) {
    auto rig = std::make_unique<RigWithDaemon>(Time::conducted, flow::source_text("examples/rig.toml"),
                                               std::vector<std::string>{"--pins", "pins.csv"});
    kill_in_the_run(*rig, static_cast<uint64_t>(between(random, 0, 5500)),
                    between(random, 0, 0.002));  // of 18 s
    const auto recovered = recover(*rig);
    if (!recovered || !recovered->accounted) return false;
    const double recorded_s = recovered->recorded_s;
    rig->end_rig();
    const LastEdge edge = last_edge(rig->place / "pins.csv");
    if (edge.first_ttl_s < 0) return true;
    during_the_run += recorded_s > 0 ? 1 : 0;
    most_lost_s = std::max(most_lost_s, edge.last_s - edge.first_ttl_s - recorded_s);
    return edge.last_s - edge.first_ttl_s - recorded_s <= 1.0;
  });
  EXPECT_GT(during_the_run, tried / 2);
  add_to_table(
      {"kill -9 of the daemon", "random moments of a session", tried, survived,
       fmt::format("{:.0f} ms at most, 0 corrupt rows ({} in mid-run)", 1e3 * most_lost_s, during_the_run)});
}

TEST(Faults, DaemonKilledInAStall) {
  int64_t most_missing = 0;
  const int tried = trials(2, 100);
  const int survived = survivors(tried, [&](int, std::mt19937& random) {
    RigWithDaemon rig(Time::conducted, flow::source_text("examples/rig.toml"),
                      {"--fault", fmt::format("daq-drop@ttl+{}+60", 1 + random() % 3)});
    kill_in_the_run(rig, static_cast<uint64_t>(between(random, 1200, 5300)), between(random, 0, 0.002));
    const auto recovered = recover(rig);
    if (!recovered || !recovered->accounted) return false;
    const auto run = runfile::read_run(rig.place / "saved.run.h5");
    const int64_t missing = run.missing("pressure");
    most_missing = std::max(most_missing, missing);
    // The kill came after the end of the run: there is nothing more to tell than its gap.
    const bool over = run.pump.time_s.back() >= run.segments.back().end_s();
    const bool reported = !run.events.empty() && run.events.back().code == "incomplete" &&
                          run.events.back().time_s >= run.pump.time_s.back();
    return missing > 0 && (reported || over);
  });
  add_to_table({"kill -9 in a stall", "the instrument silent for up to 15 s", tried, survived,
                fmt::format("every sample there or declared, up to {} of them missing", most_missing)});
}

/// When the motor last made a step, from the rig's pin trace.
double last_step_s(const std::filesystem::path& pins) {
  double last_s = 0;
  std::ifstream file(pins);
  for (std::string line; std::getline(file, line);)
    if (line.find(",STEP,") != std::string::npos) last_s = 1e-9 * std::stod(line);
  return last_s;
}

/// How long after `since_s` on the rig's clock the run's link_lost was told; 0 when it has no trigger to tell by.
double report_delay_s(const std::filesystem::path& run_file, const std::filesystem::path& pins,
                      double since_s) {
  const auto run = runfile::read_run(run_file);
  if (run.trigger_s.empty()) return 0;
  const double start_s = last_edge(pins).first_ttl_s - run.trigger_s.front();
  const auto lost = std::ranges::find(run.events, "link_lost", &runfile::Event::code);
  return lost == run.events.end() ? 1e9 : start_s + lost->time_s - since_s;
}

/// Ends the daemon and lets time pass on the rig without one; returns its present.
double pass_without_daemon_s(RigWithDaemon& rig, double seconds) {
  rig.daemon->signal(SIGTERM);
  EXPECT_EQ(rig.daemon->wait().exit_code, 0);
  rig.daemon.reset();
  ConductedClock clock(rig.path("time"));
  const uint64_t now_ns = clock.now_ns();
  clock.sleep_until_ns(now_ns + static_cast<uint64_t>(1e9 * seconds), nullptr);
  return 1e-9 * static_cast<double>(now_ns);
}

TEST(Faults, LinePulledOut) {
  constexpr double lease_s = 0.5, away_s = 1.5;
  double slowest_report_s = 0, slowest_rest_s = 0, slowest_return_s = 0;
  const int tried = trials(3, 200);
  const int survived = survivors(tried, [&](int, std::mt19937& random) {
    const double out_s = between(random, 4, 12);
    RigWithDaemon rig(Time::conducted, flow::source_text("examples/rig.toml"),
                      {"--pins", "pins.csv", "--fault",
                       fmt::format("serial-hangup@{:.4f}:off@{:.4f}", out_s, out_s + away_s)});
    rig.start_daemon();
    const Ended homed = flow::run(rig.place, {"diastole", "home", "--socket", rig.path("socket")});
    rig.place.write("gel.experiment.toml", flow::source_text("examples/gel.experiment.toml"));
    const Ended ended = flow::run(rig.place, {"diastole", "run", "gel.experiment.toml", "-o", "gel.run.h5",
                                              "--socket", rig.path("socket"), "--json"});
    const double back_s = pass_without_daemon_s(rig, away_s + lease_s) + away_s + lease_s;
    rig.start_daemon();
    const json status = rig.client().call("rig.status");
    slowest_return_s = std::max(slowest_return_s, pass_without_daemon_s(rig, 1) - back_s);
    rig.end_rig();
    slowest_report_s =
        std::max(slowest_report_s, report_delay_s(rig.place / "gel.run.h5", rig.place / "pins.csv", out_s));
    slowest_rest_s = std::max(slowest_rest_s, last_step_s(rig.place / "pins.csv") - out_s);
    const json session = ended.json();
    const bool place_known = status["fault"] == "lease_lost" || status["state"] == "homed";
    return homed.exit_code == 0 && ended.exit_code == 3 && session["end"] == "link_lost" && place_known &&
           session["samples"].get<int64_t>() + session["gaps"].get<int64_t>() == session["expected"];
  });
  EXPECT_LE(slowest_report_s, 1);
  EXPECT_LE(slowest_rest_s, lease_s) << "and not a step from then on, with the line back and a daemon at it";
  EXPECT_LE(slowest_return_s, 2);
  add_to_table({"pty hang-up", "the line pulled out of the daemon", tried, survived,
                fmt::format("reported in {:.0f} ms, at rest in {:.0f} ms and from then on, back in {:.0f} ms",
                            1e3 * slowest_report_s, 1e3 * slowest_rest_s, 1e3 * slowest_return_s)});
}

/// Waits until the run has so many samples; false if it ends before.
bool received(DaemonClient& client, uint64_t samples) {
  for (;;) {
    const json progress = client.call("run.progress");
    if (progress.is_object()) {
      if (progress["received"] >= samples) return true;
      if (progress["state"] != "running") return false;
    }
    std::this_thread::sleep_for(10ms);
  }
}

TEST(Faults, WallClockJumps) {
  constexpr const char* library = "/usr/lib/x86_64-linux-gnu/faketime/libfaketime.so.1";
  if (sanitized) GTEST_SKIP() << "libfaketime and sanitizers do not go together";
  if (!std::filesystem::exists(library)) GTEST_SKIP() << "libfaketime is not installed (package faketime)";
  const int tried = trials(2, 10);
  double largest_step_s = 0;
  const int survived = survivors(tried, [&](int k, std::mt19937&) {
    RigWithDaemon rig(Time::real);
    const auto set = [&](const char* offset) { std::ofstream(rig.path("offset")) << offset << '\n'; };
    set("+0");
    rig.start_daemon({"/usr/bin/env", std::string("LD_PRELOAD=") + library,
                      "FAKETIME_TIMESTAMP_FILE=" + rig.path("offset"), "FAKETIME_NO_CACHE=1",
                      "FAKETIME_DONT_FAKE_MONOTONIC=1"});
    auto client = rig.client();
    client.call("rig.home");
    const json begun = client.call("run.start", flow::many_segments());
    EXPECT_TRUE(received(client, 200));
    set(k % 2 == 0 ? "+3600" : "-3600");
    EXPECT_TRUE(received(client, 400));
    client.call("run.stop");
    const json status = flow::status_when(client, "homed", true);
    const auto run = runfile::read_run(begun["run_file"].get<std::string>());
    for (size_t i = 1; i < run.pressure.time_s.size(); ++i)
      largest_step_s = std::max(largest_step_s, run.pressure.time_s[i] - run.pressure.time_s[i - 1]);
    // Neither the axis nor its length knows of the hour.
    return status["fault"].is_null() && run.pressure.time_s.size() > 300 && run.pressure.time_s.back() < 60;
  });
  EXPECT_LT(largest_step_s, 60);
  add_to_table({"wall clock jumps", "one hour forth and back, in mid-run", tried, survived,
                "the run's time axis knows nothing of it"});
}

/// Resident memory of a process.
double resident_MB(pid_t process) {
  std::ifstream file(fmt::format("/proc/{}/statm", process));
  double pages = 0;
  file >> pages >> pages;
  return pages * static_cast<double>(::sysconf(_SC_PAGESIZE)) / 1e6;
}

/// Runs the session, for `most` at the longest, and returns the daemon's last word of it.
json run_for(DaemonClient& client, std::chrono::steady_clock::duration most) {
  const auto end = std::chrono::steady_clock::now() + most;
  client.call("run.start", flow::many_segments(), 60s);
  for (bool stopped = false;;) {
    json progress = client.call("run.progress");
    if (progress["state"] == "done" || progress["state"] == "failed") return progress;
    if (!stopped && std::chrono::steady_clock::now() > end) {
      client.call("run.stop", {{"how", "now"}});
      stopped = true;
    }
    std::this_thread::sleep_for(20ms);
  }
}

/// Every sample that was due while the pump's motion was recorded has its row, and each row without a pressure is declared.
bool nothing_hidden(const json& result) {
  const auto run =
      runfile::read_run(result["run_file"].get<std::string>());  // refuses a NaN outside a declared gap
  const auto& rows_s = run.pressure.time_s;
  const auto rows = std::ssize(rows_s);
  if (rows < 2 || run.pump.time_s.empty()) return false;
  const double spacing_s = 1.0 / 300;
  const auto due = static_cast<int64_t>((run.pump.time_s.back() - rows_s.front()) / spacing_s);
  const auto& cavity = run.pressure.channels.at("cavity_kPa");
  const auto absent = std::ranges::count_if(cavity, [](double kPa) { return std::isnan(kPa); });
  EXPECT_GE(rows, due);
  EXPECT_EQ(run.missing("pressure"), absent);
  EXPECT_EQ(result["gaps"], absent);
  EXPECT_EQ(result["samples"], rows - absent);
  return rows >= due && run.missing("pressure") == absent && result["gaps"] == absent &&
         result["samples"] == rows - absent;
}

/// What fifty hostile clients did to a daemon at work.
struct Attack {
  uint64_t sent = 0, granted = 0;
  double growth_MB = 0;
  int64_t received = 0, missing = 0;
};

/// Runs again and again under attack; `still_well` judges the progress at each run's end. None: it was not well.
std::optional<Attack> attacked(Time time, std::chrono::seconds how_long,
                               const std::function<bool(const json&)>& still_well) {
  RigWithDaemon rig(time);
  rig.start_daemon();
  auto holder = rig.client();
  holder.call("rig.home", json::object(), 60s);
  Attack attack;
  HostileClients clients(rig.path("socket"), 50, 10'000);
  std::this_thread::sleep_for(1s);
  const double before_MB = resident_MB(rig.daemon->pid());
  const auto end = std::chrono::steady_clock::now() + how_long;
  do {
    const json progress =
        run_for(holder, time == Time::conducted ? 10min : end - std::chrono::steady_clock::now());
    if (!still_well(progress)) return std::nullopt;
    attack.received += progress["received"].get<int64_t>();
    attack.missing += progress["missing"].get<int64_t>();
    flow::status_when(holder, "homed", true);
  } while (std::chrono::steady_clock::now() < end);
  attack.sent = clients.sent();
  attack.granted = clients.granted();
  attack.growth_MB = resident_MB(rig.daemon->pid()) - before_MB;
  return attack;
}

/// In conducted time nothing can be late, so nothing may be missing; in real time it must be declared.
void try_hostile_clients(const char* fault, Time time, const std::function<bool(const json&)>& still_well) {
  Attack worst;
  const int tried = trials(1, 5);
  const int survived = survivors(tried, [&](int, std::mt19937&) {
    const auto attack = attacked(time, std::chrono::seconds(trials(3, 60)), still_well);
    if (!attack) return false;
    worst.sent += attack->sent;
    worst.received += attack->received;
    worst.missing += attack->missing;
    worst.growth_MB = std::max(worst.growth_MB, attack->growth_MB);
    return attack->granted == 0 && attack->received > 0;
  });
  if (!sanitized) {
    EXPECT_LT(worst.growth_MB, 40);
  }
  add_to_table({fault, "50 of them, 10000 messages/s wanted", tried, survived,
                fmt::format("{} messages: one lease, {} of {} samples missing; {:+.1f} MB", worst.sent,
                            worst.missing, worst.received + worst.missing, worst.growth_MB)});
}

TEST(Faults, HostileClients) {
  try_hostile_clients("hostile clients", Time::conducted, [](const json& progress) {
    return progress["state"] == "done" && progress["triggers"] == 60 && progress["missing"] == 0;
  });
}

TEST(Faults, HostileClientsInRealTime) {
  if (sanitized) GTEST_SKIP() << "real time, of which sanitizers leave too little";
  try_hostile_clients("hostile, in real time", Time::real, [](const json& progress) {
    return progress["state"] == "done" && nothing_hidden(progress["result"]);
  });
}

}  // namespace
}  // namespace diastole::faults
