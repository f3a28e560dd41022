// A session in real time, as long as `--minutes` says: samples and gaps against what was due, and the daemon's
// memory. A line a minute. A sample that is unaccounted for, one that was lost, and memory that grew are marked MISSED and make the
// exit code 1.
//
//   tools/bench soak --minutes 60     or   build/release/bin/bench_soak

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <thread>
#include <vector>

#include "protocol/contract/exit_code.hpp"
#include "protocol/contract/input_error.hpp"
#include "tools/benchmarks/daemon_on_bench.hpp"
#include "tools/benchmarks/figure_targets.hpp"

namespace {

using namespace diastole;
using namespace std::chrono_literals;
using nlohmann::json;

constexpr double most_growth_kB_a_minute = 20;
constexpr auto look_interval = 10s;

struct Options {
  double minutes = 3;
  BenchLoad load{.channels = 2, .rate_Hz = 300};
  std::string directory = ".";
};

/// Resident memory every look_interval while the run goes on, in MB.
std::vector<double> follow(const DaemonOnBench& bench, DaemonClient& client) {
  std::vector<double> resident_MB;
  auto next = std::chrono::steady_clock::now();
  for (json progress = client.call("run.progress"); progress["state"] == "running";
       progress = client.call("run.progress")) {
    if (std::chrono::steady_clock::now() >= next) {
      next += look_interval;
      const ProcessFigures figures = bench.figures();
      resident_MB.push_back(figures.resident_MB);
      if (resident_MB.size() % 6 == 1) {
        fmt::print("{:4} min  {:>10} samples  {:>6} missing  {:>6} triggers  RSS {:.2f} MB  CPU {:.1f} s\n",
                   resident_MB.size() / 6, progress["received"].get<int64_t>(),
                   progress["missing"].get<int64_t>(), progress["triggers"].get<int64_t>(),
                   figures.resident_MB, figures.cpu_s);
        std::fflush(stdout);
      }
    }
    std::this_thread::sleep_for(100ms);
  }
  return resident_MB;
}

ExitCode soak(const Options& options) {
  DaemonOnBench bench(options.load, options.directory);
  auto client = bench.client();
  const double planned_s = bench.start_run(client, 60 * options.minutes);
  const std::vector<double> resident_MB = follow(bench, client);
  const json progress = DaemonOnBench::await_end(client);
  const json& result = progress["result"];
  if (progress["state"] != "done") throw HardwareError("daemon", result.dump(), "See its log.");
  const auto samples = result["samples"].get<int64_t>(), gaps = result["gaps"].get<int64_t>();
  const double due = options.load.rate_Hz * planned_s;
  const double growth_kB =
      resident_MB.size() < 12 ? 0 : 6e3 * slope_per_interval(std::span(resident_MB).subspan(6));
  const ProcessFigures end = bench.figures();
  const bool accounted =
      std::abs(static_cast<double>(samples + gaps) - due) <= 0.02 * options.load.rate_Hz + 2;
  FigureTargets targets;
  fmt::print("{} samples + {} gaps of {:.0f} due{}; {}, {} triggers\n", samples, gaps, due,
             targets.mark(accounted && gaps == 0), result["end"].get<std::string>(),
             result["triggers"].get<int64_t>());
  fmt::print(
      "RSS {} kB a minute; {:.1f} MB at most while the file is written, {:.1f} MB after it; CPU {:.2f} "
      "%\n",
      targets.at_most(growth_kB, most_growth_kB_a_minute, "{:+.1f}"), end.most_resident_MB, end.resident_MB,
      100 * end.cpu_s / planned_s);
  return targets.conclude();
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("A session in real time that is as long as it is told.", "bench_soak");
  Options options;
  app.add_option("--minutes", options.minutes, "how long")
      ->capture_default_str()
      ->check(CLI::Range(0.1, 10'000.0));
  app.add_option("--channels", options.load.channels, "of the simulated instrument")
      ->capture_default_str()
      ->check(CLI::Range(1, 64));
  app.add_option("--rate-Hz", options.load.rate_Hz, "samples a second")
      ->capture_default_str()
      ->check(CLI::Range(1, 20'000));
  app.add_option("--directory", options.directory, "on whose disk journal and run file are written")
      ->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  try {
    return static_cast<int>(soak(options));
  } catch (const InputError& error) {
    fmt::print(stderr, "bench_soak: {}\n", error.what());
    return static_cast<int>(ExitCode::bad_input);
  } catch (const HardwareError& error) {
    fmt::print(stderr, "bench_soak: {}\n", error.what());
    return static_cast<int>(ExitCode::hardware_fault);
  }
}
