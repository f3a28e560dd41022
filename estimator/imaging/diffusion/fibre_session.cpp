#include "estimator/imaging/diffusion/fibre_session.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>

#include "estimator/io/tracking_file.hpp"
#include "estimator/mesh/fibre_field.hpp"
#include "estimator/mesh/point_locator.hpp"
#include "estimator/parallel/parallel_for.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/signal/quantile.hpp"

namespace diastole::imaging {
namespace {

double middle_of(std::vector<double> values) { return signal::quantile(std::move(values), 0.5); }

/// What noise of this covariance makes of an isotropic tensor: the mean square deviator is the deviator's variance.
double fa_of_noise(const VoxelTensor& voxel, double md) {
  const double deviator = deviator_noise(voxel.covariance);
  return std::sqrt(1.5 * deviator / (3 * md * md + deviator));
}

void summarise(FibreSession& session, const std::vector<const VoxelTensor*>& voxels) {
  std::vector<double> snr, md, fa, noise;
  for (const VoxelTensor* voxel : voxels) {
    const TensorShape shape = shape_of(voxel->tensor);
    if (session.tensors.sigma > 0) snr.push_back(voxel->s0 / session.tensors.sigma);
    md.push_back(shape.md);
    fa.push_back(shape.fa);
    noise.push_back(fa_of_noise(*voxel, shape.md));
  }
  session.snr = middle_of(snr);
  session.md = middle_of(md);
  session.fa = middle_of(fa);
  session.fa_of_noise = middle_of(noise);
  // In the middle of many voxels a tenth more than noise shows; 1.3 leaves room for noise that is not quite Gaussian.
  constexpr double seen = 1.3;
  if (session.fa < seen * session.fa_of_noise)
    session.findings.push_back({Severity::note, "isotropic",
                                fmt::format("the anisotropy is that of noise: FA {:.3f} in the middle of the "
                                            "voxels, of which noise alone makes "
                                            "{:.3f}",
                                            session.fa, session.fa_of_noise),
                                session.series.name, session.fa, "",
                                "An isotropic material shows this; its true FA is near zero. The first "
                                "eigenvector of a single voxel means nothing here."});
  if (session.tensors.sigma == 0)
    session.findings.push_back(
        {Severity::note, "noise-unknown",
         "every slice has as many images as a tensor has unknowns: the noise is not known",
         session.series.name, 0, "",
         "Tensors have no errors of their own; those of a field come from how far "
         "voxels lie from it. Acquire one image more."});
  if (session.tensors.not_positive > 0)
    session.findings.push_back(
        {Severity::note, "not-positive",
         fmt::format("{} of {} tensors have an eigenvalue that is not positive: noise exceeds their signal",
                     session.tensors.not_positive, session.tensors.voxels.size()),
         session.series.name, static_cast<double>(session.tensors.not_positive), "voxels",
         "They count with their errors; their FA is not to be used."});
}

FibrePointRow row_of(const Eigen::Vector3d& place, const FibreAt& found) {
  FibrePointRow row{};
  for (int i = 0; i < 3; ++i) {
    row.place_mm[static_cast<size_t>(i)] = place[i];
    row.direction[static_cast<size_t>(i)] = found.direction[i];
  }
  row.sigma_deg = std::max(found.sigma_deg, 1e-4);
  return row;
}

/// Eight places in each element of the lattice: a mesh's own nodal field is found again from them.
std::vector<FibrePointRow> rows_over_mesh(const FibreEstimate& field) {
  const double gauss = 0.5 / std::numbers::sqrt3;
  const HermiteMesh& mesh = field.lattice.mesh;
  std::vector<FibrePointRow> rows(8 * mesh.element_count());
  parallel_for(rows.size(), machine_threads(), [&](size_t i) {
    MaterialPoint point{i / 8, {}};
    for (size_t k = 0; k < 3; ++k)
      point.xi[k] = 0.5 + ((i >> k & 1U) != 0 ? gauss : -gauss);
    rows[i] = row_of(mesh.value(mesh.reference(), point), field.at(point));
  });
  return rows;
}

std::vector<FibrePointRow> rows_at(const FibreEstimate& field, const std::filesystem::path& file) {
  // A mesh fitted to images is right within half a millimetre, a fifth of an element's thickness; four times that is no place of this wall.
  const PointLocator locator(field.lattice.mesh, field.lattice.mesh.reference(), {.outside_xi = 1.0});
  std::vector<FibrePointRow> rows;
  const auto places = read_places(file);
  for (size_t i = 0; i < places.size(); ++i) {
    const Eigen::Vector3d place(places[i].data());
    const auto located = locator.find(place);
    if (!located)
      throw InputError({file.string(), fmt::format("line {}", i + 2),
                        fmt::format("({:.1f}, {:.1f}, {:.1f}) mm lies outside the mesh's wall", place.x(),
                                    place.y(), place.z()),
                        "Places are in the images' patient coordinates, in the wall."});
    rows.push_back(row_of(place, field.at(located->point)));
  }
  return rows;
}

/// Of the field's elements: more than one row of its eight from apex to base. The apex's alone holds few voxels.
constexpr double most_continued = 1.0 / 8;

/// The share of the field's elements that neither hold a voxel nor have a node in common with one that does: there it goes on as elsewhere.
double continued_share(const FibreLattice& lattice, const std::vector<WallVoxel>& voxels) {
  std::vector<bool> is_seen(lattice.mesh.element_count(), false), touches(lattice.mesh.node_count(), false);
  for (const WallVoxel& voxel : voxels)
    for (const WallSample& sample : voxel.samples)
      is_seen[sample.element] = true;
  for (size_t e = 0; e < is_seen.size(); ++e)
    if (is_seen[e])
      for (const size_t node : lattice.mesh.element(e))
        touches[node] = true;
  size_t continued = 0;
  for (size_t e = 0; e < is_seen.size(); ++e) {
    const auto& nodes = lattice.mesh.element(e);
    if (std::ranges::none_of(nodes, [&](size_t node) { return touches[node]; })) ++continued;
  }
  return static_cast<double>(continued) / static_cast<double>(is_seen.size());
}

void fit_field(FibreSession& session, const FibreSessionRequest& request, const HermiteMesh& wall,
               const std::function<void(const std::string&)>& stage) {
  FibreLattice lattice = fibre_lattice(wall);
  const std::vector<WallVoxel> voxels = wall_voxels(lattice, session.series, session.tensors);
  if (!request.axes) {
    session.axes = check_axes(voxels, {session.series.image_axes, session.series.table_axes});
    session.findings.insert(session.findings.end(), session.axes->findings.begin(),
                            session.axes->findings.end());
    // The voxels point into the tensors, which turn where they are.
    if (session.axes->is_wrong) change_axes(session.tensors, session.axes->chosen.change);
  }
  std::vector<const VoxelTensor*> in_wall;
  for (const WallVoxel& voxel : voxels)
    in_wall.push_back(voxel.voxel);
  summarise(session, in_wall);
  if (const double share = continued_share(lattice, voxels); share > most_continued)
    session.findings.push_back(
        {Severity::warning, "fibres-continued",
         fmt::format("{:.0f} % of the field's elements hold no voxel and touch none that does: there fibres "
                     "are continued from the rest, and their errors hold only if they go on as smoothly",
                     100 * share),
         session.series.name, 100 * share, "%", "Measure slices from base to apex."});
  session.field = estimate_fibres(lattice, voxels, session.folder, stage);
  // Twice what the tensors' own errors explain: is it the voxels' extent? No scanner's image is without, computed ones may be.
  constexpr double unexplained = 2;
  if (session.field->noise_scale > unexplained) {
    FibreEstimate centres = estimate_fibres(
        std::move(lattice), centre_voxels(session.field->lattice, session.tensors), session.folder, stage);
    if (centres.noise_scale < session.field->noise_scale / unexplained) {
      session.findings.push_back(
          {Severity::note, "voxel-centres",
           fmt::format("tensors are those of the voxels' centres, not means over their extent: they miss the "
                       "field by {:.1f} times their errors, and by {:.1f} as means",
                       centres.noise_scale, session.field->noise_scale),
           session.series.name, centres.noise_scale, "",
           "Computed images are like this. A scanner's are not: were they resampled?"});
      session.field = std::move(centres);
    }
  }
  if (!session.field->converged)
    session.findings.push_back(
        {Severity::warning, "not-converged",
         fmt::format("the fibre field still changed after {} iterations", session.field->iterations),
         session.series.name, static_cast<double>(session.field->iterations), "iterations",
         "Look at the page: does the mesh lie in the images' wall?"});
  session.rows = request.at ? rows_at(*session.field, *request.at) : rows_over_mesh(*session.field);
  std::vector<double> sigmas;
  for (const FibrePointRow& row : session.rows)
    sigmas.push_back(row.sigma_deg);
  session.sigma_deg = middle_of(std::move(sigmas));
}

/// Strokes of one layer's near half, seen across the long axis.
FibreLayerRecord layer_of(const FibreEstimate& field, double depth, std::string name) {
  const HermiteMesh& mesh = field.lattice.mesh;
  // The long axis: what all e_l have in common.
  Eigen::Vector3d up = Eigen::Vector3d::Zero(), centre = Eigen::Vector3d::Zero();
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    const MaterialPoint middle{e, {0.5, 0.5, 0.5}};
    up += wall_axes(mesh, middle).col(1) / static_cast<double>(mesh.element_count());
    centre += mesh.value(mesh.reference(), middle) / static_cast<double>(mesh.element_count());
  }
  up.normalize();
  const Eigen::Vector3d right = up.unitOrthogonal(), towards = right.cross(up);
  FibreLayerRecord layer;
  layer.name = std::move(name);
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    double low = 1, high = 0;
    for (const size_t node : mesh.element(e)) {
      low = std::min(low, field.lattice.depth[node]);
      high = std::max(high, field.lattice.depth[node]);
    }
    if (depth < low || depth > high || (depth == low && low > 0 && depth < 1)) continue;
    for (const auto& [xi1, xi2] : {std::pair{0.25, 0.25}, {0.75, 0.25}, {0.25, 0.75}, {0.75, 0.75}}) {
      const MaterialPoint point{e, {xi1, xi2, (depth - low) / std::max(high - low, 1e-9)}};
      if (wall_axes(mesh, point).col(2).dot(towards) < 0.1) continue;
      const Eigen::Vector3d place = mesh.value(mesh.reference(), point) - centre;
      const FibreAt found = field.at(point);
      layer.x_mm.push_back(place.dot(right));
      layer.y_mm.push_back(place.dot(up));
      layer.along_x.push_back(found.direction.dot(right));
      layer.along_y.push_back(found.direction.dot(up));
      layer.helix_deg.push_back(found.angles.helix_deg);
    }
  }
  return layer;
}

