#include "estimator/fe/point_fields.hpp"

#include <Eigen/Geometry>
#include <map>
#include <set>
#include <utility>

#include "estimator/fe/elastic_system.hpp"

namespace diastole {
namespace {

using Eigen::Matrix3d;

/// The first axis with the material, the third normal to the carried plane of the first two.
CarriedAxes carried(const Matrix3d& reference, const Matrix3d& gradient) {
  const Matrix3d moved = gradient * reference;
  CarriedAxes axes{.reference = reference, .deformed = {}};
  axes.deformed.col(0) = moved.col(0).normalized();
  axes.deformed.col(2) = moved.col(0).cross(moved.col(1)).normalized();
  axes.deformed.col(1) = axes.deformed.col(2).cross(axes.deformed.col(0));
  return axes;
}

double lagrange_pressure_kPa(const ElasticSystem& system, const ElasticState& state,
                             const MaterialPoint& point) {
  const std::array<double, corners> basis = trilinear_basis(point.xi);
  double sum_kPa = 0.0;
  for (size_t m = 0; m < corners; ++m)
    sum_kPa += basis[m] * state.lagrange_pressure_kPa[system.pressures().unknown[point.element][m]];
  return sum_kPa;
}

}  // namespace

PointFields point_fields(const ElasticSystem& system, const ElasticState& state, const MaterialPoint& point) {
  const HermiteMesh& mesh = system.mesh();
  PointFields fields;
  fields.reference_mm = mesh.value(mesh.reference(), point);
  fields.displacement_mm = mesh.value(state.position_mm, point) - fields.reference_mm;
  const Matrix3d gradient = mesh.reference_gradient(state.position_mm, point);
  fields.deformation_gradient = gradient;
  fields.volume_ratio = gradient.determinant();
  fields.green_strain = 0.5 * (gradient.transpose() * gradient - Matrix3d::Identity());
  fields.lagrange_pressure_kPa = lagrange_pressure_kPa(system, state, point);
  fields.wall = carried(wall_axes(mesh, point), gradient);

  const Matrix3d axes = system.material_axes() ? system.material_axes()(mesh, point) : Matrix3d::Identity();
  if (system.material_axes()) fields.fibre = carried(axes, gradient);
  const Matrix3d to_material = gradient * axes;  // F Q
  const double stiffness = system.stiffness() ? system.stiffness()(fields.reference_mm) : 1.0;
  Matrix3d second =
      stiffness * full_matrix(system.law().stress(symmetric_part(to_material.transpose() * to_material),
                                                  system.parameters(point.element)));
  second(0, 0) += state.fibre_tension_kPa;
  const double pressure_kPa =
      fields.lagrange_pressure_kPa - system.volume_stiffness_kPa() * (fields.volume_ratio - 1.0) -
      (1.0 - stiffness) * system.law().rest_pressure_kPa(system.parameters(point.element));
  fields.stress_kPa = to_material * second * to_material.transpose() / fields.volume_ratio -
                      pressure_kPa * Matrix3d::Identity();
  return fields;
}

ElasticState with_averaged_pressure(const ElasticSystem& system, const ElasticState& state) {
  const HermiteMesh& mesh = system.mesh();
  // Unknowns that meet at one place in one material; those of a collapsed edge's corners are one and count once.
  std::map<std::pair<size_t, std::vector<double>>, std::set<size_t>> meeting;
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    const std::span<const double> parameters = system.parameters(e);
    const std::vector<double> material(parameters.begin(), parameters.end());
    for (size_t m = 0; m < corners; ++m)
      meeting[{mesh.place_of(mesh.element(e)[m]), material}].insert(system.pressures().unknown[e][m]);
  }
  ElasticState averaged = state;
  for (const auto& [where, unknowns] : meeting) {
    double sum_kPa = 0.0;
    for (const size_t unknown : unknowns)
      sum_kPa += state.lagrange_pressure_kPa[unknown];
    for (const size_t unknown : unknowns)
      averaged.lagrange_pressure_kPa[unknown] = sum_kPa / static_cast<double>(unknowns.size());
  }
  return averaged;
}

SymmetricTensor<double> along(const Matrix3d& axes, const Matrix3d& tensor) {
  return symmetric_part(axes.transpose() * tensor * axes);
}

std::vector<std::string> scalar_field_names(bool fibres) {
  std::vector<std::string> names;
  const auto add_tensors = [&](const std::array<const char*, 6>& entries) {
    for (const char* entry : entries)
      names.push_back(std::string("strain_") + entry);
    for (const char* entry : entries)
      names.push_back(std::string("stress_") + entry + "_kPa");
  };
  add_tensors({"cc", "ll", "rr", "cl", "lr", "rc"});
  names.emplace_back("lagrange_pressure_kPa");
  names.emplace_back("volume_ratio");
  if (fibres) {
    add_tensors({"ff", "ss", "nn", "fs", "sn", "nf"});
    names.emplace_back("fibre_stretch");
  }
  return names;
}

std::vector<double> scalar_fields(const PointFields& fields) {
  std::vector<double> values;
  const auto add_tensors = [&](const CarriedAxes& axes) {
    const SymmetricTensor<double> strain = along(axes.reference, fields.green_strain);
    const SymmetricTensor<double> stress_kPa = along(axes.deformed, fields.stress_kPa);
    for (const double entry : strain)
      values.push_back(entry);
    for (const double entry : stress_kPa)
      values.push_back(entry);
  };
  add_tensors(fields.wall);
  values.push_back(fields.lagrange_pressure_kPa);
  values.push_back(fields.volume_ratio);
  if (fields.fibre) {
    add_tensors(*fields.fibre);
    values.push_back(stretch_along_first(fields, *fields.fibre));
  }
  return values;
}

double stretch_along_first(const PointFields& fields, const CarriedAxes& axes) {
  return (fields.deformation_gradient * axes.reference.col(0)).norm();
}

}  // namespace diastole
