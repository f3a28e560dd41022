// What the daemon costs and whether it loses anything, in real time: ten channels at 10 kHz from the simulated
// instrument, through the instrument's thread, acquisition, journal and run file.
//
//   tools/bench daemon            or   build/release/bin/bench_daemon [--seconds N] [--stops N] [--directory DIR]

#include <fmt/format.h>
#include <time.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <random>
#include <thread>
#include <vector>

#include "host/daq/driver.hpp"
#include "host/journal/journal.hpp"
#include "host/journal/journal_records.hpp"
#include "protocol/contract/exit_code.hpp"
#include "protocol/contract/input_error.hpp"
#include "tools/benchmarks/consoles_on_bench.hpp"
#include "tools/benchmarks/daemon_on_bench.hpp"
#include "tools/benchmarks/figure_targets.hpp"

namespace {

using namespace diastole;
using namespace std::chrono_literals;
using nlohmann::json;
using SteadyClock = std::chrono::steady_clock;

struct Options {
  double seconds = 30;
  int stops = 100;
  std::string directory = ".";
};

double since_s(SteadyClock::time_point begun) {
  return std::chrono::duration<double>(SteadyClock::now() - begun).count();
}

double thread_cpu_s() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

double share(const std::vector<double>& sorted, double part) {
  return sorted[std::min(sorted.size() - 1, static_cast<size_t>(part * static_cast<double>(sorted.size())))];
}

void line(const char* what, const std::string& figures) {
  fmt::print("{:<52}{}\n", what, figures);
  std::fflush(stdout);
}

/// The driver alone, read as often as the daemon reads it. CPU seconds a second.
double bare_loop(const BenchLoad& load, double seconds) {
  std::string text = "[daq]\n";
  for (int i = 0; i < load.channels; ++i)
    text += fmt::format("[[daq.channel]]\ninput = {}\n", i);
  TableReader root = TableReader::from_text(text, "bench");
  TableReader table = root.table("daq");
  std::vector<TableReader> channels = table.tables("channel");
  const auto instrument = daq::simulated_driver.configure(table, channels)({});
  auto& blocks = dynamic_cast<daq::BlockInstrument&>(*instrument);
  (void)blocks.start(load.rate_Hz);
  const std::chrono::duration<double> pause(static_cast<double>(blocks.block_samples()) / load.rate_Hz / 4);
  const auto begun = SteadyClock::now();
  const double before_s = thread_cpu_s();
  uint64_t samples = 0;
  while (since_s(begun) < seconds) {
    daq::Batch batch;
    (void)blocks.read(batch);
    samples += batch.volts.size();
    std::this_thread::sleep_for(pause);
  }
  const double cpu = (thread_cpu_s() - before_s) / since_s(begun);
  line("bare driver loop", fmt::format("CPU {:.2f} %, {:.0f} values/s", 100 * cpu,
                                       static_cast<double>(samples) / since_s(begun)));
  return cpu;
}

void idle(const DaemonOnBench& bench) {
  const ProcessFigures before = bench.figures();
  std::this_thread::sleep_for(10s);
  const ProcessFigures after = bench.figures();
  line("idle daemon",
       fmt::format("CPU {:.2f} %, RSS {:.1f} MB", 10 * (after.cpu_s - before.cpu_s), after.resident_MB));
}

/// Whoever asks for the run's progress ten times a second, as `diastole run` and a console do.
class Followers {
 public:
  Followers(const DaemonOnBench& bench, int count) {
    for (int i = 0; i < count; ++i)
      threads_.emplace_back([client = bench.client()](const std::stop_token& stop) mutable {
        while (!stop.stop_requested()) {
          client.call("run.progress", {{"first_remark", 0}});
          std::this_thread::sleep_for(100ms);
        }
      });
  }

