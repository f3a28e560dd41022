#include "estimator/solution/solution_record.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "estimator/fe/elastic_system.hpp"
#include "estimator/fe/point_fields.hpp"
#include "estimator/solution/body_section.hpp"
#include "estimator/solution/wall_profile.hpp"

namespace diastole {
namespace {

constexpr double cells_across = 40;  // the body, in a section
constexpr size_t profile_points = 61;

/// Half-way up the cavity's wall; of a body without one, half-way up the body.
double middle_height_mm(const HermiteMesh& mesh) {
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  const auto cover = [&](size_t node) {
    low = std::min(low, mesh.reference()[dof_of(node, 0, 2)]);
    high = std::max(high, mesh.reference()[dof_of(node, 0, 2)]);
  };
  for (const ElementFace& face : mesh.faces().inner) {
    for (const size_t corner : face_corners(face))
      cover(mesh.element(face.element)[corner]);
  }
  if (mesh.faces().inner.empty()) {
    for (size_t node = 0; node < mesh.node_count(); ++node)
      cover(node);
  }
  return 0.5 * (low + high);
}

std::string height_words(double height_mm) {
  return fmt::format("z = {}{:.4g} mm", height_mm < 0 ? "\u2212" : "", std::abs(height_mm));
}

FlatPoints flat(const HermiteMesh& mesh, const NodeField& position_mm, const SectionPlane& plane,
                const std::vector<MaterialPoint>& points) {
  FlatPoints result;
  for (const MaterialPoint& point : points) {
    const Eigen::Vector3d place_mm = mesh.value(position_mm, point);
    result.push_back(plane.horizontal.dot(place_mm));
    result.push_back(plane.vertical.dot(place_mm));
  }
  return result;
}

std::vector<MaterialPoint> ends_of(const std::vector<MaterialLine>& lines) {
  std::vector<MaterialPoint> points;
  for (const MaterialLine& line : lines)
    points.insert(points.end(), line.begin(), line.end());
  return points;
}

std::vector<NamedField> fields_at(const ElasticModel& model, const ElasticState& state,
                                  const std::vector<MaterialPoint>& points) {
  std::vector<NamedField> fields;
  for (std::string& name : scalar_field_names(static_cast<bool>(model.system().material_axes())))
    fields.push_back({std::move(name), {}});
  for (const MaterialPoint& point : points) {
    const std::vector<double> values = scalar_fields(point_fields(model.system(), state, point));
    for (size_t i = 0; i < fields.size(); ++i)
      fields[i].values.push_back(values[i]);
  }
  return fields;
}

SolutionSection section_of(const ElasticModel& model, const ElasticState& state, const SectionPlane& plane) {
  const HermiteMesh& mesh = model.mesh();
  const BodySection cut = cut_body(mesh, plane, mesh.extent_mm() / cells_across);
  SolutionSection section;
  std::vector<MaterialPoint> centres;
  for (const SectionCell& cell : cut.cells) {
    std::vector<MaterialPoint> corners_of_cell;
    for (const Xi& corner : cell.corners)
      corners_of_cell.push_back({cell.element, corner});
    section.cells_before.push_back(flat(mesh, mesh.reference(), plane, corners_of_cell));
    section.cells_after.push_back(flat(mesh, state.position_mm, plane, corners_of_cell));
    centres.push_back(cell.centre());
  }
  section.outline_before = flat(mesh, mesh.reference(), plane, ends_of(cut.outline));
  section.outline_after = flat(mesh, state.position_mm, plane, ends_of(cut.outline));
  section.elements_before = flat(mesh, mesh.reference(), plane, ends_of(cut.elements));
  section.elements_after = flat(mesh, state.position_mm, plane, ends_of(cut.elements));
  section.fields = fields_at(model, state, centres);
  return section;
}

}  // namespace

SolutionRecord solution_record(const ElasticModel& model, const ElasticState& state) {
  using Eigen::Vector3d;
  SolutionRecord record;
  record.law = std::string(model.law().name());
  record.unknowns = model.dofs();
  record.pressure_kPa = state.pressure_kPa;
  if (model.system().cavity_closed()) {
    const double volume_mL = model.cavity_volume_mL(state);
    record.cavity_volume_mL = volume_mL;
    record.cavity_volume_change_mL = volume_mL - model.cavity_volume_mL(model.rest_state());
  }
  record.fibres = static_cast<bool>(model.system().material_axes());

  const double height_mm = middle_height_mm(model.mesh());
  const Vector3d centre_mm(0.0, 0.0, height_mm);
  SolutionSection across = section_of(model, state, {centre_mm, Vector3d::UnitX(), Vector3d::UnitY()});
  across.title = "Short axis, material of " + height_words(height_mm);
  across.horizontal = "x (mm)";
  across.vertical = "y (mm)";
  SolutionSection along_axis = section_of(model, state, {centre_mm, Vector3d::UnitX(), Vector3d::UnitZ()});
  along_axis.title = "Long axis, material of y = 0";
  along_axis.horizontal = "x (mm)";
  along_axis.vertical = "z (mm)";
  record.sections = {std::move(across), std::move(along_axis)};

  const WallProfile wall = cross_wall(model.mesh(), centre_mm, Vector3d::UnitX(), profile_points);
  record.profiles = {{"Through the wall along x at " + height_words(height_mm), wall.depth_mm,
                      fields_at(model, state, wall.points)}};
  return record;
}

}  // namespace diastole