void add_course(FibresRecord& record, const FibreEstimate& field) {
  std::vector<double> depths = field.lattice.depth;
  std::sort(depths.begin(), depths.end());
  depths.erase(std::unique(depths.begin(), depths.end(), [](double a, double b) { return b - a < 1e-6; }),
               depths.end());
  for (const double depth : depths) {
    std::vector<double> helix;
    for (size_t node = 0; node < field.nodes.size(); ++node)
      if (std::abs(field.lattice.depth[node] - depth) < 1e-6) helix.push_back(field.nodes[node].helix_deg);
    record.depth.push_back(depth);
    record.helix_deg.push_back(middle_of(helix));
    record.helix_low_deg.push_back(signal::quantile(helix, 0.1));
    record.helix_high_deg.push_back(signal::quantile(helix, 0.9));
  }
}

/// Brightness is the angle to the image plane: the paper's Fig. 8a.
void add_pictures(FibresRecord& record, const FibreSession& session) {
  const SlicePlane& plane = session.series.slices.front();
  record.rows = plane.rows;
  record.columns = plane.columns;
  record.pixel_aspect = plane.row_spacing_mm / plane.column_spacing_mm;
  std::vector<std::string> pictures(
      session.series.slices.size(),
      std::string(static_cast<size_t>(plane.rows) * static_cast<size_t>(plane.columns), '\0'));
  constexpr double least_fa = 0.12;  // below, noise chooses the direction
  for (const VoxelTensor& voxel : session.tensors.voxels) {
    const TensorShape shape = shape_of(voxel.tensor);
    if (shape.fa < least_fa || shape.values[2] <= 0) continue;
    const double across = std::abs(shape.vectors.col(0).dot(session.series.image_axes.col(2)));
    const double share = 1 - std::asin(std::min(1.0, across)) / (0.5 * std::numbers::pi);
    pictures[static_cast<size_t>(voxel.slice)]
            [static_cast<size_t>(voxel.row) * static_cast<size_t>(plane.columns) +
             static_cast<size_t>(voxel.column)] =
                static_cast<char>(static_cast<unsigned char>(std::lround(40 + 215 * share)));
  }
  for (const std::string& picture : pictures)
    record.pictures.push_back({base64(picture)});
}

}  // namespace

