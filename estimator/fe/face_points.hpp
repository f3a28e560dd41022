#pragma once
// The 5x5 Gauss points of an element face, exact for the products of cubics and their slopes that pressures and
// springs on a face need (degree 8 along each xi).

#include <Eigen/Dense>
#include <array>
#include <cstddef>

#include "estimator/fe/gauss_points.hpp"
#include "estimator/mesh/hermite_mesh.hpp"

namespace diastole {

/// The 16 functions of a face: those whose derivative across the face is not taken and whose corner is on it.
/// Numbered by the two directions (direction + 1) % 3 and (direction + 2) % 3.
inline constexpr size_t face_functions = 16;
inline std::array<size_t, face_functions> face_hermite_functions(const ElementFace& face) {
  std::array<size_t, face_functions> functions;
  const size_t first = (face.direction + 1) % 3;
  const size_t second = (face.direction + 2) % 3;
  for (size_t a = 0; a < face_functions; ++a) {
    functions[a] =
        ((a & 3) << (2 * first)) | ((a >> 2) << (2 * second)) | (2 * face.side << (2 * face.direction));
  }
  return functions;
}

/// The matrix m with m v = a x v.
inline Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& a) {
  Eigen::Matrix3d m;
  m << 0.0, -a[2], a[1], a[2], 0.0, -a[0], -a[1], a[0], 0.0;
  return m;
}

/// One integration point: where it is, its two tangents, and the functions' values and slopes there.
struct FacePoint {
  double weight;  ///< positive
  double sign;    ///< turns first x second into the wall
  Eigen::Vector3d position;
  Eigen::Vector3d first;
  Eigen::Vector3d second;
  std::array<double, face_functions> value;
  std::array<double, face_functions> first_slope;
  std::array<double, face_functions> second_slope;

  /// Into the wall, as long as the area that dxi dxi covers.
  [[nodiscard]] Eigen::Vector3d normal() const { return sign * first.cross(second); }
};

template <class Visit>
void for_each_face_point(const ElementFace& face, const ElementField& position_mm, const Visit& visit) {
  static const LineRule<5> rule = line_rule_5();
  const std::array<size_t, face_functions> functions = face_hermite_functions(face);
  for (size_t q = 0; q < 25; ++q) {
    FacePoint point{};
    point.weight = rule.weight[q % 5] * rule.weight[q / 5];
    point.sign = face.side == 0 ? 1.0 : -1.0;
    point.position.setZero();
    point.first.setZero();
    point.second.setZero();
    const auto hu = hermite_values(rule.place[q % 5]);
    const auto hv = hermite_values(rule.place[q / 5]);
    const auto du = hermite_slopes(rule.place[q % 5]);
    const auto dv = hermite_slopes(rule.place[q / 5]);
    for (size_t a = 0; a < face_functions; ++a) {
      point.value[a] = hu[a & 3] * hv[a >> 2];
      point.first_slope[a] = du[a & 3] * hv[a >> 2];
      point.second_slope[a] = hu[a & 3] * dv[a >> 2];
      const auto node = position_mm.col(static_cast<Eigen::Index>(functions[a]));
      point.position += point.value[a] * node;
      point.first += point.first_slope[a] * node;
      point.second += point.second_slope[a] * node;
    }
    visit(point);
  }
}

}  // namespace diastole
