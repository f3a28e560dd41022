#include "estimator/fe/face_edge.hpp"

#include <utility>

#include "estimator/fe/face_points.hpp"

namespace diastole {
namespace {

using Eigen::Index;
using Eigen::Vector3d;
using Line = std::array<double, edge_functions>;

/// One integration point of an edge; the weight holds the direction of running and the normal's sign.
struct EdgePoint {
  double weight;
  Vector3d position;
  Vector3d slope;
  Line value;
  Line derivative;
};

bool runs_along_first(const FaceEdge& edge) { return edge.edge % 2 == 0; }

/// Which end of the other direction the edge lies at: 0 or 1.
size_t side_of(const FaceEdge& edge) { return edge.edge == 1 || edge.edge == 2 ? 1 : 0; }

size_t along(const FaceEdge& edge) { return (edge.face.direction + (runs_along_first(edge) ? 1 : 2)) % 3; }
size_t across(const FaceEdge& edge) { return (edge.face.direction + (runs_along_first(edge) ? 2 : 1)) % 3; }

template <class Visit>
void for_each_point(const FaceEdge& edge, const ElementField& position_mm, const Visit& visit) {
  static const LineRule<5> rule = line_rule_5();
  const std::array<size_t, edge_functions> functions = edge_hermite_functions(edge);
  const double sign = (edge.face.side == 0 ? 1.0 : -1.0) * (edge.edge < 2 ? 1.0 : -1.0);
  for (size_t q = 0; q < 5; ++q) {
    EdgePoint point{sign * rule.weight[q], Vector3d::Zero(), Vector3d::Zero(), hermite_values(rule.place[q]),
                    hermite_slopes(rule.place[q])};
    for (size_t a = 0; a < edge_functions; ++a) {
      const auto node = position_mm.col(static_cast<Index>(functions[a]));
      point.position += point.value[a] * node;
      point.slope += point.derivative[a] * node;
    }
    visit(point);
  }
}

}  // namespace

std::array<size_t, edge_functions> edge_hermite_functions(const FaceEdge& edge) {
  std::array<size_t, edge_functions> functions;
  for (size_t a = 0; a < edge_functions; ++a) {
    functions[a] = (a << (2 * along(edge))) | (2 * side_of(edge) << (2 * across(edge))) |
                   (2 * edge.face.side << (2 * edge.face.direction));
  }
  return functions;
}

std::array<size_t, 2> edge_corners(const FaceEdge& edge) {
  const std::array<size_t, edge_functions> functions = edge_hermite_functions(edge);
  return {hermite_corner(functions[0]), hermite_corner(functions[2])};
}

double gap_volume_mm3(const FaceEdge& edge, double plate_z_mm, const ElementField& position_mm) {
  double volume = 0.0;
  for_each_point(edge, position_mm, [&](const EdgePoint& point) {
    const auto& [x, dx] = std::pair(point.position, point.slope);
    volume += 0.5 * point.weight * (x[0] * dx[1] - x[1] * dx[0]) * (x[2] - plate_z_mm);
  });
  return volume;
}

EdgeField gap_area_mm2(const FaceEdge& edge, double plate_z_mm, const ElementField& position_mm) {
  EdgeField area = EdgeField::Zero();
  for_each_point(edge, position_mm, [&](const EdgePoint& point) {
    const Vector3d strip =
        point.weight * (point.position[2] - plate_z_mm) * Vector3d(point.slope[1], -point.slope[0], 0.0);
    for (size_t a = 0; a < edge_functions; ++a)
      area.col(static_cast<Index>(a)) += point.value[a] * strip;
  });
  return area;
}

EdgeTangent gap_tangent_mm(const FaceEdge& edge, double plate_z_mm, const ElementField& position_mm) {
  EdgeTangent tangent = EdgeTangent::Zero();
  for_each_point(edge, position_mm, [&](const EdgePoint& point) {
    const double gap = point.position[2] - plate_z_mm;
    for (size_t b = 0; b < edge_functions; ++b) {
      Eigen::Matrix3d change = Eigen::Matrix3d::Zero();
      change(0, 1) = point.derivative[b] * gap;
      change(1, 0) = -point.derivative[b] * gap;
      change(0, 2) = point.slope[1] * point.value[b];
      change(1, 2) = -point.slope[0] * point.value[b];
      for (size_t a = 0; a < edge_functions; ++a) {
        tangent.block<3, 3>(static_cast<Index>(3 * a), static_cast<Index>(3 * b)) +=
            point.weight * point.value[a] * change;
      }
    }
  });
  return 0.5 * (tangent + tangent.transpose());
}

EdgeTangent rim_skew_mm(const FaceEdge& edge, const ElementField& position_mm) {
  EdgeTangent skew = EdgeTangent::Zero();
  for_each_point(edge, position_mm, [&](const EdgePoint& point) {
    // (v x u) . x' = v . (u x x') = -v . cross_matrix(x') u
    const Eigen::Matrix3d turn = -0.5 * point.weight * cross_matrix(point.slope);
    for (size_t a = 0; a < edge_functions; ++a) {
      for (size_t b = 0; b < edge_functions; ++b) {
        skew.block<3, 3>(static_cast<Index>(3 * a), static_cast<Index>(3 * b)) +=
            point.value[a] * point.value[b] * turn;
      }
    }
  });
  return skew;
}

}  // namespace diastole
