// `tools/bench track [FOLDER] [--case NAME ...] [--no-fits]`: tag tracking against labelled images (FOLDER/NAME/dicom with truth.h5, and
// FOLDER/labels.json), default shared/data/imaging beside the tree and no part of it.
//
// A row a case: the error along the tags' normal at phases 1-4, 8 and 16 in pixels, that of harmonic phase at the same places, how
// much of the lines is kept, wild points (more than a pixel off), the variance of errors over their sigma - of the smooth places and
// of the points' own - and what lies within two sigma. Then C1 by fits, the displacement field, refused folders, time and
// memory. Every figure that misses its target is marked MISSED, and any of them makes the exit code 1.

#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>

#include "estimator/fit/study_fit.hpp"
#include "estimator/imaging/series/image_folder.hpp"
#include "estimator/imaging/tracking/tags_file.hpp"
#include "estimator/imaging/tracking/tracked_folder.hpp"
#include "estimator/io/whole_file.hpp"
#include "estimator/reconstruction/study_reconstruction.hpp"
#include "protocol/contract/input_error.hpp"
#include "tools/benchmarks/copied_images.hpp"
#include "tools/benchmarks/figure_targets.hpp"
#include "tools/benchmarks/harmonic_phase.hpp"
#include "tools/benchmarks/imaging_truth.hpp"
#include "tools/benchmarks/timed_process.hpp"

namespace diastole {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr double edge_mm =
    1.0;  // points nearer to the wall's edge are not scored: truth itself is uncertain there
constexpr double near_mm = 3.0;       // a true point is kept if a reported one of its tag is as near
constexpr size_t harmonic_every = 7;  // of the points: harmonic phase is slow by its definition

FigureTargets targets;

struct Sum {
  double squares = 0, count = 0;
  void add(double value) {
    squares += value * value;
    count += 1;
  }
  [[nodiscard]] double rms() const { return std::sqrt(squares / std::max(count, 1.0)); }
  [[nodiscard]] double mean_square() const { return squares / std::max(count, 1.0); }
};

/// Phases 1-4, 8, 16.
struct Errors {
  std::array<Sum, 6> by_phase;  // 1, 2, 3, 4, 8, 16
  void add(size_t phase, size_t phases, double error_px) {
    if (phase < 4) by_phase[phase].add(error_px);
    if (phase == 7) by_phase[4].add(error_px);
    if (phase == std::min<size_t>(15, phases - 1)) by_phase[5].add(error_px);
  }
  [[nodiscard]] double early() const {
    return std::max({by_phase[0].rms(), by_phase[1].rms(), by_phase[2].rms(), by_phase[3].rms()});
  }
  [[nodiscard]] double middle() const { return by_phase[4].rms(); }
  [[nodiscard]] double late() const { return by_phase[5].rms(); }
};

struct Score {
  Errors tracked, harmonic;
  Sum over_sigma, over_own_sigma;
  double within_two = 0, wild = 0, points = 0, kept = 0, expected = 0, seconds = 0;
};

class Scorer {
 public:
  Scorer(const ImagingTruth& truth, const std::vector<imaging::TrackedSlice>& slices)
      : truth_(truth), slices_(slices), of_phase_(truth.times_s.size()) {
    for (const TruePoint& point : truth.points)
      of_phase_[point.phase].push_back(&point);
  }

  Score score() {
    for (const imaging::TrackedSlice& slice : slices_) {
      for (size_t i = 0; i < slice.points.points.size(); ++i)
        add(slice, slice.points.points[i], i % harmonic_every == 0);
    }
    count_kept();
    return score_;
  }

 private:
  /// Specimen's axes.
  struct Seen {
    size_t phase, family;
    int number;
    Eigen::Vector3d x_mm;
  };

  /// The family of this normal whose lines are nearest: slices of one direction may have planes of their own.
  [[nodiscard]] std::optional<size_t> family_at(size_t phase, const Eigen::Vector3d& normal,
                                                const Eigen::Vector3d& x_mm) const {
    std::optional<size_t> nearest;
    double least_mm2 = 1e300;
    for (const TruePoint* point : of_phase_[phase]) {
      const double apart_mm2 = (point->x_mm - x_mm).squaredNorm();
      if (apart_mm2 >= least_mm2 || std::abs(normal.dot(truth_.families[point->family].normal)) < 0.9995)
        continue;
      least_mm2 = apart_mm2;
      nearest = point->family;
    }
    return nearest;
  }

