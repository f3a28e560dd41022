// What making a run file of a journal and reading it costs, by the run's length: time and memory of `diastole recover`, which
// goes the daemon's way, and of what reads it.
//
//   tools/bench runfile [--seconds N ...] [--channels N] [--rate-hz R] [--program DIASTOLE] [--directory DIR]

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <vector>

#include "protocol/contract/exit_code.hpp"
#include "protocol/contract/input_error.hpp"
#include "tools/benchmarks/figure_targets.hpp"
#include "tools/benchmarks/long_journal.hpp"
#include "tools/benchmarks/timed_process.hpp"

namespace {

using namespace diastole;
namespace fs = std::filesystem;

double megabytes(const fs::path& file) { return 1e-6 * static_cast<double>(fs::file_size(file)); }

constexpr double most_MB = 64;

/// False if a command failed.
bool measure(const fs::path& directory, const JournalLoad& load, const std::string& program,
             FigureTargets& targets) {
  const fs::path journal = directory / "long.journal", run = directory / "long.run.h5";
  write_long_journal(journal, load);
  bool whole = true;
  const auto cost = [&](const std::vector<std::string>& command) {
    const ProcessCost figures = run_timed(command, directory, directory / "log");
    const double journal_MB = fs::exists(journal) ? megabytes(journal) : 0;
    fmt::print("{:>8} {:>8} {:>12.1f} {:>12.1f} {:>10.2f} {:>12}\n", load.seconds, command[1], journal_MB,
               fs::exists(run) ? megabytes(run) : 0, figures.processor_s,
               targets.at_most(figures.peak_MB, most_MB, "{:.1f}"));
    if (figures.exit_code != 0) fmt::print("  it failed with code {}\n", figures.exit_code);
    std::fflush(stdout);
    whole = whole && figures.exit_code == 0;
  };
  cost({program, "recover", journal, "-o", run});
  fs::remove(journal);
  if (!whole) return false;
  cost({program, "inspect", run, "--json"});
  cost({program, "bin", run, "--frames", "16", "--json"});
  cost({program, "compare", run, run, "--json"});
  cost({program, "report", run, "-o", directory / "long.html"});
  cost({program, "note", run, "a note"});
  cost({program, "runs", directory, "kind=run"});
  cost({program, "export", run, "--bids", directory / "bids"});
  fs::remove(run);
  fs::remove_all(directory / "bids");
  return whole;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "What making a run file of a journal and reading it costs; exit code 1: more than 64 MB of memory, or "
      "a command failed.",
      "bench_runfile");
  JournalLoad load;
  std::vector<int> seconds{5, 20, 80};
  std::string program = fs::read_symlink("/proc/self/exe").parent_path() / "diastole";
  fs::path directory = ".";
  app.add_option("--seconds", seconds, "how long the runs are")->capture_default_str();
  app.add_option("--channels", load.channels)->capture_default_str();
  app.add_option("--rate-hz", load.rate_Hz)->capture_default_str();
  app.add_option("--program", program, "the diastole to measure");
  app.add_option("--directory", directory, "where the files are written")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  try {
    std::string pattern = fs::absolute(directory) / "bench-runfile-XXXXXX";
    if (::mkdtemp(pattern.data()) == nullptr)
      throw InputError({pattern, "", "no directory can be made there", "Name another with --directory."});
    fmt::print("{} channels at {:g} Hz\n{:>8} {:>8} {:>12} {:>12} {:>10} {:>12}\n", load.channels,
               load.rate_Hz, "run, s", "command", "journal, MB", "run file, MB", "CPU, s", "memory, MB");
    bool whole = true;
    FigureTargets targets;
    for (const int each : seconds) {
      load.seconds = each;
      whole = measure(pattern, load, program, targets) && whole;
    }
    fs::remove_all(pattern);
    fmt::print("every command ended as it should{}\n", targets.mark(whole));
    return static_cast<int>(targets.conclude());
  } catch (const InputError& error) {
    fmt::print(stderr, "bench_runfile: {}\n", error.what());
    return static_cast<int>(ExitCode::bad_input);
  } catch (const HardwareError& error) {
    fmt::print(stderr, "bench_runfile: {}\n", error.what());
    return static_cast<int>(ExitCode::hardware_fault);
  }
}
