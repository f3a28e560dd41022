// What the catalogue of runs costs: making its index anew, and one question to it, whole program, by the number of runs.
//
//   tools/bench catalogue [--runs N ...] [--run TEMPLATE.run.h5] [--program DIASTOLE] [--directory DIR]
//
// The runs are copies of one, in folders of a hundred, each with a specimen of its own; for every tenth there is an explanation.
// Targets, of 10,000 runs: 60 s for the index, 100 ms for a question (median); what misses its own is marked MISSED and makes the exit code 1.

#include <fmt/format.h>
#include <hdf5.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <vector>

#include "protocol/contract/exit_code.hpp"
#include "protocol/runfile/h5_handle.hpp"
#include "protocol/runfile/layout.hpp"
#include "tools/benchmarks/figure_targets.hpp"

namespace {

namespace fs = std::filesystem;
using namespace diastole;

constexpr int runs_a_folder = 100;
constexpr int questions = 21;
constexpr int most_runs = 10'000;  // that the targets are of
constexpr double rebuild_target_s = 60, query_target_ms = 100;

/// Gives the copy its specimen, of a hundred that there are.
bool name_specimen(const fs::path& run, int number) {
  const runfile::FileHandle file(H5Fopen(run.c_str(), H5F_ACC_RDWR, H5P_DEFAULT));
  if (!file.valid()) return false;
  if (H5Lexists(file.get(), runfile::session_group, H5P_DEFAULT) > 0)
    H5Ldelete(file.get(), runfile::session_group, H5P_DEFAULT);
  const runfile::GroupHandle group(
      H5Gcreate2(file.get(), runfile::session_group, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
  const std::string specimen = fmt::format("gel-{}", number % 100);
  const runfile::TypeHandle type(H5Tcopy(H5T_C_S1));
  H5Tset_size(type.get(), specimen.size());
  const runfile::SpaceHandle scalar(H5Screate(H5S_SCALAR));
  const runfile::AttributeHandle attribute(
      H5Acreate2(group.get(), runfile::specimen_fact, type.get(), scalar.get(), H5P_DEFAULT, H5P_DEFAULT));
  return attribute.valid() && H5Awrite(attribute.get(), type.get(), specimen.data()) >= 0;
}

bool make_runs(const fs::path& folder, const fs::path& origin, int from, int to) {
  for (int i = from; i < to; ++i) {
    const fs::path place = folder / fmt::format("{:03}", i / runs_a_folder);
    fs::create_directories(place);
    const fs::path run = place / fmt::format("{:05}.run.h5", i);
    fs::copy_file(origin, run);
    fs::permissions(run, fs::perms::owner_write, fs::perm_options::add);
    if (!name_specimen(run, i)) return false;
    if (i % 10 != 0) continue;
    std::ofstream(place / fmt::format("{:05}.study.toml", i))
        << fmt::format("[data]\nruns = [\"{:05}.run.h5\"]\n", i);
    std::ofstream(place / fmt::format("{:05}.explanation.json", i)) << fmt::format(
        R"({{"format": "diastole-explanation", "format_version": 1, "study": "{:05}.study.toml", "verdict": "{}",
            "effects": [], "shifts": [{{"name": "C1_kPa", "before": 9, "after": 8.5, "after_error": 0.1}}]}})",
        i, i % 20 == 0 ? "unexplained" : "named");
  }
  return true;
}

double seconds_of(const std::string& command) {
  const auto began = std::chrono::steady_clock::now();
  const int status = std::system(command.c_str());
  const double took_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  return status == 0 ? took_s : -1;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("What the catalogue of runs costs.", "bench_catalogue");
  std::vector<int> counts{100, 1000, 10000};
  fs::path origin = fs::path(DIASTOLE_SOURCE_DIR) / "examples/recorded-baseline.run.h5";
  fs::path directory = fs::temp_directory_path();
  std::string program = fs::read_symlink("/proc/self/exe").parent_path() / "diastole";
  app.add_option("--runs", counts, "how many, rising")->capture_default_str();
  app.add_option("--run", origin, "what they are copies of")->capture_default_str();
  app.add_option("--program", program, "the diastole to measure");
  app.add_option("--directory", directory, "where the files are written")->capture_default_str();
  CLI11_PARSE(app, argc, argv);

  const fs::path place = directory / fmt::format("bench-catalogue-{}", ::getpid());
  fs::create_directories(place / "runs");
  const std::string ask = fmt::format("XDG_CACHE_HOME={0}/cache {1} runs {0}/runs ", place.string(), program);
  const std::string filter = "specimen=gel-20 since=2000 verdict=unexplained --json > /dev/null";
  fmt::print("{:>8} {:>12} {:>14} {:>16} {:>16}\n", "runs", "rebuild (s)", "a run (ms)", "query, least",
             "median (ms)");
  bool good = true;
  FigureTargets targets;
  for (int there = 0; const int count : counts) {
    good = good && make_runs(place / "runs", origin, there, count);
    there = count;
    const double rebuild_s = seconds_of(ask + "--rebuild --most 0 > /dev/null 2>&1");
    std::vector<double> query_s;
    for (int i = 0; i < questions; ++i)
      query_s.push_back(seconds_of(ask + filter));
    std::ranges::sort(query_s);
    good = good && rebuild_s > 0 && query_s.front() > 0;
    const auto judged = [&](double value, double most) {
      return count <= most_runs ? targets.within(value, 0, most, "{:.1f}") : fmt::format("{:.1f}", value);
    };
    fmt::print("{:>8} {:>12} {:>14.2f} {:>16.1f} {:>16}\n", count, judged(rebuild_s, rebuild_target_s),
               1e3 * rebuild_s / count, 1e3 * query_s.front(),
               judged(1e3 * query_s[questions / 2], query_target_ms));
    std::fflush(stdout);
  }
  fs::remove_all(place);
  fmt::print("every command ended as it should{}\n", targets.mark(good));
  return static_cast<int>(targets.conclude());
}
