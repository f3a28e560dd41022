#include "estimator/solution/solution_grid.hpp"

#include <fmt/format.h>

#include <iterator>
#include <utility>

#include "estimator/fe/elastic_system.hpp"
#include "estimator/fe/gauss_points.hpp"
#include "estimator/fe/point_fields.hpp"
#include "estimator/mesh/bezier.hpp"

namespace diastole {
namespace {

GridStep step_of(const ElasticModel& model, const SolvedFrame& frame) {
  const HermiteMesh& mesh = model.mesh();
  const ElasticSystem& system = model.system();
  GridArray displacement{"displacement_mm", 3, {}};
  std::vector<GridArray> arrays = sampled_arrays(static_cast<bool>(system.material_axes()));
  const std::array<double, 4> places = line_rule_4().place;
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    const ElementField moved = mesh.gather(e, frame.state.position_mm) - mesh.gather(e, mesh.reference());
    append_in_vtk_order(bezier_of(moved).transpose(), displacement.values);
    const auto sample = [&](const Xi& xi) {
      return sampled_fields(point_fields(system, frame.state, {e, xi}));
    };
    append_in_vtk_order(bezier_through(places, sample), arrays);
  }
  arrays.insert(arrays.begin(), std::move(displacement));
  return {frame.time_s, std::move(arrays), {{"pressure_kPa", 1, {frame.state.pressure_kPa}}}};
}

}  // namespace

Eigen::VectorXd sampled_fields(const PointFields& fields) {
  std::vector<double> values;
  for (const Eigen::Matrix3d& tensor : {fields.stress_kPa, fields.green_strain}) {
    const SymmetricTensor<double> entries = symmetric_part(tensor);
    values.insert(values.end(), entries.begin(), entries.end());
  }
  if (fields.fibre) {
    const Eigen::Vector3d fibre = fields.fibre->reference.col(0);
    values.insert(values.end(), fibre.begin(), fibre.end());
  }
  const std::vector<double> scalars = scalar_fields(fields);
  values.insert(values.end(), scalars.begin(), scalars.end());
  return Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
}

std::vector<GridArray> sampled_arrays(bool fibres) {
  std::vector<GridArray> arrays{{"cauchy_stress_kPa", 6, {}}, {"green_strain", 6, {}}};
  if (fibres) arrays.push_back({"fibre_direction", 3, {}});
  for (std::string& name : scalar_field_names(fibres))
    arrays.push_back({std::move(name), 1, {}});
  return arrays;
}

BezierGrid solution_grid(const ElasticModel& model, std::span<const SolvedFrame> frames) {
  const HermiteMesh& mesh = model.mesh();
  BezierGrid grid;
  grid.cell_data.push_back({"element", 1, {}});
  for (const LawParameter& parameter : model.law().parameters())
    grid.cell_data.push_back({std::string(parameter.name), 1, {}});
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    append_in_vtk_order(bezier_of(mesh.gather(e, mesh.reference())).transpose(), grid.points_mm);
    grid.cell_data[0].values.push_back(static_cast<double>(e));
    for (size_t i = 0; i < model.law().parameters().size(); ++i)
      grid.cell_data[i + 1].values.push_back(model.element_parameter(i, e));
  }
  for (const SolvedFrame& frame : frames)
    grid.steps.push_back(step_of(model, frame));
  return grid;
}

std::string gauss_table(const ElasticModel& model, std::span<const SolvedFrame> frames) {
  const HermiteMesh& mesh = model.mesh();
  std::string text = "frame,time_s,pressure_kPa,element,point,X_mm,Y_mm,Z_mm,ux_mm,uy_mm,uz_mm,volume_mm3";
  for (const std::string& name : scalar_field_names(static_cast<bool>(model.system().material_axes())))
    text += "," + name;
  text += '\n';
  const auto out = std::back_inserter(text);
  for (size_t f = 0; f < frames.size(); ++f) {
    const SolvedFrame& frame = frames[f];
    for (size_t e = 0; e < mesh.element_count(); ++e) {
      for (size_t q = 0; q < gauss_points; ++q) {
        const MaterialPoint point{e, gauss_tables().xi[q]};
        const PointFields fields = point_fields(model.system(), frame.state, point);
        const double volume_mm3 =
            gauss_tables().weight[q] * mesh.xi_gradient(mesh.reference(), point).determinant();
        fmt::format_to(out, "{},{},{},{},{}", f, frame.time_s, frame.state.pressure_kPa, e, q);
        for (const Eigen::Vector3d& vector : {fields.reference_mm, fields.displacement_mm})
          fmt::format_to(out, ",{},{},{}", vector[0], vector[1], vector[2]);
        fmt::format_to(out, ",{}", volume_mm3);
        for (const double value : scalar_fields(fields))
          fmt::format_to(out, ",{}", value);
        text += '\n';
      }
    }
  }
  return text;
}

}  // namespace diastole
