#pragma once
// A mesh carried elsewhere: by a rigid motion, from a specimen's axes to a scanner's and back, or to other nodal positions.

#include <Eigen/Dense>

#include "estimator/mesh/hermite_mesh.hpp"

namespace diastole {

/// x = origin_mm + rotation X. Precondition: rotation is one (no mirror image, which would turn elements inside out).
struct Placement {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d origin_mm = Eigen::Vector3d::Zero();

  [[nodiscard]] Eigen::Vector3d operator()(const Eigen::Vector3d& X_mm) const {
    return origin_mm + rotation * X_mm;
  }
  [[nodiscard]] Eigen::Vector3d back(const Eigen::Vector3d& x_mm) const {
    return rotation.transpose() * (x_mm - origin_mm);
  }
};

/// Elements, faces, scale factors and ties of `mesh`, over other nodal positions. Precondition: they keep to the ties.
HermiteMesh with_reference(const HermiteMesh& mesh, NodeField reference_mm);

HermiteMesh placed(const HermiteMesh& mesh, const Placement& placement);

}  // namespace diastole
