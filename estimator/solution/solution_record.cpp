#include "estimator/solution/solution_record.hpp"

#include "estimator/fe/elastic_system.hpp"
#include "estimator/fe/point_fields.hpp"
#include "estimator/solution/body_section.hpp"

namespace diastole {
namespace {

constexpr size_t profile_points = 61;

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

  record.sections = drawn_sections(model.mesh(), state.position_mm,
                                   [&](const auto& points) { return fields_at(model, state, points); });

  const Eigen::Vector3d centre_mm = middle_of(model.mesh());
  const WallProfile wall = cross_wall(model.mesh(), centre_mm, Eigen::Vector3d::UnitX(), profile_points);
  record.profiles = {{"Through the wall along x at " + height_words(centre_mm), wall.depth_mm,
                      fields_at(model, state, wall.points)}};
  return record;
}

}  // namespace diastole
