// `tools/bench lv [FOLDER] [--random N] [--example FILE]`: ventricles from guide points, and from their cine images alone, against labelled ones
// (FOLDER/NAME/NAME.guide.csv and FOLDER/NAME/dicom with FOLDER/truth/NAME.surfaces.csv and NAME.volumes.csv, displacements in FOLDER/labels.json),
// default shared/data/dti beside the tree and no part of it, and against random ones.
//
// A row a phase: RMS of the true walls' points from the fitted ones, the error of the cavity's volume and how many sigmas that is.
// Figures that miss their targets are marked MISSED, and any of them makes the exit code 1. `--example` writes the guide points of docs/lv.md.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "estimator/imaging/geometry/cine_points.hpp"
#include "estimator/imaging/geometry/ventricle_session.hpp"
#include "estimator/imaging/geometry/wall_map.hpp"
#include "estimator/imaging/series/image_folder.hpp"
#include "estimator/io/whole_file.hpp"
#include "protocol/contract/input_error.hpp"
#include "tools/benchmarks/figure_targets.hpp"
#include "tools/sim_scanner/ventricle_phantom.hpp"

namespace diastole {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;

struct Targets {
  double wall_mm, volume_percent, shift_mm, basal_shift_mm, seconds;
};
constexpr Targets of_clicks{0.25, 2, 0.3, 0.6, 5}, of_cines{0.15, 1, 0.15, 0.15, 5};

FigureTargets targets;

/// Rows of a table without its header, split at the commas.
std::vector<std::vector<std::string>> rows_of(const fs::path& file) {
  std::ifstream stream(file);
  std::vector<std::vector<std::string>> rows;
  std::string line, field;
  for (std::getline(stream, line); std::getline(stream, line);) {
    std::istringstream fields(line);
    rows.emplace_back();
    while (std::getline(fields, field, ','))
      rows.back().push_back(field);
  }
  return rows;
}

double rms_mm(const imaging::WallMap& map, const imaging::ProlateFrame& frame, double side,
              const std::vector<Vector3d>& truth) {
  double squares = 0;
  for (const Vector3d& x : truth)
    squares += std::pow(map.distance_mm(side, frame.inside(x)), 2);
  return std::sqrt(squares / static_cast<double>(truth.size()));
}

void score_case(const fs::path& folder, const std::string& name, const char* source, const Targets& target,
                const std::function<imaging::GuidePoints()>& read) {
  std::map<std::pair<int, bool>, std::vector<Vector3d>> walls;
  for (const auto& row : rows_of(folder / "truth" / (name + ".surfaces.csv")))
    walls[{std::stoi(row[0]), row[1] == "epi"}].emplace_back(std::stod(row[2]), std::stod(row[3]),
                                                             std::stod(row[4]));
  std::map<int, double> volumes;
  for (const auto& row : rows_of(folder / "truth" / (name + ".volumes.csv")))
    volumes[std::stoi(row[0])] = std::stod(row[2]);
  const auto start = std::chrono::steady_clock::now();
  const imaging::GuidePoints guide = read();
  const imaging::VentricleSession session = imaging::measure_ventricle({}, guide);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  fmt::print("{}, {}: points {:.3f} mm RMS from their walls, errors {:.2f} times those stated, {} s\n", name,
             source, session.fit.rms_mm, session.fit.noise_factor,
             targets.at_most(seconds, target.seconds, "{:.1f}"));
  fmt::print("  phase  endo (mm)  epi (mm)  cavity (mL)  error (%)  sigmas  least Jacobian\n");
  for (size_t p = 0; p < session.phases.size(); ++p) {
    const imaging::VentriclePhase& phase = session.phases[p];
    const imaging::WallMap map(session.fit.frame, session.fit.phases[p]);
    const double error = phase.mesh.cavity_mL - volumes.at(phase.phase);
    const double percent = 100 * error / volumes.at(phase.phase);
    fmt::print(
        "  {:5}  {:9}  {:8}  {:11.2f}  {:+9.2f}{}  {:6.1f}  {:.2f}\n", phase.phase,
        targets.at_most(rms_mm(map, session.fit.frame, -0.5, walls.at({phase.phase, false})), target.wall_mm),
        targets.at_most(rms_mm(map, session.fit.frame, 0.5, walls.at({phase.phase, true})), target.wall_mm),
        phase.mesh.cavity_mL, percent, targets.mark(std::abs(percent) <= target.volume_percent),
        error / phase.cavity_sigma_mL, phase.mesh.least_jacobian);
  }
  const nlohmann::json labels = nlohmann::json::parse(read_whole_file(folder / "labels.json"));
  const nlohmann::json& shifts = labels.at("cases").at(name).at("slice_shift_patient_mm");
  std::set<std::string> seen;
  for (const imaging::GuidePoint& point : guide.points)
    seen.insert(guide.slices[point.slice]);
  const auto counts = [&](const imaging::SliceShift& shift) {
    return !shift.is_reference && seen.contains(shift.slice);
  };
  std::string last;
  for (const imaging::SliceShift& shift : session.fit.shifts)
    if (counts(shift)) last = shift.slice;
  for (const imaging::SliceShift& shift : session.fit.shifts) {
    if (!counts(shift)) continue;
    const std::vector<double> truth = shifts.value(shift.slice, std::vector<double>{0, 0, 0});
    const double error = (shift.shift_mm - Vector3d(truth[0], truth[1], truth[2])).norm();
    fmt::print(
        "  slice {}: displaced by {:.2f} mm, error {} mm\n", shift.slice, shift.shift_mm.norm(),
        targets.at_most(error, shift.slice == last ? target.basal_shift_mm : target.shift_mm, "{:.2f}"));
  }
}

void score_random(int count) {
  int folded = 0;
  double worst_mm = 0, worst_percent = 0, squares = 0, least_jacobian = 1;
  for (int seed = 1; seed <= count; ++seed) {
    const auto truth = scanner::VentriclePhantom::random(static_cast<std::uint64_t>(seed));
    const scanner::Clicks clicks = scanner::click(
        truth, {.phases = 3, .shift_mm = seed % 2 ? 0.0 : 3.0, .seed = static_cast<std::uint64_t>(seed)});
    try {
      const auto session = imaging::measure_ventricle(
          {}, imaging::guide_points_from_text(clicks.guide_csv, fmt::format("random {}", seed)));
      for (size_t p = 0; p < session.phases.size(); ++p) {
        const imaging::WallMap map(session.fit.frame, session.fit.phases[p]);
        for (const double t : {0.0, 1.0}) {
          const double mm = rms_mm(map, session.fit.frame, t - 0.5, truth.surface_mm(t, clicks.activity[p]));
          worst_mm = std::max(worst_mm, mm);
          squares += mm * mm / (2.0 * static_cast<double>(session.phases.size()) * count);
        }
        const double volume = truth.cavity_mL(clicks.activity[p]);
        worst_percent =
            std::max(worst_percent, 100 * std::abs(session.phases[p].mesh.cavity_mL / volume - 1));
        least_jacobian = std::min(least_jacobian, session.phases[p].mesh.least_jacobian);
      }
    } catch (const InputError& error) {
      fmt::print("  random {}: {}\n", seed, error.what());
      ++folded;
    }
  }
  fmt::print(
      "{} random ventricles of 3 phases: {} refused, least Jacobian {:.2f}, walls {} mm RMS (worst phase "
      "{:.2f}), volume within {:.1f} %\n",
      count, targets.at_most(folded, 0, "{:.0f}"), least_jacobian,
      targets.at_most(std::sqrt(squares), of_clicks.wall_mm), worst_mm, worst_percent);
}

}  // namespace
}  // namespace diastole

