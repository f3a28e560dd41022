// `tools/bench fibres [FOLDER] [--case NAME ...] [--true-wall]`: tensors and fibre fields against labelled diffusion series (FOLDER/NAME/dicom,
// NAME.guide.csv, FOLDER/truth and labels.json), default shared/data/dti beside the tree and no part of it.
//
// A row a case: tensors against the truth (RMS of the six numbers over voxels that are all tissue, 1e-3 mm²/s), the field's error at the truth's
// places in normal tissue (l >= 0.15) on the mesh that `diastole lv` fits to the guide points - with --true-wall on the true ellipsoid -, the
// apex, infarct and disarray apart, errors over their sigmas, and what was found wrong. Of a gel the mean diffusivity of each compartment. A
// figure beyond its target, a defect that is not found and one that is invented are marked MISSED and make the exit code 1.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <set>
#include <sstream>

#include "estimator/imaging/diffusion/fibre_session.hpp"
#include "estimator/imaging/geometry/ventricle_session.hpp"
#include "estimator/io/whole_file.hpp"
#include "estimator/mesh/ellipsoid.hpp"
#include "estimator/mesh/placed_mesh.hpp"
#include "estimator/mesh/point_locator.hpp"
#include "protocol/contract/angle.hpp"
#include "protocol/contract/input_error.hpp"
#include "tools/benchmarks/figure_targets.hpp"