FibreSession measure_fibres(const FibreSessionRequest& request, const std::optional<HermiteMesh>& wall,
                            const std::function<void(const std::string&)>& stage) {
  const auto say = [&](const std::string& what) {
    if (stage) stage(what);
  };
  say("Reading images.");
  FibreSession session{.folder = request.folder.string(),
                       .series = read_diffusion(request.folder, request.series)};
  if (!request.keep_outliers) session.outliers = remove_outliers(session.series, session.folder);
  session.findings = session.series.findings;
  say(fmt::format("Fitting tensors to {} volumes of {} slices.", session.series.volumes.size(),
                  session.series.slices.size()));
  session.tensors = fit_tensors(session.series);
  if (request.axes) change_axes(session.tensors, request.axes->change);
  if (wall) {
    fit_field(session, request, *wall, stage);
  } else {
    std::vector<const VoxelTensor*> all;
    for (const VoxelTensor& voxel : session.tensors.voxels)
      all.push_back(&voxel);
    summarise(session, all);
  }
  // Last: errors and anisotropy do not depend on it.
  if (request.factor_two) {
    session.md /= 2;
    for (VoxelTensor& voxel : session.tensors.voxels) {
      voxel.tensor /= 2;
      voxel.covariance /= 4;
    }
  }
  return session;
}

