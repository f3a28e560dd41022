#include "estimator/model/unloaded_model.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "estimator/io/study_refusal.hpp"
#include "estimator/mesh/collapsed_edge.hpp"
#include "estimator/model/affected_model.hpp"
#include "estimator/model/study_model.hpp"
#include "protocol/contract/angle.hpp"

namespace diastole {
namespace {

/// Fibre, sheet and transverse angle of material axes along a wall's axes (mesh/fibre_field.hpp).
Eigen::Vector3d angles_deg(const Eigen::Matrix3d& wall, const MaterialAxes& axes) {
  const Eigen::Vector3d fibre = wall.transpose() * axes.col(0);
  const double alpha = std::atan2(fibre[1], fibre[0]);
  const double gamma = std::asin(std::clamp(fibre[2], -1.0, 1.0));
  const Eigen::Matrix3d unturned = wall * Eigen::AngleAxisd(alpha, Eigen::Vector3d::UnitZ()) *
                                   Eigen::AngleAxisd(-gamma, Eigen::Vector3d::UnitY());
  const Eigen::Vector3d sheet = unturned.transpose() * axes.col(1);
  return Eigen::Vector3d(alpha, std::atan2(sheet[2], sheet[1]), gamma) / rad_per_deg;
}

/// A corner, or a place beside it where the wall has no direction (a collapsed edge).
MaterialPoint at_corner(const HermiteMesh& mesh, size_t element, size_t corner) {
  MaterialPoint point{element, {}};
  for (size_t k = 0; k < 3; ++k)
    point.xi[k] = static_cast<double>(corner >> k & 1);
  constexpr double beside = 0.05;
  return beside_collapse(mesh, point, beside);
}

/// The angles of `axes` at the nodes: means over the elements that meet there, each next to the node's first.
FibreField nodal_angles(const HermiteMesh& mesh, const MaterialAxesField& axes) {
  constexpr double none_deg = 1e-6;
  std::vector<Eigen::Vector3d> first(mesh.node_count()), sum(mesh.node_count(), Eigen::Vector3d::Zero());
  std::vector<double> count(mesh.node_count(), 0.0);
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    for (size_t c = 0; c < corners; ++c) {
      const MaterialPoint point = at_corner(mesh, e, c);
      const size_t node = mesh.element(e)[c];
      Eigen::Vector3d angles = angles_deg(wall_axes(mesh, point), axes(mesh, point));
      if (count[node] == 0.0) first[node] = angles;
      for (Eigen::Index i = 0; i < 3; ++i)
        angles[i] = first[node][i] + std::remainder(angles[i] - first[node][i], 360.0);
      sum[node] += angles;
      count[node] += 1.0;
    }
  }
  std::array<std::vector<double>, 3> nodal;
  for (size_t node = 0; node < mesh.node_count(); ++node)
    for (size_t i = 0; i < 3; ++i)
      nodal[i].push_back(sum[node][static_cast<Eigen::Index>(i)] / count[node]);
  for (size_t i = 1; i < 3; ++i)
    if (std::ranges::all_of(nodal[i], [](double deg) { return std::abs(deg) < none_deg; })) nodal[i].clear();
  return FibreField(std::move(nodal[0]), std::move(nodal[1]), std::move(nodal[2]));
}

}  // namespace

void require_plain(const Study& study, std::string_view purpose) {
  const auto refused = [&](const char* key, const char* what, const char* remedy) {
    refuse(study, key, fmt::format("{} known from the undeformed body alone, but {}", what, purpose), remedy);
  };
  const bool on_springs =
      std::visit([](const auto& specimen) { return specimen.end_springs.has_value(); }, study.specimen);
  if (on_springs) refused("specimen.ends", "springs at the ends are", "Hold the ends: ends = \"fixed\".");
  if (study.chamber) refused("chamber", "the fluid around the specimen is", "Leave [chamber] out.");
  if (shows_in_images(study)) refused("model.effects", "effects that show in images are", "Leave them out.");
}

ImagedLoad imaged_load_of(const Study& study) {
  if (!study.imaged_at) {
    refuse(study, "specimen.imaged_at_kPa", "missing, although --unload asks for the shape without load",
           "Give the cavity pressure at which the shape was imaged: imaged_at_kPa = 1.2.");
  }
  require_plain(study, "the undeformed body is sought");
  return *study.imaged_at;
}

bool UnloadedModel::returned() const { return shape.report.converged() && back.returned(imaged.mesh()); }

std::string UnloadedModel::describe() const {
  if (!shape.report.converged() || returned()) return shape.report.describe();
  return fmt::format(
      "a shape without load was found, but the load does not bring the image back: {}, {:.3g} mm off",
      back.report.describe(), back.farthest_mm);
}

UnloadedModel unload(const Study& study, const SolveOptions& options) {
  const ImagedLoad load = imaged_load_of(study);
  ElasticModel imaged = make_affected_model(study, options);
  require_cavity(study, imaged);
  SolveOptions quick = options;
  quick.check_stability = false;
  UnloadedShape shape = InverseDesign(imaged.system()).solve(load.pressure_kPa, nullptr, quick);
  const bool found = shape.report.converged();
  ElasticModel model =
      on_unloaded(imaged.system(), found ? shape.reference_mm : imaged.mesh().reference(), options);
  UnloadReturn back;
  if (found) back = inflate_again(model, imaged.mesh(), load.pressure_kPa);
  return {std::move(imaged), std::move(shape), std::move(model), std::move(back)};
}

UnloadedBody unloaded_body(const UnloadedModel& unloaded) {
  const HermiteMesh& mesh = unloaded.model.mesh();
  const MaterialAxesField& axes = unloaded.model.system().material_axes();
  UnloadedBody result{{mesh, {}}, 0.0};
  if (!axes) return result;
  result.body.fibres = nodal_angles(mesh, axes);
  double squares = 0.0;
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    for (const Xi& xi : gauss_tables().xi) {
      const MaterialPoint point{e, xi};
      const double cosine =
          axes(mesh, point).col(0).dot(result.body.fibres->material_axes(mesh, point).col(0));
      squares += std::pow(std::acos(std::min(1.0, std::abs(cosine))) / rad_per_deg, 2);
    }
  }
  result.fibre_rms_deg = std::sqrt(squares / static_cast<double>(gauss_points * mesh.element_count()));
  return result;
}

}  // namespace diastole
