#include "estimator/mesh/fibre_field.hpp"

#include <Eigen/Geometry>
#include <utility>

#include "estimator/mesh/nodal_lines.hpp"
#include "protocol/contract/angle.hpp"

namespace diastole {

Eigen::Matrix3d wall_axes(const HermiteMesh& mesh, const MaterialPoint& point) {
  const Eigen::Matrix3d tangents = mesh.xi_gradient(mesh.reference(), point);
  Eigen::Matrix3d axes;
  axes.col(0) = tangents.col(0).normalized();
  axes.col(2) = tangents.col(0).cross(tangents.col(1)).normalized();
  axes.col(1) = axes.col(2).cross(axes.col(0));
  return axes;
}

FibreField::FibreField(std::vector<double> fibre_deg, std::vector<double> sheet_deg,
                       std::vector<double> transverse_deg)
    : fibre_deg_(std::move(fibre_deg)),
      sheet_deg_(std::move(sheet_deg)),
      transverse_deg_(std::move(transverse_deg)) {}

FibreField FibreField::prolonged(const Refinement& refinement) const {
  const auto finer = [&](const std::vector<double>& nodal) {
    return nodal.empty() ? nodal : refinement.prolonged_corners(nodal);
  };
  return FibreField(finer(fibre_deg_), finer(sheet_deg_), finer(transverse_deg_));
}

double FibreField::fibre_deg(const HermiteMesh& mesh, const MaterialPoint& point) const {
  return between_nodes(mesh, fibre_deg_, point);
}

Eigen::Matrix3d FibreField::material_axes(const HermiteMesh& mesh, const MaterialPoint& point) const {
  using Eigen::AngleAxisd;
  using Eigen::Vector3d;
  const double sheet_deg = sheet_deg_.empty() ? 0.0 : between_nodes(mesh, sheet_deg_, point);
  const double transverse_deg = transverse_deg_.empty() ? 0.0 : between_nodes(mesh, transverse_deg_, point);
  return wall_axes(mesh, point) * AngleAxisd(fibre_deg(mesh, point) * rad_per_deg, Vector3d::UnitZ()) *
         AngleAxisd(-transverse_deg * rad_per_deg, Vector3d::UnitY()) *
         AngleAxisd(sheet_deg * rad_per_deg, Vector3d::UnitX());
}

}  // namespace diastole