std::string tensor_file_text(const TensorImage& tensors) {
  std::string text(tensor_file_mark);
  text += '\n';
  for (const VoxelTensor& voxel : tensors.voxels) {
    fmt::format_to(std::back_inserter(text), "{:.4f},{:.4f},{:.4f}", voxel.place_mm.x(), voxel.place_mm.y(),
                   voxel.place_mm.z());
    for (const double number : voxel.tensor)
      fmt::format_to(std::back_inserter(text), ",{:.12f}", number);
    text += '\n';
  }
  return text;
}

FibresRecord fibres_record(const FibreSession& session) {
  FibresRecord record;
  record.folder = session.folder;
  record.series = session.series.name;
  record.b_values = session.series.b_values();
  record.directions = session.series.directions().size();
  record.volumes = session.series.volumes.size();
  record.slices = session.series.slices.size();
  record.snr = session.snr;
  record.md = session.md;
  record.fa = session.fa;
  record.fa_of_noise = session.fa_of_noise;
  record.outliers = session.outliers.size();
  if (session.axes) {
    record.axes = session.axes->chosen.name;
    record.axes_agreement = session.axes->chosen.agreement;
    record.axes_agreement_as_said = session.axes->as_said.agreement;
  }
  if (session.field) {
    record.wall_voxels = session.field->voxels;
    record.rms_deg = session.field->rms_deg;
    record.sigma_deg = session.sigma_deg;
    add_course(record, *session.field);
    record.layers = {layer_of(*session.field, 0, "endocardium"), layer_of(*session.field, 0.5, "mid-wall"),
                     layer_of(*session.field, 1, "epicardium")};
  }
  add_pictures(record, session);
  record.findings = session.findings;
  return record;
}

}  // namespace diastole::imaging
