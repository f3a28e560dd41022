#include "tools/benchmarks/daemon_on_bench.hpp"

#include <fmt/format.h>
#include <sched.h>

#include <cmath>
#include <fstream>
#include <thread>

#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using nlohmann::json;

constexpr double period_s = 2;
constexpr double rest_s = 0.2;
constexpr double tail_s = 0.25;  // host/acquisition/acquisition.hpp

fs::path make_directory(const fs::path& below) {
  std::string pattern = (below / "diastole-bench-XXXXXX").string();
  if (::mkdtemp(pattern.data()) == nullptr) {
    throw InputError({pattern, "", "no directory can be made there", "Name another with --directory."});
  }
  return pattern;
}

std::string program(const char* name) { return fs::read_symlink("/proc/self/exe").parent_path() / name; }

/// The example rig, with `channels` simulated inputs.
void write_rig_file(const fs::path& path, int channels) {
  std::ofstream file(path);
  file << "format = \"diastole-rig\"\nversion = 1\n"
          "[rig]\nbore_mm = 100.0\nscrew_rev_per_cm = 6.3\nsteps_per_rev = 200\nhose_length_m = 5.0\n"
          "hose_bore_mm = 12.0\nfluid_density_kg_m3 = 1005.0\n"
          "[controller]\nport = \"pump\"\nmicrosteps = 8\n"
          "[daemon]\njournal_dir = \"journals\"\n"
          "[daq]\ndriver = \"simulated\"\n";
  for (int i = 0; i < channels; ++i)
    file << fmt::format("[[daq.channel]]\nname = \"{}\"\ninput = {}\nkPa_per_V = 4.0\n",
                        i == 0 ? "cavity" : fmt::format("spare_{}", i), i);
}

/// The rig and the wire stand for things outside this computer: other programs are not to make them late.
void keep_prompt(pid_t process) {
  const sched_param parameter{60};
  (void)::sched_setscheduler(process, SCHED_FIFO, &parameter);
}

}  // namespace

DaemonOnBench::DaemonOnBench(const BenchLoad& load, const fs::path& below)
    : load_(load), directory_(make_directory(below)) {
  const auto at = [this](const char* name) { return (directory_ / name).string(); };
  write_rig_file(directory_ / "rig.toml", load.channels);
  rig_ = std::make_unique<ChildProcess>(
      std::vector<std::string>{program("sim_rig"), "--real-time", "--link", at("controller")}, at("rig.log"));
  (void)rig_->first_line(30s);
  tap_ = std::make_unique<LineTap>(at("controller"), at("pump"));
  daemon_ = std::make_unique<ChildProcess>(
      std::vector<std::string>{program("diastole"), "daemon", "--config", at("rig.toml"), "--port",
                               at("pump"), "--socket", at("socket"), "--journal-dir", at("journals"),
                               "--console", "127.0.0.1:0"},
      at("daemon.log"));
  console_ = json::parse(daemon_->first_line(30s)).at("console").at("control");
  keep_prompt(rig_->pid());
  client().call("rig.home", json::object(), 120s);
}

DaemonOnBench::~DaemonOnBench() {
  daemon_->stop(30s);
  tap_.reset();
  rig_->stop(10s);
  std::error_code ignored;
  fs::remove_all(directory_, ignored);
}

double DaemonOnBench::start_run(DaemonClient& client, double seconds) const {
  const long cycles = std::max(1L, std::lround(seconds / period_s));
  const std::string text = fmt::format(
      "format = \"diastole-experiment\"\nversion = 1\nrest_s = {}\nsample_rate_Hz = {}\n"
      "[[segment]]\nwaveform = \"parabolic\"\nstroke_mL = 10.0\nperiod_s = {:.1f}\ncycles = {}\n",
      rest_s, load_.rate_Hz, period_s, cycles);
  client.call("run.start", {{"experiment", text}, {"file", "bench.experiment.toml"}});
  return rest_s + period_s * static_cast<double>(cycles) + tail_s;
}

json DaemonOnBench::await_end(DaemonClient& client) {
  json progress = client.call("run.progress");
  while (progress["state"] == "running" || progress["state"] == "writing") {
    std::this_thread::sleep_for(20ms);
    progress = client.call("run.progress");
  }
  std::error_code ignored;
  for (const char* file : {"journal", "run_file"})
    if (progress["result"].contains(file)) fs::remove(progress["result"][file].get<std::string>(), ignored);
  return progress;
}

}  // namespace diastole