namespace diastole {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

FigureTargets targets;

/// Rows of numbers below a header.
std::vector<std::vector<double>> read_rows(const fs::path& file) {
  std::istringstream lines(read_whole_file(file));
  std::string line;
  std::getline(lines, line);
  std::vector<std::vector<double>> rows;
  while (std::getline(lines, line)) {
    std::istringstream words(line);
    std::vector<double> row;
    for (std::string word; std::getline(words, word, ',');)
      row.push_back(std::stod(word));
    rows.push_back(std::move(row));
  }
  return rows;
}

HermiteMesh true_ellipsoid(const fs::path& file) {
  const Json g = Json::parse(read_whole_file(file));
  const EllipsoidShape shape{.inner_axes_mm = {g["endo_a_mm"], g["endo_c_mm"]},
                             .outer_axes_mm = {g["epi_a_mm"], g["epi_c_mm"]},
                             .base_z_mm = g["base_z_mm"],
                             .elements = {8, 5, 2}};
  Placement placement;
  for (size_t i = 0; i < 3; ++i) {
    placement.origin_mm[static_cast<Eigen::Index>(i)] = g["origin_mm"][i];
    for (size_t j = 0; j < 3; ++j)
      placement.rotation(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) =
          g["specimen_to_patient"][i][j];
  }
  return placed(make_ellipsoid(shape), placement);
}

std::optional<HermiteMesh> wall_of(const fs::path& folder, const std::string& name, bool true_wall) {
  const fs::path guide = folder / name / (name + ".guide.csv");
  const fs::path geometry = folder / name / (name + ".geometry.json");
  if (true_wall && fs::exists(geometry)) return true_ellipsoid(geometry);
  if (!fs::exists(guide)) return std::nullopt;
  return imaging::measure_ventricle({}, imaging::read_guide_points(guide)).body.mesh;
}

struct Sum {
  double squares = 0, count = 0;
  void add(double value) {
    squares += value * value;
    count += 1;
  }
  [[nodiscard]] double rms() const { return count > 0 ? std::sqrt(squares / count) : 0; }
  [[nodiscard]] std::string text(const char* form = "{:.2f}") const {
    return count > 0 ? fmt::format(fmt::runtime(form), rms()) : "-";
  }
};

Sum tensor_error(const imaging::FibreSession& session, const fs::path& truth) {
  constexpr double whole = 0.999;
  Sum sum;
  if (!fs::exists(truth)) return sum;
  std::map<std::array<int, 3>, const imaging::VoxelTensor*> voxels;
  for (const imaging::VoxelTensor& voxel : session.tensors.voxels)
    voxels[{voxel.slice, voxel.row, voxel.column}] = &voxel;
  for (const std::vector<double>& row : read_rows(truth)) {
    const auto found =
        voxels.find({static_cast<int>(row[0]), static_cast<int>(row[1]), static_cast<int>(row[2])});
    if (found == voxels.end() || row[6] < whole) continue;
    for (int i = 0; i < 6; ++i)
      sum.add(found->second->tensor[i] - row[static_cast<size_t>(8 + i)]);
  }
  return sum;
}

struct FieldErrors {
  Sum normal, apex, infarct, disarray, over_sigma;
};

FieldErrors field_errors(const imaging::FibreEstimate& field, const fs::path& truth) {
  FieldErrors errors;
  const HermiteMesh& mesh = field.lattice.mesh;
  const PointLocator locator(mesh, mesh.reference(), {.outside_xi = 1.0});
  for (const std::vector<double>& row : read_rows(truth)) {
    const auto located = locator.find({row[0], row[1], row[2]});
    if (!located) throw InputError({truth.string(), "", "a place lies outside the mesh", ""});
    const imaging::FibreAt at = field.at(located->point);
    const double cosine = std::abs(at.direction.dot(Eigen::Vector3d(row[3], row[4], row[5])));
    const double error_deg = std::acos(std::min(1.0, cosine)) / rad_per_deg;
    const double region = row[13], l = row[11];
    (region == 1   ? errors.infarct
     : region == 2 ? errors.disarray
     : l < 0.15    ? errors.apex
                   : errors.normal)
        .add(error_deg);
    if (region == 0 && l >= 0.15) errors.over_sigma.add(error_deg / at.sigma_deg);
  }
  return errors;
}

/// 1.5 degrees at SNR 20 or better, 3.5 at SNR 10.
double target_deg(const Json& label) {
  const double snr = label["acquisition"]["snr"];
  return snr > 0 && snr < 15 ? 3.5 : 1.5;
}

/// What `diastole fibres` must find, by the kind of the defect; nothing for a sound series. "refused" is one, too.
std::set<std::string> expected_findings(const std::string& kind) {
  if (kind == "gradient-flip") return {"gradient-axes"};
  if (kind == "hole") return {"image-missing"};
  if (kind == "dropout") return {"signal-outlier"};
  if (kind == "missing-direction" || kind == "truncated") return {"refused"};
  return {};
}

/// Images that were left out, as "volume,slice" of the labels, which number volumes as they were acquired.
bool finds_dropouts(const imaging::FibreSession& session, const Json& label) {
  const Json empty = Json::object();
  const Json& defect = label.contains("defect") && label["defect"].is_object() ? label["defect"] : empty;
  std::set<std::string> truth, found;
  for (const auto& [image, gain] : (defect.contains("gain") ? defect["gain"] : empty).items())
    truth.insert(image);
  for (const imaging::SignalOutlier& outlier : session.outliers) {
    const imaging::DiffusionVolume& volume = session.series.volumes[outlier.volume];
    size_t number = 0;
    double best = -1;
    for (size_t v = 0; v < label["volumes"].size(); ++v) {
      const Json& g = label["volumes"][v]["g"];
      const double along = std::abs(volume.direction().dot(Eigen::Vector3d(g[0], g[1], g[2])));
      if (along > best) number = v, best = along;
    }
    found.insert(fmt::format("{},{}", number, outlier.slice));
  }
  return truth == found;
}

/// Each compartment's mean diffusivity over voxels that are all of it.
std::string compartments(const imaging::FibreSession& session, const Json& label) {
  constexpr double edge_mm = 4, most_percent = 3;
  const auto vector = [](const Json& v) { return Eigen::Vector3d(v[0], v[1], v[2]); };
  const Json& grid = label["grid"];
  const Eigen::Vector3d centre = vector(grid["centre_mm"]), u = vector(grid["row_dir"]),
                        v = vector(grid["col_dir"]);
  const auto radius_mm = [&](const imaging::VoxelTensor& voxel, const Json& part) {
    return std::hypot((voxel.place_mm - centre).dot(u) - part["centre_uv_mm"][0].get<double>(),
                      (voxel.place_mm - centre).dot(v) - part["centre_uv_mm"][1].get<double>());
  };
  std::string text;
  const Json& parts = label["compartments"];
  for (size_t p = 0; p < parts.size(); ++p) {
    double sum = 0, count = 0;
    for (const imaging::VoxelTensor& voxel : session.tensors.voxels) {
      bool whole = true;
      for (size_t q = 0; q < parts.size(); ++q) {
        if (!parts[q].contains("radius_mm")) continue;
        const double past_mm = radius_mm(voxel, parts[q]) - parts[q]["radius_mm"].get<double>();
        // The tube is in the gel, the gel in the water.
        if (q == p)
          whole = whole && past_mm < -edge_mm;
        else if (q > p || !parts[p].contains("radius_mm"))
          whole = whole && past_mm > edge_mm;
      }
      if (!whole) continue;
      sum += imaging::shape_of(voxel.tensor).md;
      count += 1;
    }
    const double truth = 1e3 * parts[p]["adc_mm2_s"].get<double>(), percent = 100 * (sum / count / truth - 1);
    text += fmt::format("; {} {:+.1f} %{}", parts[p]["name"].get<std::string>(), percent,
                        targets.mark(std::abs(percent) <= most_percent));
  }
  return text;
}

std::string marked(const Sum& sum, double most) {
  return sum.text() + (sum.count > 0 ? targets.mark(sum.rms() <= most) : "");
}

void bench_case(const std::string& name, const Json& label, const fs::path& folder, bool true_wall) {
  const auto start = std::chrono::steady_clock::now();
  std::set<std::string> found;
  std::string figures, said;
  bool images_right = true;
  try {
    const std::optional<HermiteMesh> wall = wall_of(folder, name, true_wall);
    const imaging::FibreSession session = imaging::measure_fibres({.folder = folder / name / "dicom"}, wall);
    for (const Finding& finding : session.findings) {
      if (finding.severity == Severity::note) continue;
      found.insert(finding.id);
      said += fmt::format("    {}\n", finding.what);
    }
    images_right = finds_dropouts(session, label);
    const fs::path truth = folder / "truth" / (name + ".fibres.csv");
    FieldErrors errors;
    if (session.field && fs::exists(truth)) errors = field_errors(*session.field, truth);
    figures = fmt::format("{:>9}{:>8}{:>8}{:>9}{:>10}{:>8}{:>7.1f}",
                          tensor_error(session, folder / "truth" / (name + ".voxels.csv")).text("{:.5f}"),
                          marked(errors.normal, target_deg(label)), errors.apex.text(), errors.infarct.text(),
                          errors.disarray.text(), errors.over_sigma.text(),
                          std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    figures +=
        fmt::format("  MD {:.3f} FA {:.3f} of noise {:.3f}", session.md, session.fa, session.fa_of_noise);
    if (session.axes)
      figures += fmt::format("; axes agree {:.2f} of {:.2f}", session.axes->as_said.agreement,
                             session.axes->candidates.front().agreement);
    if (label.contains("compartments")) figures += compartments(session, label);
  } catch (const InputError& error) {
    found.insert("refused");
    figures = fmt::format("  {}", error.what());
    std::replace(figures.begin(), figures.end(), '\n', ' ');
  }
  const bool right = images_right && found == expected_findings(label["kind"]);
  fmt::print("{:<14}{}; found: {}{}\n", name, figures,
             found.empty() ? "nothing" : fmt::format("{}", fmt::join(found, ", ")),
             targets.mark(right) + (right ? "" : "\n" + said));
  std::fflush(stdout);
}

int run(int argc, char** argv) {
  CLI::App app("Fibres against labelled diffusion series: tools/bench fibres [FOLDER]");
  fs::path folder = fs::path(DIASTOLE_SOURCE_DIR).parent_path() / "shared/data/dti";
  std::vector<std::string> names;
  bool true_wall = false;
  app.add_option("FOLDER", folder, "labelled series, with labels.json");
  app.add_option("--case", names, "only these");
  app.add_flag("--true-wall", true_wall, "on the true ellipsoid instead of the mesh of the guide points");
  CLI11_PARSE(app, argc, argv);
  if (!fs::is_regular_file(folder / "labels.json")) {
    fmt::print("skipped: {} holds no labelled series (labels.json)\n", folder.string());
    return 0;
  }
  fmt::print("{:<14}{:>9}{:>8}{:>8}{:>9}{:>10}{:>8}{:>7}\n", "case", "tensors", "field", "apex", "infarct",
             "disarray", "/sigma", "s");
  const Json labels = Json::parse(read_whole_file(folder / "labels.json"));
  for (const auto& [name, label] : labels["cases"].items()) {
    if (label["type"] == "cine") continue;
    if (names.empty() || std::find(names.begin(), names.end(), name) != names.end())
      bench_case(name, label, folder, true_wall);
  }
  return static_cast<int>(targets.conclude());
}

}  // namespace
}  // namespace diastole

int main(int argc, char** argv) {
  try {
    return diastole::run(argc, argv);
  } catch (const std::exception& error) {
    fmt::print(stderr, "bench_fibres: {}\n", error.what());
    return 2;
  }
}
