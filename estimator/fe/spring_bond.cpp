#include "estimator/fe/spring_bond.hpp"

namespace diastole {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Vector3d;

FaceTangent bond_stiffness(const HermiteMesh& mesh, const ElementFace& face, const SpringBond& bond) {
  FaceTangent stiffness = FaceTangent::Zero();
  for_each_face_point(face, mesh.gather(face.element, mesh.reference()), [&](const FacePoint& point) {
    const Vector3d area = point.normal();
    const Vector3d normal = area.normalized();
    const Matrix3d springs =
        point.weight * area.norm() *
        (bond.tangential_kPa_per_mm * Matrix3d::Identity() +
         (bond.normal_kPa_per_mm - bond.tangential_kPa_per_mm) * normal * normal.transpose());
    for (size_t a = 0; a < face_functions; ++a) {
      for (size_t b = 0; b < face_functions; ++b) {
        stiffness.block<3, 3>(static_cast<Index>(3 * a), static_cast<Index>(3 * b)) +=
            point.value[a] * point.value[b] * springs;
      }
    }
  });
  return stiffness;
}

}  // namespace diastole
