#include "estimator/fe/cavity_load.hpp"

namespace diastole {
using Eigen::Index;
using Eigen::Vector3d;

double face_volume_mm3(const ElementFace& face, const ElementField& position_mm) {
  double volume = 0.0;
  for_each_face_point(face, position_mm, [&](const FacePoint& point) {
    const Vector3d normal = point.normal();
    volume += 0.5 * point.weight * (point.position[0] * normal[0] + point.position[1] * normal[1]);
  });
  return volume;
}

FaceField face_area_mm2(const ElementFace& face, const ElementField& position_mm) {
  FaceField area = FaceField::Zero();
  for_each_face_point(face, position_mm, [&](const FacePoint& point) {
    const Vector3d normal = point.weight * point.normal();
    for (size_t a = 0; a < face_functions; ++a)
      area.col(static_cast<Index>(a)) += point.value[a] * normal;
  });
  return area;
}

FaceTangent face_tangent_mm(const ElementFace& face, const ElementField& position_mm) {
  FaceTangent tangent = FaceTangent::Zero();
  for_each_face_point(face, position_mm, [&](const FacePoint& point) {
    // d(first x second) = first x d(second) - second x d(first)
    const Eigen::Matrix3d with_second = point.weight * point.sign * cross_matrix(point.first);
    const Eigen::Matrix3d with_first = -point.weight * point.sign * cross_matrix(point.second);
    for (size_t b = 0; b < face_functions; ++b) {
      const Eigen::Matrix3d change = with_second * point.second_slope[b] + with_first * point.first_slope[b];
      for (size_t a = 0; a < face_functions; ++a) {
        tangent.block<3, 3>(static_cast<Index>(3 * a), static_cast<Index>(3 * b)) += point.value[a] * change;
      }
    }
  });
  return 0.5 * (tangent + tangent.transpose());
}

}  // namespace diastole
