// `tools/bench flow [FOLDER]`: phase contrast against labelled scans (FOLDER/labels.json, FOLDER/NAME/dicom with its pressure and triggers), default
// shared/data/imaging beside the tree and no part of it.
//
// A row a scan: stroke volume, what a cycle does not return, peak flow and the loop's area against the truth, the background's error that is stated, phases whose
// flow lies in its 95 % interval. Figures that miss their targets are marked MISSED, and any of them makes the exit code 1.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "estimator/imaging/flow/flow_session.hpp"
#include "estimator/inference/intervals.hpp"
#include "estimator/io/whole_file.hpp"
#include "protocol/contract/input_error.hpp"
#include "tools/benchmarks/figure_targets.hpp"
#include "tools/score/score.hpp"

namespace diastole {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr double stroke_percent = 1, net_percent = 1, peak_percent = 3, loop_percent = 8,
                 background_cm_s = 0.3;
constexpr double least_coverage = 0.90, most_coverage = 0.98;

struct Counts {
  size_t inside = 0, phases = 0;
  FigureTargets targets{};

  std::string judged(double value, double most, const char* form = "{:+.2f}") {
    return targets.within(value, -most, most, form);
  }
};

void bench_scan(const fs::path& folder, const std::string& name, const json& label, Counts& counts) {
  const auto start = std::chrono::steady_clock::now();
  const fs::path home = folder / name;
  imaging::FlowSession session;
  try {
    session = imaging::measure_session({.folder = home / "dicom",
                                        .pressure = home / (name + ".pressure.csv"),
                                        .trigger = home / (name + ".trigger.csv")});
  } catch (const InputError& error) {
    fmt::print("{:<13}{}: {}\n", name, counts.targets.mark(false), error.what());
    return;
  }
  const imaging::FlowMeasurement& flow = session.flow;
  const std::vector<double> truth = label.at("phase_flow_mL_s");
  const double stroke = label.at("stroke_volume_mL"), net = label.at("net_mL");
  size_t inside = 0;
  double peak = 0, true_peak = 0, squares = 0;
  for (size_t k = 0; k < truth.size() && k < flow.phases.size(); ++k) {
    const imaging::ValueWithError& found = flow.phases[k].flow_mL_s;
    const double over_sigma = (found.value - truth[k]) / found.sigma;
    squares += over_sigma * over_sigma / static_cast<double>(truth.size());
    inside += std::abs(over_sigma) < inference::normal_95 ? 1 : 0;
    peak = std::max(peak, std::abs(found.value));
    true_peak = std::max(true_peak, std::abs(truth[k]));
  }
  counts.inside += inside;
  counts.phases += truth.size();
  const double work = session.loop->work_mJ.value, true_work = label.at("loop_area_mJ");
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  fmt::print(
      "{:<13}{:>10}{:>10}{:>10}{:>10}{:>12}{:>7} of {}{:>8.2f}{:>7.1f}\n", name,
      counts.judged(100 * (flow.stroke_mL.value / stroke - 1), stroke_percent),
      counts.judged(100 * (flow.closure_mL.value - net) / stroke, net_percent),
      counts.judged(100 * (peak / true_peak - 1), peak_percent),
      counts.judged(100 * (work / true_work - 1), loop_percent),
      counts.judged(flow.background.sigma_rad * flow.scan.cm_s_per_radian(), background_cm_s, "{:.3f}"),
      inside, truth.size(), std::sqrt(squares), seconds);
  std::fflush(stdout);
}

int run(int argc, char** argv) {
  CLI::App app("Phase contrast against labelled scans: tools/bench flow [FOLDER]");
  fs::path folder = fs::path(DIASTOLE_SOURCE_DIR).parent_path() / "shared/data/imaging";
  app.add_option("FOLDER", folder, "labelled scans, with labels.json");
  CLI11_PARSE(app, argc, argv);
  if (!fs::is_regular_file(folder / "labels.json")) {
    fmt::print("skipped: {} holds no labelled scans (labels.json)\n", folder.string());
    return 0;
  }
  fmt::print("{:<13}{:>10}{:>10}{:>10}{:>10}{:>12}{:>13}{:>8}{:>7}\n", "scan", "stroke %", "net %", "peak %",
             "loop %", "backgr cm/s", "in 95 %", "/sigma", "s");
  Counts counts;
  const json labels = json::parse(read_whole_file(folder / "labels.json"));
  for (const auto& [name, label] : labels["cases"].items())
    if (label.is_object() && label.value("kind", "") == "flow" && !label.value("refuse", false))
      bench_scan(folder, name, label, counts);
  if (counts.phases == 0) {
    fmt::print("skipped: no scan of flow is labelled in {}\n", folder.string());
    return static_cast<int>(counts.targets.conclude());
  }
  const double share = static_cast<double>(counts.inside) / static_cast<double>(counts.phases);
  const auto [low, high] = explain::clopper_pearson(counts.inside, counts.phases);
  // Phases of one scan err alike in part: the interval is of independent ones, and so a little too narrow.
  const bool is_met = share >= least_coverage && share <= most_coverage;
  fmt::print("{} of {} phases ({:.0f} %, {:.0f} to {:.0f} %) lie in their 95 % intervals{}\n", counts.inside,
             counts.phases, 100 * share, 100 * low, 100 * high, counts.targets.mark(is_met));
  return static_cast<int>(counts.targets.conclude());
}

}  // namespace
}  // namespace diastole

int main(int argc, char** argv) {
  try {
    return diastole::run(argc, argv);
  } catch (const std::exception& error) {
    fmt::print(stderr, "bench_flow: {}\n", error.what());
    return 2;
  }
}