 private:
  std::vector<std::jthread> threads_;
};

/// Who looks on during a run.
struct Onlookers {
  int followers = 0;
  int consoles = 0;
};

void sustained(DaemonOnBench& bench, const BenchLoad& load, const Options& options,
               const Onlookers& onlookers, double bare_cpu, FigureTargets& targets) {
  auto client = bench.client();
  bench.start_run(client, options.seconds);
  std::this_thread::sleep_for(1s);
  double cpu = 0;
  double resident_MB = 0;
  {
    const Followers others(bench, onlookers.followers);
    const ConsolesOnBench consoles(bench.console(), onlookers.consoles);
    const ProcessFigures before = bench.figures();
    const auto begun = SteadyClock::now();
    std::this_thread::sleep_for(std::chrono::duration<double>(options.seconds - 2));
    const ProcessFigures after = bench.figures();
    cpu = (after.cpu_s - before.cpu_s) / since_s(begun);
    resident_MB = after.resident_MB;
  }
  const json progress = DaemonOnBench::await_end(client);
  const ProcessFigures end = bench.figures();
  const auto missing = progress["missing"].get<int64_t>();
  const bool is_whole = missing == 0 && progress["state"] == "done" && progress["result"]["regular"] == true;
  line(fmt::format("{} channels x {:g} kHz, {} followers, {} consoles", load.channels, 1e-3 * load.rate_Hz,
                   onlookers.followers, onlookers.consoles)
           .c_str(),
       fmt::format("CPU {:.1f} % ({:.1f} x the bare loop), {} samples, {} lost{}; RSS {:.1f} MB in the run, "
                   "{:.1f} MB at most while its file is written, {:.1f} MB after it",
                   100 * cpu, cpu / bare_cpu, progress["received"].get<int64_t>(), missing,
                   targets.mark(is_whole), resident_MB, end.most_resident_MB, end.resident_MB));
  for (const json& remark : progress["remarks"])
    if (remark["code"] != "instrument") fmt::print("    {}\n", remark["text"].get<std::string>());
}

/// From run.stop leaving the client to the request for a stop on the controller's line, in mid-run.
void stop_latency(DaemonOnBench& bench, const Options& options) {
  auto client = bench.client();
  std::mt19937 random(1);
  std::vector<double> latency_ms;
  for (int i = 0; i < options.stops; ++i) {
    bench.start_run(client, 10);
    (void)bench.tap().take_stop();
    std::this_thread::sleep_for(
        std::chrono::duration<double>(0.3 + 1e-4 * static_cast<double>(random() % 2000)));
    const auto asked = SteadyClock::now();
    client.call("run.stop", {{"how", "now"}});
    DaemonOnBench::await_end(client);
    if (const auto seen = bench.tap().take_stop())
      latency_ms.push_back(std::chrono::duration<double, std::milli>(*seen - asked).count());
  }
  std::sort(latency_ms.begin(), latency_ms.end());
  if (latency_ms.empty()) return line("stop: request to line", "none was seen");
  line("stop: request to line",
       fmt::format("p50 {:.1f} ms, p99 {:.1f} ms, at most {:.1f} ms; {} of {} seen", share(latency_ms, 0.5),
                   share(latency_ms, 0.99), latency_ms.back(), latency_ms.size(), options.stops));
}

/// One tenth of a second of samples a record, as fast as they are taken.
void journal_cost(const BenchLoad& load, const Options& options) {
  const std::filesystem::path path = std::filesystem::path(options.directory) / "bench.journal";
  SampleBlock block;
  block.channels = static_cast<uint32_t>(load.channels);
  const auto rows = static_cast<size_t>(load.rate_Hz / 10);
  block.host_ns.assign(rows, 1);
  block.value_kPa.assign(rows * static_cast<size_t>(load.channels), 1.5);
  constexpr int records = 300;
  double cpu_s = 0, wall_s = 0, longest_s = 0, bytes = 0;
  {
    JournalWriter journal(path);
    const auto begun = SteadyClock::now();
    const double before_s = thread_cpu_s();
    for (int i = 0; i < records; ++i) {
      const auto payload = encode(block);
      bytes += static_cast<double>(payload.size());
      const auto asked = SteadyClock::now();
      if (!journal.append(RecordKind::samples, payload)) break;
      longest_s = std::max(longest_s, since_s(asked));
    }
    cpu_s = thread_cpu_s() - before_s;
    wall_s = since_s(begun);
  }
  std::filesystem::remove(path);
  line("journal",
       fmt::format("{:.0f} us of CPU a record of {:.0f} kB, {:.1f} ms at most, {:.0f} MB/s; the load above "
                   "takes {:.2f} % "
                   "of a core, {:.2f} MB/s",
                   1e6 * cpu_s / records, 1e-3 * bytes / records, 1e3 * longest_s, 1e-6 * bytes / wall_s,
                   100 * cpu_s / records * 10, 1e-6 * bytes / records * 10));
}

ExitCode bench(const Options& options) {
  const BenchLoad load;
  const double bare_cpu = bare_loop(load, 10);
  journal_cost(load, options);
  FigureTargets targets;
  {
    DaemonOnBench daemon(load, options.directory);
    idle(daemon);
    for (const Onlookers onlookers : {Onlookers{}, {.followers = 10}, {.followers = 50}, {.consoles = 8}})
      sustained(daemon, load, options, onlookers, bare_cpu, targets);
    stop_latency(daemon, options);
  }
  const BenchLoad usual{.channels = 2, .rate_Hz = 300};
  DaemonOnBench daemon(usual, options.directory);
  sustained(daemon, usual, options, {.followers = 1}, bare_loop(usual, 5), targets);
  return targets.conclude();
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "What the daemon costs in real time; exit code 1 if a sample was lost or a run was not regular.",
      "bench_daemon");
  Options options;
  app.add_option("--seconds", options.seconds, "of each run")
      ->capture_default_str()
      ->check(CLI::Range(5, 3600));
  app.add_option("--stops", options.stops, "how often a run is stopped")->capture_default_str();
  app.add_option("--directory", options.directory, "on whose disk journals and run files are written")
      ->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  try {
    return static_cast<int>(bench(options));
  } catch (const InputError& error) {
    fmt::print(stderr, "bench_daemon: {}\n", error.what());
    return static_cast<int>(ExitCode::bad_input);
  } catch (const HardwareError& error) {
    fmt::print(stderr, "bench_daemon: {}\n", error.what());
    return static_cast<int>(ExitCode::hardware_fault);
  }
}