  [[nodiscard]] double n_dot_X(size_t phase, const Eigen::Vector3d& normal,
                               const Eigen::Vector3d& x_mm) const {
    return normal.dot(truth_.material_mm(phase, x_mm));
  }

  void add(const imaging::TrackedSlice& slice, const imaging::TrackedPoint& point, bool with_harmonic) {
    const Eigen::Vector3d x_mm = truth_.axes.transpose() * (point.x_mm - truth_.origin_mm);
    const Eigen::Vector3d normal = truth_.axes.transpose() * point.normal;
    const double plane_mm = point.plane_mm - point.normal.dot(truth_.origin_mm);
    const auto phase = static_cast<size_t>(point.frame - 1);
    if (phase >= truth_.times_s.size()) return;
    const auto f = family_at(phase, normal, x_mm);
    if (!f) return;
    const TrueFamily& family = truth_.families[*f];
    const double sign = normal.dot(family.normal) < 0 ? -1 : 1;
    const double number = std::round((sign * plane_mm - family.d_mm) / family.spacing_mm);
    seen_.push_back({phase, *f, static_cast<int>(number), x_mm});
    if (truth_.depth_mm(truth_.material_mm(phase, x_mm)) < edge_mm) return;
    const double plane_true_mm = family.d_mm + number * family.spacing_mm;
    // Along the normal: it lies in the image.
    constexpr double h_mm = 0.05;
    const double change = (n_dot_X(phase, family.normal, x_mm + h_mm * family.normal) -
                           n_dot_X(phase, family.normal, x_mm - h_mm * family.normal)) /
                          (2 * h_mm);
    const auto error_mm = [&](const Eigen::Vector3d& place_mm) {
      return (n_dot_X(phase, family.normal, place_mm) - plane_true_mm) / std::max(change, 0.3);
    };
    const double error = error_mm(x_mm);
    const double error_px = error / truth_.pixel_mm;
    score_.tracked.add(phase, truth_.times_s.size(), error_px);
    score_.over_sigma.add(error / point.sigma_mm);
    score_.over_own_sigma.add((error + sign * point.own_mm) / point.own_sigma_mm);
    score_.points += 1;
    score_.within_two += std::abs(error) < 2 * point.sigma_mm ? 1 : 0;
    score_.wild += std::abs(error_px) > 1 ? 1 : 0;
    if (with_harmonic) add_harmonic(slice, point, phase, error, sign);
  }

  void add_harmonic(const imaging::TrackedSlice& slice, const imaging::TrackedPoint& point, size_t phase,
                    double error_mm, double sign) {
    const imaging::SlicePlane& plane = slice.view.plane;
    const Eigen::Vector2d in_plane_mm = plane.in_plane_mm(point.x_mm);
    for (size_t k = 0; k < slice.view.frames.size(); ++k) {
      if (slice.view.frames[k] != point.frame) continue;
      for (const imaging::TagWave& wave : slice.tracked.waves) {
        const Eigen::Vector3d normal =
            (wave.per_mm.x() * plane.along_row + wave.per_mm.y() * plane.along_column).normalized();
        if (normal.dot(point.normal) < 0.9995) continue;
        const auto off_mm = harmonic_line_mm(slice.view.images[k], plane, wave, in_plane_mm);
        if (off_mm)
          score_.harmonic.add(phase, truth_.times_s.size(), (error_mm + sign * *off_mm) / truth_.pixel_mm);
      }
    }
  }

  void count_kept() {
    for (const TruePoint& point : truth_.points) {
      if (truth_.depth_mm(truth_.material_mm(point.phase, point.x_mm)) < edge_mm) continue;
      score_.expected += 1;
      for (const Seen& seen : seen_) {
        if (seen.phase != point.phase || seen.family != point.family || seen.number != point.number ||
            (seen.x_mm - point.x_mm).squaredNorm() > near_mm * near_mm)
          continue;
        score_.kept += 1;
        break;
      }
    }
  }

