#include "estimator/solution/solution_record.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "estimator/fe/elastic_system.hpp"
#include "estimator/fe/point_fields.hpp"
#include "estimator/solution/body_section.hpp"

namespace diastole {
namespace {

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
  record.sections = drawn_sections(model.mesh(), state.position_mm, centre_mm, height_words(height_mm),
                                   [&](const auto& points) { return fields_at(model, state, points); });

  const WallProfile wall = cross_wall(model.mesh(), centre_mm, Vector3d::UnitX(), profile_points);
  record.profiles = {{"Through the wall along x at " + height_words(height_mm), wall.depth_mm,
                      fields_at(model, state, wall.points)}};
  return record;
}

}  // namespace diastole
