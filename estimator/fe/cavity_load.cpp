#include "estimator/fe/cavity_load.hpp"

#include "estimator/fe/gauss_points.hpp"

namespace diastole {
namespace {

using Eigen::Index;
using Eigen::Vector3d;

/// One integration point of a face: where it is, its two tangents and the functions' values there.
struct FacePoint {
  double weight;  ///< positive; the sign turns first x second into the wall
  Vector3d position;
  Vector3d first;
  Vector3d second;
  std::array<double, face_functions> value;
  std::array<double, face_functions> first_slope;
  std::array<double, face_functions> second_slope;

  [[nodiscard]] Vector3d normal(double sign) const { return sign * first.cross(second); }
};

double into_wall(const ElementFace& face) { return face.side == 0 ? 1.0 : -1.0; }

template <class Visit>
void for_each_point(const ElementFace& face, const ElementField& position_mm, const Visit& visit) {
  static const LineRule<5> rule = line_rule_5();
  const std::array<size_t, face_functions> functions = face_hermite_functions(face);
  for (size_t q = 0; q < 25; ++q) {
    const double u = rule.place[q % 5];
    const double v = rule.place[q / 5];
    FacePoint point{rule.weight[q % 5] * rule.weight[q / 5],
                    Vector3d::Zero(),
                    Vector3d::Zero(),
                    Vector3d::Zero(),
                    {},
                    {},
                    {}};
    const auto hu = hermite_values(u);
    const auto hv = hermite_values(v);
    const auto du = hermite_slopes(u);
    const auto dv = hermite_slopes(v);
    for (size_t a = 0; a < face_functions; ++a) {
      point.value[a] = hu[a & 3] * hv[a >> 2];
      point.first_slope[a] = du[a & 3] * hv[a >> 2];
      point.second_slope[a] = hu[a & 3] * dv[a >> 2];
      const auto node = position_mm.col(static_cast<Index>(functions[a]));
      point.position += point.value[a] * node;
      point.first += point.first_slope[a] * node;
      point.second += point.second_slope[a] * node;
    }
    visit(point);
  }
}

/// The matrix m with m v = a x v.
Eigen::Matrix3d cross_matrix(const Vector3d& a) {
  Eigen::Matrix3d m;
  m << 0.0, -a[2], a[1], a[2], 0.0, -a[0], -a[1], a[0], 0.0;
  return m;
}

}  // namespace

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

double face_volume_mm3(const ElementFace& face, const ElementField& position_mm) {
  double volume = 0.0;
  for_each_point(face, position_mm, [&](const FacePoint& point) {
    const Vector3d normal = point.normal(into_wall(face));
    volume += 0.5 * point.weight * (point.position[0] * normal[0] + point.position[1] * normal[1]);
  });
  return volume;
}

FaceField face_area_mm2(const ElementFace& face, const ElementField& position_mm) {
  FaceField area = FaceField::Zero();
  for_each_point(face, position_mm, [&](const FacePoint& point) {
    const Vector3d normal = point.weight * point.normal(into_wall(face));
    for (size_t a = 0; a < face_functions; ++a)
      area.col(static_cast<Index>(a)) += point.value[a] * normal;
  });
  return area;
}

FaceTangent face_tangent_mm(const ElementFace& face, const ElementField& position_mm) {
  FaceTangent tangent = FaceTangent::Zero();
  for_each_point(face, position_mm, [&](const FacePoint& point) {
    // d(first x second) = first x d(second) - second x d(first)
    const Eigen::Matrix3d with_second = point.weight * into_wall(face) * cross_matrix(point.first);
    const Eigen::Matrix3d with_first = -point.weight * into_wall(face) * cross_matrix(point.second);
    for (size_t b = 0; b < face_functions; ++b) {
      const Eigen::Matrix3d change = with_second * point.second_slope[b] + with_first * point.first_slope[b];
      for (size_t a = 0; a < face_functions; ++a) {
        tangent.block<3, 3>(static_cast<Index>(3 * a), static_cast<Index>(3 * b)) += point.value[a] * change;
      }
    }
  });
  // The unsymmetric parts of neighbouring faces cancel along their common edges, and vanish at the rims.
  return 0.5 * (tangent + tangent.transpose());
}

}  // namespace diastole