int main(int argc, char** argv) {
  using namespace diastole;
  CLI::App app("Ventricles from guide points and from cines against known ones");
  fs::path folder = fs::path(DIASTOLE_SOURCE_DIR).parent_path() / "shared/data/dti", example;
  int random = 100;
  app.add_option("FOLDER", folder, "labelled hearts");
  app.add_option("--random", random, "random ventricles");
  app.add_option("--example", example, "only write the guide points of docs/lv.md");
  CLI11_PARSE(app, argc, argv);
  try {
    if (!example.empty()) {
      const scanner::VentriclePhantom heart{
          .waves = {Eigen::Vector2d(0.02, -0.01), Eigen::Vector2d(-0.03, 0.02), Eigen::Vector2d(0.01, 0.01)}};
      write_whole_file(example, scanner::click(heart, {.phases = 4, .shift_mm = 2}).guide_csv);
      return 0;
    }
    if (fs::exists(folder / "labels.json")) {
      for (const std::string name : {"cine-beat", "cine-shift"}) {
        score_case(folder, name, "clicks", of_clicks,
                   [&] { return imaging::read_guide_points(folder / name / (name + ".guide.csv")); });
        score_case(folder, name, "cines", of_cines, [&] {
          return imaging::cine_guide_points(
              imaging::read_cines(imaging::read_image_folder(folder / name / "dicom")));
        });
      }
    } else {
      fmt::print("no labelled hearts in {}\n", folder.string());
    }
    score_random(random);
  } catch (const InputError& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 2;
  }
  return static_cast<int>(targets.conclude());
}
