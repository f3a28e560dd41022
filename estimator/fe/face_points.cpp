#include "estimator/fe/face_points.hpp"

namespace diastole {

std::array<size_t, face_functions> face_hermite_functions(const ElementFace& face) {
  std::array<size_t, face_functions> functions;
  const size_t first = (face.direction + 1) % 3;
  const size_t second = (face.direction + 2) % 3;
  for (size_t a = 0; a < face_functions; ++a) {
    functions[a] =
        ((a & 3) << (2 * first)) | ((a >> 2) << (2 * second)) | (2 * face.side << (2 * face.direction));
  }
  return functions;
}

Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& a) {
  Eigen::Matrix3d m;
  m << 0.0, -a[2], a[1], a[2], 0.0, -a[0], -a[1], a[0], 0.0;
  return m;
}

}  // namespace diastole