  const ImagingTruth& truth_;
  const std::vector<imaging::TrackedSlice>& slices_;
  std::vector<std::vector<const TruePoint*>> of_phase_;
  std::vector<Seen> seen_;
  Score score_;
};

struct Case {
  std::string name;
  fs::path folder;
  Json label;
  [[nodiscard]] bool is_ventricle() const { return label["kind"] == "ventricle"; }
  [[nodiscard]] fs::path frames() const { return folder / (name + ".frames.csv"); }
};

imaging::TrackedFolder tracked(const Case& one, const std::string& coordinates) {
  imaging::TrackRequest request{.folder = one.folder / "dicom", .coordinates = coordinates};
  return imaging::track_folder(request);
}

/// Targets of the error in pixels: phases 1-4, 8, 16.
std::array<double, 3> largest_errors_px(const Case& one) {
  if (one.name.starts_with("awk") || one.label["snr"].get<double>() < 15) return {0.12, 0.20, 0.40};
  if (one.is_ventricle()) return {0.08, 0.15, 0.25};
  return {0.06, 0.10, 0.20};
}

void bench_tracking(const std::vector<Case>& cases) {
  fmt::print(
      "Error along the tags' normal, RMS in pixels (the target in brackets), beside harmonic phase at the "
      "same places\n\n");
  fmt::print("{:<15} {:>8} {:>21} {:>21} {:>21} {:>17} {:>7} {:>7} {:>7} {:>7} {:>7} {:>6}\n", "", "points",
             "phases 1-4", "phase 8", "phase 16", "harmonic phase", "kept", "wild", "var", "in 2 s",
             "own var", "s");
  for (const Case& one : cases) {
    const ImagingTruth truth = [&] {
      ImagingTruth read = read_imaging_truth(one.folder / "truth.h5");
      read.is_ventricle = one.is_ventricle();
      return read;
    }();
    const auto start = std::chrono::steady_clock::now();
    const imaging::TrackedFolder folder = tracked(one, "patient");
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    const Score score = Scorer(truth, folder.slices).score();
    const std::array<double, 3> most = largest_errors_px(one);
    const auto column = [&](double value, double limit) {
      return fmt::format("{} ({:.2f})", targets.within(value, 0, limit), limit);
    };
    fmt::print("{:<15} {:>8} {:>21} {:>21} {:>21} {:>17} {:>7} {:>7} {:>7.2f} {:>7.3f} {:>7} {:>6.1f}\n",
               one.name, score.points, column(score.tracked.early(), most[0]),
               column(score.tracked.middle(), most[1]), column(score.tracked.late(), most[2]),
               fmt::format("{:.2f} {:.2f} {:.2f}", score.harmonic.early(), score.harmonic.middle(),
                           score.harmonic.late()),
               targets.within(score.kept / std::max(score.expected, 1.0), 0.9, 1.0),
               targets.within(score.wild / std::max(score.points, 1.0), 0, 0.002, "{:.4f}"),
               score.over_sigma.mean_square(), score.within_two / std::max(score.points, 1.0),
               targets.within(score.over_own_sigma.mean_square(), 0.9, 1.1, "{:.2f}"), seconds);
    std::fflush(stdout);
  }
}

Study gel_study(const Case& one, const fs::path& tags) {
  Study study{};
  study.file = tags.parent_path() / (one.name + ".study.toml");
  study.specimen = AnnulusSpecimen{22.5, 50.0, 85.0, {8, 4, 1}, "fixed"};
  study.law = {"neo-hookean", {{"C1_kPa", 6.0, 1.0, 20.0, Variation::whole}}};
  study.data.tags = tags;
  study.data.frames = one.frames();
  return study;
}

/// The paper's ventricle from its far start; all four values together.
void bench_ventricle(const Case& one, const fs::path& scratch) {
  const imaging::TrackedFolder folder = tracked(one, "auto");
  const fs::path tags = scratch / (one.name + ".tags.csv");
  write_whole_file(tags, imaging::tags_file_text(folder.points));
  Study study = gel_study(one, tags);
  study.specimen = EllipsoidSpecimen{{21, 51}, {30, 60}, 15, 60, -60, {8, 4, 2}, "fixed"};
  study.law = {"guccione",
               {{"C_kPa", 1.2, 0.2, 12.0, Variation::whole},
                {"b1", 26.7, 1.0, 60.0, Variation::whole},
                {"b2", 2.0, 0.2, 20.0, Variation::whole},
                {"b3", 14.7, 0.5, 50.0, Variation::whole}}};
  const FitRecord fit = fit_study(study, read_measurement(study), {});
  const auto count = static_cast<Eigen::Index>(fit.parameters.size());
  Eigen::VectorXd off(count);
  Eigen::MatrixXd correlation(count, count);
  fmt::print("{:<15}", one.name);
  for (Eigen::Index i = 0; i < count; ++i) {
    const FittedParameter& parameter = fit.parameters[static_cast<size_t>(i)];
    const double truth = one.label["guccione"][static_cast<size_t>(i)];
    off[i] = (parameter.value - truth) / parameter.se;
    for (Eigen::Index j = 0; j < count; ++j)
      correlation(i, j) = fit.correlation.matrix[static_cast<size_t>(i)][static_cast<size_t>(j)];
    fmt::print(" {} {:.3f} +- {:.3f} ({:.3f}),", parameter.name, parameter.value, parameter.se, truth);
  }
  const double joint = off.dot(correlation.ldlt().solve(off));
  fmt::print(" chi2 of all four {} (9.49), chi2/dof {:.3f}\n", targets.within(joint, 0, 9.49, "{:.2f}"),
             fit.chi2_per_dof);
  std::fflush(stdout);
}

/// What an operator knows of a slice that was planned: its height over the specimen's mid-height, along the axis as it is found (the
/// patient axis nearest to it points the same way).
double true_height_mm(const Case& one, const imaging::TagView& view) {
  const ImagingTruth truth = read_imaging_truth(one.folder / "truth.h5");
  Eigen::Vector3d axis = truth.axes.col(2);
  Eigen::Index largest = 0;
  axis.cwiseAbs().maxCoeff(&largest);
  if (axis[largest] < 0) axis = -axis;
  return (view.plane.at(0.5 * view.extent_mm()) - truth.origin_mm).dot(axis);
}

void bench_fits(const std::vector<Case>& cases, const fs::path& scratch) {
  fmt::print("\nC1 from DICOM and pressures, kPa (within 1 %, truth inside the 95 % interval)\n\n");
  for (const Case& one : cases) {
    if (one.is_ventricle()) {
      bench_ventricle(one, scratch);
      continue;
    }
    imaging::TrackedFolder folder = tracked(one, "auto");
    std::string marked;
    if (!folder.pose) {
      const double height_mm = true_height_mm(one, folder.slices.at(0).view);
      const fs::path edits = scratch / (one.name + ".edits.jsonl");
      write_whole_file(
          edits,
          Json{{"slice", folder.slices.at(0).view.name}, {"action", "height"}, {"height_mm", height_mm}}
              .dump());
      folder =
          imaging::track_folder({.folder = one.folder / "dicom", .coordinates = "specimen", .edits = edits});
      marked = fmt::format(", its slice's height ({:.1f} mm) given by hand", height_mm);
    }
    const fs::path tags = scratch / (one.name + ".tags.csv");
    write_whole_file(tags, imaging::tags_file_text(folder.points));
    const Study study = gel_study(one, tags);
    const Measurement measurement = read_measurement(study);
    const std::vector<Finding> findings = examine_measurement(study, measurement);
    if (has_error(findings)) {
      fmt::print("{:<15} refused: {}{}\n", one.name, findings.front().what, targets.mark(false));
      continue;
    }
    const FitRecord fit = fit_study(study, measurement, {});
    const FittedParameter& C1 = fit.parameters[0];
    const double truth = one.label["C1_kPa"];
    const bool inside = C1.ci95[0] <= truth && truth <= C1.ci95[1];
    fmt::print("{:<15} {:.3f} ({:.3f} to {:.3f}), truth {:.3f}{}: {} %, chi2/dof {:.3f}{}\n", one.name,
               C1.value, C1.ci95[0], C1.ci95[1], truth, targets.mark(inside),
               targets.within(100 * (C1.value / truth - 1), -1, 1, "{:+.2f}"), fit.chi2_per_dof, marked);
    std::fflush(stdout);
  }
}

void bench_field(const Case& one, const fs::path& scratch) {
  const ImagingTruth truth = read_imaging_truth(one.folder / "truth.h5");
  const imaging::TrackedFolder folder = tracked(one, "specimen");
  const fs::path tags = scratch / (one.name + ".tags.csv");
  write_whole_file(tags, imaging::tags_file_text(folder.points));
  const Study study = gel_study(one, tags);
  const StudyReconstruction result =
      reconstruct_study(study, read_measurement(study), {.check_stiffness = false});
  const HermiteMesh& mesh = result.body->mesh;
  const PointLocator locator(mesh, mesh.reference());
  double worst_mm = 0;
  for (const FrameField& field : result.fields) {
    Sum error_mm;
    for (size_t i = 0; i < truth.grid.X_mm.size(); ++i) {
      const auto place = locator.find(truth.grid.X_mm[i]);
      if (!place) continue;
      const Eigen::Vector3d off = mesh.value(field.displacement_mm, place->point) -
                                  truth.grid.u_mm[static_cast<size_t>(field.number - 1)][i];
      error_mm.add(off.norm());
    }
    worst_mm = std::max(worst_mm, error_mm.rms());
  }
  fmt::print("\nDisplacement field of {} on 8 x 4 x 1 elements, the worst phase: {} mm RMS (0.15)\n",
             one.name, targets.within(worst_mm, 0, 0.15));
}

void bench_refusals(const fs::path& folder, const Json& labels) {
  fmt::print("\nFolders that must be refused\n\n");
  for (const auto& [name, label] : labels["cases"].items()) {
    if (!label.value("refuse", false)) continue;
    std::string said;
    try {
      const imaging::ImageFolder read = imaging::read_image_folder(folder / name / "dicom");
      imaging::require_sound(read);
    } catch (const InputError& error) {
      said = error.what();
    }
    const bool is_refused = !said.empty();
    fmt::print("{:<15} {}{}\n", name,
               is_refused ? said.substr(0, said.find('\n')) : "taken:", targets.mark(is_refused));
  }
}

std::string exit_of(const ProcessCost& cost) {
  return fmt::format("{}{}", cost.exit_code, targets.mark(cost.exit_code == 0));
}

void bench_cost(const Case& wide, const Case& many, const fs::path& scratch) {
  const fs::path program = fs::path(DIASTOLE_PROGRAM);
  copy_images(wide.folder / "dicom", scratch / "protocol", 12 * 16);
  const ProcessCost track =
      run_timed({program.string(), "track", "protocol", "-o", "protocol.tags.csv", "--coords", "patient"},
                scratch, scratch / "track.log");
  fmt::print(
      "\n`diastole track`, 12 slices and directions x 16 phases of 256 x 256: {} s (10), {} MB (500), exit "
      "{}\n",
      targets.within(track.wall_s, 0, 10, "{:.1f}"), targets.within(track.peak_MB, 0, 500, "{:.0f}"),
      exit_of(track));
  copy_images(many.folder / "dicom", scratch / "many", 5000);
  const ProcessCost images = run_timed({program.string(), "images", "many"}, scratch, scratch / "images.log");
  fmt::print("`diastole images`, 5000 files: {} s (20), {} MB (500), exit {}\n\n",
             targets.within(images.wall_s, 0, 20, "{:.1f}"), targets.within(images.peak_MB, 0, 500, "{:.0f}"),
             exit_of(images));
}

int run(int argc, char** argv) {
  CLI::App app("Tag tracking against labelled images: tools/bench track [FOLDER]");
  fs::path folder = fs::path(DIASTOLE_SOURCE_DIR).parent_path() / "shared/data/imaging";
  std::vector<std::string> names;
  bool no_fits = false, no_cost = false;
  app.add_option("FOLDER", folder, "labelled images, with labels.json");
  app.add_option("--case", names, "only these");
  app.add_flag("--no-fits", no_fits, "track only");
  app.add_flag("--no-cost", no_cost, "do not measure time and memory");
  CLI11_PARSE(app, argc, argv);
  if (!fs::is_regular_file(folder / "labels.json")) {
    fmt::print("skipped: {} holds no labelled images (labels.json)\n", folder.string());
    return 0;
  }
  const Json labels = Json::parse(read_whole_file(folder / "labels.json"));
  std::vector<Case> cases;
  for (const auto& [name, label] : labels["cases"].items()) {
    if (!label.contains("tag_spacing_mm")) continue;
    if (names.empty() || std::find(names.begin(), names.end(), name) != names.end())
      cases.push_back({name, folder / name, label});
  }
  const fs::path scratch = fs::temp_directory_path() / fmt::format("diastole-bench-track-{}", getpid());
  fs::create_directories(scratch);
  // First, while this program is small: a child's peak memory counts its parent's at the start.
  if (names.empty() && !no_cost) {
    const auto named = [&](const char* name) {
      return *std::find_if(cases.begin(), cases.end(), [&](const Case& one) { return one.name == name; });
    };
    bench_cost(named("gel-full"), named("gel-snr10"), scratch);
  }
  bench_tracking(cases);
  if (!no_fits) {
    bench_fits(cases, scratch);
    for (const Case& one : cases) {
      if (one.name == "gel-a") bench_field(one, scratch);
    }
  }
  if (names.empty()) bench_refusals(folder, labels);
  fs::remove_all(scratch);
  return static_cast<int>(targets.conclude());
}

}  // namespace
}  // namespace diastole

int main(int argc, char** argv) {
  try {
    return diastole::run(argc, argv);
  } catch (const std::exception& error) {
    fmt::print(stderr, "bench_track: {}\n", error.what());
    return 2;
  }
}
