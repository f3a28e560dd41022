#include "estimator/solution/gauss_table.hpp"

#include <fmt/format.h>

#include <iterator>

#include "estimator/fe/elastic_system.hpp"
#include "estimator/fe/gauss_points.hpp"
#include "estimator/fe/point_fields.hpp"

namespace diastole {

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
